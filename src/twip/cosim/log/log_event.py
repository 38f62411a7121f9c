"""Messages of components and of the master as `foxglove.Log`, the public schema that viewers show as a text log.

Its published fields: timestamp = 1, level = 2, message = 3, name = 4, file = 5, line = 6 (fixed32).
"""

from typing import Any

from google.protobuf.descriptor_pb2 import (
    DescriptorProto,
    EnumDescriptorProto,
    EnumValueDescriptorProto,
    FieldDescriptorProto,
    FileDescriptorProto,
    FileDescriptorSet,
)
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message_factory import GetMessageClass
from google.protobuf.timestamp_pb2 import DESCRIPTOR as TIMESTAMP_FILE

SCHEMA_NAME = "foxglove.Log"
LEVELS = ("unknown", "debug", "info", "warning", "error", "fatal")
"""Names of the levels; the position is the number in the schema."""


def _descriptor() -> FileDescriptorSet:
    timestamp = FileDescriptorProto()
    TIMESTAMP_FILE.CopyToProto(timestamp)
    kind = FieldDescriptorProto
    fields = [
        kind(name="timestamp", number=1, type=kind.TYPE_MESSAGE, type_name=".google.protobuf.Timestamp"),
        kind(name="level", number=2, type=kind.TYPE_ENUM, type_name=".foxglove.Log.Level"),
        kind(name="message", number=3, type=kind.TYPE_STRING),
        kind(name="name", number=4, type=kind.TYPE_STRING),
        kind(name="file", number=5, type=kind.TYPE_STRING),
        kind(name="line", number=6, type=kind.TYPE_FIXED32),
    ]
    for field in fields:
        field.label = kind.LABEL_OPTIONAL
    level = EnumDescriptorProto(
        name="Level", value=[EnumValueDescriptorProto(name=name.upper(), number=n) for n, name in enumerate(LEVELS)]
    )
    log = FileDescriptorProto(
        name="foxglove/Log.proto",
        package="foxglove",
        syntax="proto3",
        dependency=[timestamp.name],
        message_type=[DescriptorProto(name="Log", field=fields, enum_type=[level])],
    )
    return FileDescriptorSet(file=[timestamp, log])


_FILES = _descriptor()
_POOL = DescriptorPool()
for _file in _FILES.file:
    _POOL.Add(_file)
_Log = GetMessageClass(_POOL.FindMessageTypeByName(SCHEMA_NAME))
SCHEMA = _FILES.SerializeToString(deterministic=True)


def encode(nanoseconds: int, level: str, source: str, message: str) -> bytes:
    """Return the protobuf bytes of a message; a level not in `LEVELS` becomes `unknown`."""
    seconds, nanos = divmod(nanoseconds, 1_000_000_000)
    number = LEVELS.index(level) if level in LEVELS else 0
    log = _Log(timestamp={"seconds": seconds, "nanos": nanos}, level=number, message=clean(message), name=clean(source))
    data: bytes = log.SerializeToString(deterministic=True)
    return data


def decode(data: bytes) -> tuple[str, str, str]:
    """Return level, source and message; raises protobuf's DecodeError."""
    log: Any = _Log.FromString(data)
    return LEVELS[log.level] if 0 <= log.level < len(LEVELS) else LEVELS[0], log.name, log.message


def clean(text: str) -> str:
    """Return text that UTF-8 can carry: a stray surrogate (of a path or an FMU's message) becomes an escape."""
    return text.encode("utf-8", "backslashreplace").decode("utf-8")
