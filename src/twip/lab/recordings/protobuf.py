"""Decodes messages in protobuf by the descriptors that are recorded with them (a FileDescriptorSet)."""

from collections.abc import Callable, Mapping, Sequence
from graphlib import TopologicalSorter
from typing import Any

from google.protobuf.descriptor_pb2 import FileDescriptorSet
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message import Message
from google.protobuf.message_factory import GetMessageClass


def decoder(name: str, schema: bytes) -> Callable[[bytes], Any]:
    """Return what turns messages of the type `name` into mappings; raises what protobuf raises at a broken schema."""
    pool = DescriptorPool()
    files = {file.name: file for file in FileDescriptorSet.FromString(schema).file}
    for needed in TopologicalSorter({file.name: file.dependency for file in files.values()}).static_order():
        if needed in files:
            pool.Add(files[needed])
    made = GetMessageClass(pool.FindMessageTypeByName(name))
    return lambda data: _plain(made.FromString(data))


def _plain(message: Message) -> dict[str, Any]:
    """Return the fields of a message, without those that can be absent and are."""
    return {
        field.name: _value(getattr(message, field.name))
        for field in message.DESCRIPTOR.fields
        if not field.has_presence or message.HasField(field.name)
    }


def _value(value: Any) -> Any:
    if isinstance(value, Message):
        return _plain(value)
    if isinstance(value, str | bytes):
        return None
    if isinstance(value, Mapping):
        return {str(key): _value(value[key]) for key in value}
    if isinstance(value, Sequence):
        return [_value(item) for item in value]
    return value
