"""Rows of the record as MCAP messages: preallocated bytes in which only times, sequence numbers and values change.

    row      = one message record per channel, in the order of the channels
    message  = opcode 5 | u64 length | u16 channel | u32 sequence | u64 log time | u64 publish time | protobuf fields

Fields at equal distances (neighbours of one type whose tags have one length) are copied as one strided block.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from mcap.opcode import Opcode
from numpy.typing import NDArray

from .log_schema import WIRES, Layout

MESSAGE_HEAD = np.dtype(
    [("opcode", "u1"), ("length", "<u8"), ("channel", "<u2"), ("sequence", "<u4"), ("times", "<u8", 2)]
)
INDEX_HEAD = np.dtype([("opcode", "u1"), ("length", "<u8"), ("channel", "<u2"), ("bytes", "<u4")])


class RowBlock:
    """Up to `capacity` rows as message records; `layouts` holds (channel id, layout) pairs in column order."""

    def __init__(self, layouts: Sequence[tuple[int, Layout]], capacity: int) -> None:
        self.capacity = capacity
        self.channel_ids = [channel_id for channel_id, _ in layouts]
        self.nanoseconds = np.zeros(capacity, np.uint64)
        self.row_size = sum(MESSAGE_HEAD.itemsize + layout.template.size for _, layout in layouts)
        self._data = np.zeros((capacity, self.row_size), np.uint8)
        self._starts: list[int] = []
        self._heads: list[NDArray[np.void]] = []
        self._runs: list[tuple[slice, NDArray[np.generic]]] = []
        start = column = 0
        for channel_id, layout in layouts:
            head = self._view(MESSAGE_HEAD, start)
            head["opcode"] = Opcode.MESSAGE
            head["length"] = MESSAGE_HEAD.itemsize - 9 + layout.template.size
            head["channel"] = channel_id
            self._starts.append(start)
            self._heads.append(head)
            start += MESSAGE_HEAD.itemsize
            self._data[:, start : start + layout.template.size] = layout.template
            for first, last in _runs(layout):
                step = layout.offsets[first + 1] - layout.offsets[first] if last > first + 1 else 1
                values = self._view(
                    np.dtype(WIRES[layout.types[first]].dtype), start + layout.offsets[first], last - first, step
                )
                self._runs.append((slice(column + first, column + last), values))
            start += layout.template.size
            column += len(layout.types)
        self._index = self._new_index(capacity)

    def put(
        self, at: int, sequence: int, nanoseconds: NDArray[np.uint64], rows: NDArray[np.float64]
    ) -> tuple[int, int] | None:
        """Lay out `rows` (n, columns) from row `at` of the block on.

        Returns None, or (row, column) of a value that is not of its type: a fraction in an Integer, other than 0 and 1
        in a Boolean. The rows before it are laid out whole.
        """
        here = slice(at, at + len(rows))
        self.nanoseconds[here] = nanoseconds
        numbers = np.arange(sequence, sequence + len(rows)).astype(np.uint32)
        for head in self._heads:
            head["sequence"][here] = numbers
            head["times"][here] = nanoseconds[:, None]
        wrong: list[tuple[int, int]] = []
        for columns, values in self._runs:
            given = rows[:, columns]
            if values.dtype.kind == "f":
                values[here] = given
                continue
            with np.errstate(invalid="ignore"):
                values[here] = given
            wrong += [(int(row), columns.start + int(column)) for row, column in np.argwhere(values[here] != given)[:1]]
        return min(wrong, default=None)

    def data(self, count: int) -> memoryview:
        """Return the message records of the first `count` rows, `row_size` bytes each."""
        return self._data[:count].reshape(-1).data

    def index(self, count: int, shift: NDArray[np.int64] | None) -> tuple[memoryview, int]:
        """Return the index records of the first `count` rows and the size of one; row i lies `shift[i]` bytes late."""
        index = self._index if count == self.capacity else self._new_index(count)
        offsets = np.arange(count) * self.row_size
        if shift is not None:
            offsets += shift
        index["entries"][:, :, 0] = self.nanoseconds[:count]
        index["entries"][:, :, 1] = offsets + np.array(self._starts)[:, None]
        return index.view(np.uint8).data, index.itemsize

    def _new_index(self, count: int) -> NDArray[np.void]:
        index = np.zeros(len(self.channel_ids), np.dtype([("head", INDEX_HEAD), ("entries", "<u8", (count, 2))]))
        index["head"]["opcode"] = Opcode.MESSAGE_INDEX
        index["head"]["length"] = index.itemsize - 9
        index["head"]["channel"] = self.channel_ids
        index["head"]["bytes"] = 16 * count
        return index

    def _view(self, dtype: np.dtype[Any], offset: int, count: int = 0, step: int = 1) -> NDArray[Any]:
        """Return the values at `offset`: shape (capacity,), or (capacity, count) with values `step` bytes apart."""
        shape = (self.capacity, count) if count else (self.capacity,)
        strides = (self.row_size, step) if count else (self.row_size,)
        return np.ndarray(shape, dtype, self._data.data, offset, strides)


def _runs(layout: Layout) -> list[tuple[int, int]]:
    """Return (first, last exclusive) of the longest runs of fields of one type at equal distances."""
    runs: list[tuple[int, int]] = []
    first = 0
    for last in range(1, len(layout.types) + 1):
        whole = last == len(layout.types) or layout.types[last] != layout.types[first]
        if not whole and last > first + 1:
            whole = layout.offsets[last] - layout.offsets[last - 1] != layout.offsets[first + 1] - layout.offsets[first]
        if whole:
            runs.append((first, last))
            first = last
    return runs
