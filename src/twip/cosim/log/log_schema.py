"""How the variables of a component become a protobuf message: names, field numbers, bytes, descriptor and metadata.

Every field has a fixed width, and zeros are written too, so that all messages of a channel have one size and layout:

    Real     double    tag + 8 bytes, IEEE 754, bit for bit
    Integer  sfixed64  tag + 8 bytes (32 bits would have to wrap or refuse the wider integers of FMI 3)
    Boolean  bool      tag + 1 byte, 0 or 1

The other types of FMI 3 travel as the widest of their kind: Float32 as double, integers as sfixed64. What they are is
then said in the metadata. Strings are not in these messages, see `log_texts`.

Field names are made of letters, digits and underscores; what a variable is really called stands in the metadata of the
channel: `twip.format` (version of this layout), `twip.start_time` (s), `twip.component` (exact name, empty for the
connectors of the system) and, under the name of each field, a JSON object with name, unit, causality, description and,
where the field's type does not say it, type.
"""

import json
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from google.protobuf.descriptor_pb2 import DescriptorProto, FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet
from numpy.typing import NDArray

from ..model.signals import Channel, Signal
from ..values.types import TYPES, family

FORMAT = "1"
EVENT_TOPIC = "/log"
RESERVED_NUMBERS = range(19000, 20000)
"""Field numbers protobuf keeps for itself."""


@dataclass(frozen=True)
class Wire:
    """How values of one type travel: protobuf field type, wire type of the tag, numpy type of the bytes."""

    field_type: FieldDescriptorProto.Type.ValueType
    wire_type: int
    dtype: str


_DOUBLE = Wire(FieldDescriptorProto.TYPE_DOUBLE, 1, "<f8")
_INTEGER = Wire(FieldDescriptorProto.TYPE_SFIXED64, 1, "<i8")
_BOOLEAN = Wire(FieldDescriptorProto.TYPE_BOOL, 0, "|b1")
_OF_FAMILY = {"Real": _DOUBLE, "Integer": _INTEGER, "Boolean": _BOOLEAN}
WIRES = {name: _OF_FAMILY[family(name)] for name in TYPES if family(name) in _OF_FAMILY}
PLAIN_TYPES = {_DOUBLE.field_type: "Real", _INTEGER.field_type: "Integer", _BOOLEAN.field_type: "Boolean"}
"""What a field is whose metadata does not say it."""


@dataclass(frozen=True)
class Layout:
    """The bytes of one message: tags and zeros in `template`; the value of type `types[i]` starts at `offsets[i]`."""

    types: tuple[str, ...]
    offsets: tuple[int, ...]
    template: NDArray[np.uint8]
    is_tag: NDArray[np.bool_]


def unique_identifiers(names: Sequence[str]) -> list[str]:
    """Return one identifier per name; names that are identifiers keep theirs, others make way with `_2`, `_3`, ….

    Two results differ by more than case and underscores: protobuf derives a JSON name from each (`a_b` → `aB`) and some
    of its libraries refuse a message in which two of these meet.
    """
    bases = [_identifier(name) for name in names]
    found: dict[int, str] = {}
    taken: set[str] = set()
    next_suffix: dict[str, int] = {}
    for position in sorted(range(len(names)), key=lambda i: bases[i] != names[i]):
        base = candidate = bases[position]
        while (key := candidate.replace("_", "").lower()) in taken:
            next_suffix[base] = next_suffix.get(base, 1) + 1
            candidate = f"{base}_{next_suffix[base]}"
        taken.add(key)
        found[position] = candidate
    return [found[position] for position in range(len(names))]


def topics(components: Iterable[str], reserved: Iterable[str] = ()) -> dict[str, str]:
    """Return the topic of each component: `/` + name, dots as `/`; `/system` for the empty name.

    Where two meet, or one meets the topic of the events or a `reserved` one, the later ones in alphabetical order get
    `_2`, `_3`, ….
    """
    taken = {EVENT_TOPIC, *reserved}
    found = {}
    for component in sorted(components):
        topic = base = "/" + (component.replace(".", "/") or "system")
        suffix = 1
        while topic in taken:
            suffix += 1
            topic = f"{base}_{suffix}"
        taken.add(topic)
        found[component] = topic
    return found


def field_numbers(count: int) -> list[int]:
    """Return the first `count` field numbers protobuf allows."""
    last = RESERVED_NUMBERS.start - 1
    return [n if n <= last else n + len(RESERVED_NUMBERS) for n in range(1, count + 1)]


def layout(numbers: Sequence[int], types: Sequence[str]) -> Layout:
    """Return the bytes of a message with these field numbers and types in this order."""
    message = bytearray()
    tag_bytes: list[int] = []
    offsets = []
    for number, type_ in zip(numbers, types, strict=True):
        wire = WIRES[type_]
        tag = varint(number << 3 | wire.wire_type)
        tag_bytes.extend(range(len(message), len(message) + len(tag)))
        message += tag
        offsets.append(len(message))
        message += bytes(np.dtype(wire.dtype).itemsize)
    is_tag = np.zeros(len(message), bool)
    is_tag[tag_bytes] = True
    return Layout(tuple(types), tuple(offsets), np.frombuffer(bytes(message), np.uint8), is_tag)


def descriptor(message_name: str, signals: Sequence[Signal]) -> bytes:
    """Return the serialised FileDescriptorSet of the message `twip.<message_name>`."""
    return message_file(message_name, signals, [WIRES[signal.type].field_type for signal in signals])


def message_file(
    message_name: str, signals: Sequence[Signal], field_types: Sequence[FieldDescriptorProto.Type.ValueType]
) -> bytes:
    """Return the serialised FileDescriptorSet of the message `twip.<message_name>` with a field for each signal."""
    names = unique_identifiers([signal.name for signal in signals])
    fields = [
        FieldDescriptorProto(name=name, number=number, type=kind, label=FieldDescriptorProto.LABEL_OPTIONAL)
        for name, number, kind in zip(names, field_numbers(len(signals)), field_types, strict=True)
    ]
    file = FileDescriptorProto(
        name=f"twip/{message_name}.proto",
        package="twip",
        syntax="proto3",
        message_type=[DescriptorProto(name=message_name, field=fields)],
    )
    data: bytes = FileDescriptorSet(file=[file]).SerializeToString(deterministic=True)
    return data


def channel_metadata(channel: Channel, start_time: float) -> dict[str, str]:
    """Return what a channel says about itself and its fields (layout in the docstring of the module)."""
    metadata = {"twip.format": FORMAT, "twip.start_time": repr(float(start_time)), "twip.component": channel.component}
    for field, signal in zip(unique_identifiers([s.name for s in channel.signals]), channel.signals, strict=True):
        about = {
            "name": signal.name,
            "unit": signal.unit,
            "causality": signal.causality,
            "description": signal.description,
        }
        if signal.type not in (*PLAIN_TYPES.values(), "String"):
            about["type"] = signal.type
        metadata[field] = json.dumps(about, ensure_ascii=False, separators=(",", ":"))
    return metadata


def read_schema(data: bytes, message_name: str, metadata: dict[str, str]) -> tuple[Channel, Layout]:
    """Return the channel that `descriptor` and `channel_metadata` described, and its layout.

    Raises ValueError, KeyError or protobuf's DecodeError where they are not of this module's making. The order is that
    of the field numbers, since tools that rewrite a log may sort the metadata.
    """
    files = FileDescriptorSet.FromString(data).file
    messages = {f"{file.package}.{message.name}": message for file in files for message in file.message_type}
    fields = sorted(messages[message_name].field, key=lambda field: field.number)
    signals = []
    for field in fields:
        about = json.loads(metadata[field.name])
        type_ = about.get("type", PLAIN_TYPES[field.type])
        if WIRES[type_].field_type != field.type:
            raise ValueError(f"{about['name']} is said to be {type_}")
        signals.append(Signal(about["name"], type_, about["unit"], about["causality"], about["description"]))
    channel = Channel(metadata["twip.component"], tuple(signals))
    return channel, layout([field.number for field in fields], [signal.type for signal in signals])


def _identifier(name: str) -> str:
    text = re.sub(r"[^A-Za-z0-9_]", "_", name)
    return text if re.match(r"[A-Za-z]", text) else "x" + text


def varint(value: int) -> bytes:
    """Return a number as protobuf writes it in tags and lengths: 7 bits per byte, the lowest first."""
    data = bytearray()
    while value > 0x7F:
        data.append(value & 0x7F | 0x80)
        value >>= 7
    data.append(value)
    return bytes(data)
