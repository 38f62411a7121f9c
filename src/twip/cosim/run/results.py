"""What a run leaves behind: a summary, a table in memory, a CSV file."""

import csv
import io
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import TwipError, UnknownNameError
from ..coupling.variable_loop import VariableSteps
from ..log.log_event import clean
from ..log.sole_file import InUseError, SoleFile
from ..model.message import Message
from ..model.signals import TIME, Channel, columns
from ..reading.wording import nearest
from ..values.strings import text_of
from ..values.types import family
from .pace import RealTime

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


@dataclass(frozen=True)
class Result:
    """What a run did, and all its rows if they went nowhere else: `result["plant.pitch"]` over `result.times`."""

    steps: int
    """Finished steps of this run; the sinks hold one row more, that of the time where it began."""
    start_time: float
    """Simulated time where this run began: the start time, or the time of the checkpoint that it resumed, in s."""
    time: float
    """Simulated time reached, in s."""
    step_size: float
    coupling: str
    wall_time: float
    """Time spent stepping and recording, in s."""
    setup_time: float
    """Time spent unpacking, instantiating, compiling and initializing, in s."""
    interrupted: bool
    """Whether a signal ended the run before its stop time."""
    ended: str
    """Which component ended the run before its stop time, and when; empty if none did."""
    values: dict[str, float | str]
    """The last row by column name; a String as its text."""
    warnings: tuple[str, ...] = ()
    checkpoint: Path | None = None
    """File that holds the state at the end, if one was asked for."""
    signal: int | None = None
    """Number of the signal that ended an interrupted run."""
    real_time: RealTime | None = None
    """Kept and missed deadlines of a run in real time."""
    iterations: int = 0
    """How often the steps of an iterated run were done, in all."""
    variable: VariableSteps | None = None
    """What variable steps were like; `step_size` is then the first."""
    table: Table | None = field(default=None, repr=False)
    """All rows and events of a run that was given no sinks."""

    @property
    def real_time_factor(self) -> float:
        """Simulated time over wall time."""
        return (self.time - self.start_time) / self.wall_time if self.wall_time > 0.0 else float("inf")

    @property
    def times(self) -> NDArray[np.float64]:
        """Times of the rows in s, (rows,); raises `TwipError` when the rows went to sinks."""
        return self._kept.times

    @property
    def continued(self) -> bool:
        """Whether the rows go on from a checkpoint instead of the run's start."""
        return self._kept.continued

    def __contains__(self, name: object) -> bool:
        """Tell whether there is a signal of this name."""
        return name in self._kept

    def __getitem__(self, name: str) -> NDArray[Any]:
        """Return the values of `component.variable`, (rows,)."""
        return self._kept[name]

    @property
    def events(self) -> list[Message]:
        """Messages of the components and of the master."""
        return self._kept.events

    def to_numpy(self) -> NDArray[np.void]:
        """Return all rows as a structured array; see `Table.to_numpy`."""
        return self._kept.to_numpy()

    @property
    def _kept(self) -> Table:
        if self.table is None:
            raise TwipError("the rows of this run went to its sinks, the result does not hold them")
        return self.table


def _line(cells: Sequence[str]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerow(cells)
    return text.getvalue()


def _whole(value: float) -> str:
    return repr(int(value))


def _text(number: float) -> str:
    return _line([clean(text_of(number))])[:-1]


_SHOWN: dict[str, Callable[[float], str]] = {"Real": repr, "String": _text}
"""How a CSV file shows values, by family of the type; others as whole numbers."""


class CsvSink:
    """A sink that writes `time`, every output, and every connector of the outermost system, in full precision."""

    def __init__(self, path: str | os.PathLike[str], channels: Sequence[Channel]):
        """Open the file and create its missing folders; an existing one is replaced by the first `write`.

        Raises `TwipError` when another run writes it or it cannot be written.
        """
        names = columns(channels)
        signals = [(channel.component, signal) for channel in channels for signal in channel.signals]
        self._keep = [i for i, (owner, signal) in enumerate(signals) if signal.causality == "output" or not owner]
        self._shown = [_SHOWN.get(family(signals[i][1].type), _whole) for i in self._keep]
        self._header = _line([TIME, *(names[i] for i in self._keep)])
        self._path = Path(path)
        try:
            self._file = SoleFile(self._path)
        except (OSError, ValueError) as error:
            raise self._failed(error) from None

    def write(self, times: NDArray[np.float64], rows: NDArray[np.float64]) -> None:
        """Append the rows; they are in the file when this returns. Raises `TwipError` when they cannot be written."""
        lines = [self._header] if self._header else []
        self._header = ""
        for time, row in zip(times.tolist(), rows[:, self._keep].tolist(), strict=True):
            cells = [show(v) for v, show in zip(row, self._shown, strict=True)]
            lines.append(f"{','.join([repr(time), *cells])}\n")
        self._append("".join(lines))

    def event(self, time: float, level: str, source: str, message: str) -> None:
        """Messages have no place in a table of numbers."""

    def close(self) -> None:
        """Close the file."""
        try:
            self._file.close()
        except OSError as error:
            raise self._failed(error) from None

    def _append(self, text: str) -> None:
        try:
            self._file.write(text.encode("utf-8"))
        except (OSError, ValueError) as error:
            raise self._failed(error) from None

    def _failed(self, error: OSError | ValueError) -> TwipError:
        reason = (error.strerror if isinstance(error, OSError) else None) or error
        if isinstance(error, InUseError):
            return TwipError(f"{self._path} {reason}")
        return TwipError(f"{self._path}: cannot be written ({reason})")
