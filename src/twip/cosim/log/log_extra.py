"""Channels that a caller adds to a log beside those of the components: what viewers need to show more than numbers.

The master does not know what they mean: a channel says how it is declared, and turns rows of the run into messages.
"""

import struct
from collections.abc import Sequence
from typing import Protocol

import numpy as np
from mcap import records
from mcap.opcode import Opcode
from numpy.typing import NDArray

from .log_rows import MESSAGE_HEAD

HEAD = struct.Struct("<BQH")
"""Opcode, length and channel of a message."""


class ExtraChannel(Protocol):
    """A channel of someone else's schema; names and encodings as MCAP's registry has them."""

    @property
    def topic(self) -> str:
        """Topic; a component that would have it gets another."""

    @property
    def message_encoding(self) -> str:
        """`protobuf`, `cdr`, `json`, …."""

    @property
    def schema_name(self) -> str:
        """Name of the schema."""

    @property
    def schema_encoding(self) -> str:
        """`protobuf`, `ros2msg`, `jsonschema`, …."""

    @property
    def schema(self) -> bytes:
        """The schema."""

    def messages(
        self, nanoseconds: NDArray[np.uint64], rows: NDArray[np.float64]
    ) -> tuple[NDArray[np.uint64], NDArray[np.uint8]]:
        """Return times (m,) in ns and messages (m, bytes) for the next rows (n, columns) of the run at `nanoseconds`.

        The times lie within those of the rows and do not decrease. Rows come once each, in order, in pieces of any
        size.
        """


class ExtraWriter:
    """Numbers and frames the messages of one extra channel."""

    def __init__(self, channel: ExtraChannel, channel_id: int) -> None:
        self._channel = channel
        self.id = channel_id
        self._count = 0

    def records(self, nanoseconds: NDArray[np.uint64], rows: NDArray[np.float64]) -> list[tuple[int, bytes]]:
        """Return (time in ns, message record) for the next rows."""
        times, bodies = self._channel.messages(nanoseconds, rows)
        if not len(times):
            return []
        count, size = len(times), MESSAGE_HEAD.itemsize + bodies.shape[1]
        whole = np.empty((count, size), np.uint8)
        whole[:, : HEAD.size] = np.frombuffer(HEAD.pack(Opcode.MESSAGE, size - 9, self.id), np.uint8)
        numbers = np.ndarray(count, "<u4", whole.data, HEAD.size, (size,))
        numbers[:] = np.arange(self._count, self._count + count) & 0xFFFFFFFF
        np.ndarray((count, 2), "<u8", whole.data, HEAD.size + 4, (size, 8))[:] = times[:, None]
        whole[:, MESSAGE_HEAD.itemsize :] = bodies
        self._count += count
        data = whole.tobytes()
        return [(time, data[i * size : (i + 1) * size]) for i, time in enumerate(times.tolist())]


def declare(
    extras: Sequence[ExtraChannel], first: int
) -> tuple[list[records.Schema], list[records.Channel], list[ExtraWriter]]:
    """Return schema and channel records with ids from `first` on, and the writers of their messages."""
    numbered = list(enumerate(extras, first))
    return (
        [records.Schema(i, e.schema, e.schema_encoding, e.schema_name) for i, e in numbered],
        [
            records.Channel(id=i, topic=e.topic, message_encoding=e.message_encoding, metadata={}, schema_id=i)
            for i, e in numbered
        ],
        [ExtraWriter(e, i) for i, e in numbered],
    )
