"""The rows of a run in memory."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import UnknownNameError
from ..model.message import Message
from ..model.signals import TIME, Channel, columns
from ..reading.wording import nearest
from ..values.strings import text_of
from ..values.types import family

_DTYPES = {"Real": "f8", "Integer": "i8", "Boolean": "?", "String": "O"}
"""By family of the type."""


@dataclass
class Table:
    """A sink that keeps everything in memory: `table["plant.pitch"]` is an array over `table.times`.

    A run without sinks keeps one in its result; a table of one's own also survives a run that fails.
    """

    channels: Sequence[Channel]
    events: list[Message] = field(default_factory=list)
    continued: bool = False
    """Whether the rows go on from a checkpoint instead of the run's start."""

    def __post_init__(self) -> None:
        self.columns = columns(self.channels)
        self._index = {name: i for i, name in enumerate(self.columns)}
        types = [signal.type for channel in self.channels for signal in channel.signals]
        self._texts = {i for i, type_ in enumerate(types) if type_ == "String"}
        self._times: list[NDArray[np.float64]] = []
        self._rows: list[NDArray[np.float64]] = []
        self.closed = False

    def write(self, times: NDArray[np.float64], rows: NDArray[np.float64]) -> None:
        """Keep copies of the rows."""
        self._times.append(times.copy())
        self._rows.append(rows.copy())

    def event(self, time: float, level: str, source: str, message: str) -> None:
        """Keep the message in `events`."""
        self.events.append(Message(time, level, source, message))

    def close(self) -> None:
        """Mark the table as complete."""
        self.closed = True

    @property
    def times(self) -> NDArray[np.float64]:
        """Times of the rows in s, (rows,)."""
        return np.concatenate([np.zeros(0), *self._times])

    @property
    def values(self) -> NDArray[np.float64]:
        """All rows, (rows, columns); a String is the number that `texts.text_of` takes."""
        return np.concatenate([np.zeros((0, len(self.columns))), *self._rows])

    def to_numpy(self) -> NDArray[np.void]:
        """Return a structured array (rows,) with the field `time` in s and one per column, of the variable's type."""
        signals = [signal for channel in self.channels for signal in channel.signals]
        kinds = [(name, _DTYPES[family(signal.type)]) for name, signal in zip(self.columns, signals, strict=True)]
        values, array = self.values, np.empty(len(self.times), np.dtype([(TIME, "f8"), *kinds]))
        array[TIME] = self.times
        for i, (name, _) in enumerate(kinds):
            array[name] = self[name] if i in self._texts else values[:, i]
        return array

    def __contains__(self, name: object) -> bool:
        """Tell whether there is a column of this name."""
        return name in self._index

    def __getitem__(self, name: str) -> NDArray[Any]:
        """Return the values of a column (rows,): float64, or the texts of a String. Raises `UnknownNameError`."""
        if name not in self._index:
            near = nearest(name, self.columns, 3)
            hint = f"; near: {', '.join(near)}" if near else ""
            raise UnknownNameError(f"there is no column {name}{hint}", name=name, near=near)
        i = self._index[name]
        found = np.concatenate([np.zeros(0), *(rows[:, i] for rows in self._rows)])
        return np.array([text_of(number) for number in found], object) if i in self._texts else found
