"""String variables in a log: a channel `<topic>/strings` per component, with a message whenever one of them changes.

A message has a string field for each of the component's String variables, named as `log_schema` names fields; it holds
all of them, from its time on. The metadata of the channel is that of `log_schema.channel_metadata`; besides, it has
`twip.kind` = `strings` and, in each field's JSON object, `column`: the place among all variables of the component.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from google.protobuf.descriptor_pb2 import FieldDescriptorProto, FileDescriptorSet
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message_factory import GetMessageClass
from numpy.typing import NDArray

from ..model.signals import Channel, Signal
from ..values.strings import text_of
from .log_event import clean
from .log_schema import channel_metadata, field_numbers, message_file, unique_identifiers, varint

KIND = "strings"


@dataclass
class TextColumns:
    """The String variables of a component."""

    channel: Channel
    """With these variables only."""
    positions: list[int]
    """Among all variables of the component."""
    columns: list[int]
    """Of the recorded table."""
    last: list[float] = field(default_factory=list)

    def changes(self, rows: NDArray[np.float64]) -> Iterator[tuple[int, bytes]]:
        """Yield the index of each of `rows` (n, columns) in which a text differs from the row before, and a message."""
        for i, row in enumerate(rows[:, self.columns].tolist()):
            if row != self.last:
                self.last = row
                yield i, encode([text_of(number) for number in row])

    def metadata(self, start_time: float) -> dict[str, str]:
        """Return what the channel says about itself."""
        found = channel_metadata(self.channel, start_time)
        names = unique_identifiers([signal.name for signal in self.channel.signals])
        for name, position in zip(names, self.positions, strict=True):
            found[name] = json.dumps(
                {**json.loads(found[name]), "column": position}, ensure_ascii=False, separators=(",", ":")
            )
        return {**found, "twip.kind": KIND}


def text_columns(channels: Sequence[Channel]) -> list[TextColumns]:
    """Return the String variables of each component that has some."""
    found, first = [], 0
    for channel in channels:
        positions = [i for i, signal in enumerate(channel.signals) if signal.type == "String"]
        if positions:
            own = Channel(channel.component, tuple(channel.signals[i] for i in positions))
            found.append(TextColumns(own, positions, [first + i for i in positions]))
        first += len(channel.signals)
    return found


def descriptor(message_name: str, signals: Sequence[Signal]) -> bytes:
    """Return the serialised FileDescriptorSet of the message `twip.<message_name>`."""
    return message_file(message_name, signals, [FieldDescriptorProto.TYPE_STRING] * len(signals))


def encode(texts: Sequence[str]) -> bytes:
    """Return the protobuf bytes of a message."""
    message = bytearray()
    for number, text in zip(field_numbers(len(texts)), texts, strict=True):
        data = clean(text).encode()
        message += varint(number << 3 | 2) + varint(len(data)) + data
    return bytes(message)


class TextReader:
    """Reads the messages of a channel of texts.

    Raises ValueError, KeyError, TypeError or protobuf's DecodeError where it is not of this module's making.
    """

    def __init__(self, schema: bytes, message_name: str, metadata: Mapping[str, str]):
        pool = DescriptorPool()
        for file in FileDescriptorSet.FromString(schema).file:
            pool.Add(file)
        kind: Any = pool.FindMessageTypeByName(message_name)
        self._message: Any = GetMessageClass(kind)
        self._fields = [item.name for item in kind.fields]
        self.component = metadata["twip.component"]
        self.signals: list[tuple[int, Signal]] = []
        """The variables, each with its place among all variables of the component."""
        for name in self._fields:
            about = json.loads(metadata[name])
            signal = Signal(about["name"], "String", about["unit"], about["causality"], about["description"])
            self.signals.append((int(about["column"]), signal))

    def decode(self, data: bytes) -> list[str]:
        """Return the texts of a message, in the order of `signals`."""
        message = self._message.FromString(data)
        return [str(getattr(message, name)) for name in self._fields]


def held(times: NDArray[np.uint64], changes: Sequence[tuple[int, list[str]]], count: int) -> list[NDArray[np.object_]]:
    """Return the values of `count` variables at `times` [ns]: of each change (time [ns], texts) until the next."""
    ordered = sorted(changes, key=lambda change: change[0])
    reached = np.searchsorted(np.array([time for time, _ in ordered], np.uint64), times, side="right")
    texts = [[""] * count, *(texts for _, texts in ordered)]
    return [np.array([texts[i][j] for i in reached.tolist()], object) for j in range(count)]
