"""Time series for the inputs that no connection feeds, from a CSV file or from a scenario.

A CSV file has a column `time` in s and one column per input, named `component.variable` or by the connector of the
outermost system, in the unit of the variable or connector; items of an enumeration by name or number. Real values are
linear between rows unless the variable is discrete; all others are held. A connector that feeds a discrete input is
held, for continuous ones behind it too. The first and last values hold outside the file's interval. Two rows at one
time are a jump: the second counts from that time on.
"""

import csv
import os
import pathlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..model.system import System
from ..reading.files import is_endless
from ..reading.problems import Place, Problems
from ..reading.wording import did_you_mean
from ..values.types import family
from ..values.written import cannot_travel, in_vector, parse_value
from .targets import RULES, Target, ends_of, objections, signal_type

EARLY = 1e-9
"""A time counts as reached within this share of a step before it, since `start + k * step` is rounded."""

SAME_SLOPE = 1e-9
"""Relative difference of slopes that counts as rounding."""


class Part(Protocol):
    """Values of some columns over time."""

    def at(self, times: NDArray[np.float64], step_size: float) -> NDArray[np.float64]:
        """Return the values (len(times), columns) at `times` in s."""

    def events(self) -> NDArray[np.float64]:
        """Return the times in s at which a value or its slope jumps, as far as they are known beforehand."""


@dataclass(frozen=True)
class Series:
    """Values of some columns at common times."""

    times: NDArray[np.float64]
    """In s, (rows,), not decreasing."""
    table: NDArray[np.float64]
    """Values, (rows, columns)."""
    linear: NDArray[np.bool_]
    """Whether a column is linear between rows, (columns,)."""

    def at(self, times: NDArray[np.float64], step_size: float) -> NDArray[np.float64]:
        """Return the values (len(times), columns) at `times` in s."""
        row = np.clip(np.searchsorted(self.times, times + EARLY * step_size, side="right") - 1, 0, len(self.times) - 1)
        after = np.minimum(row + 1, len(self.times) - 1)
        begin, span = self.times[row], self.times[after] - self.times[row]
        share = np.clip((times - begin) / np.where(span > 0.0, span, 1.0), 0.0, 1.0)
        held, next_, share = self.table[row], self.table[after], share[:, None]
        with np.errstate(over="ignore", invalid="ignore"):
            between = held + (next_ - held) * share
        between = np.where(np.isfinite(between), between, held * (1.0 - share) + next_ * share)
        return np.where(self.linear, between, held)

    def moving(self) -> NDArray[np.bool_]:
        """Return whether values change between rows at different times (columns,)."""
        apart = (np.diff(self.times) > 0.0)[:, None]
        moving: NDArray[np.bool_] = ((self.table[1:] != self.table[:-1]) & apart).any(axis=0)
        return moving

    def events(self) -> NDArray[np.float64]:
        """Return the times in s at which a value or its slope jumps."""
        change, span = np.diff(self.table, axis=0), np.diff(self.times)[:, None]
        jumping = (change != 0.0) & ((span == 0.0) | ~self.linear)
        slope = np.where(self.linear, change, 0.0) / np.where(span > 0.0, span, np.inf)
        none = np.zeros((1, len(self.linear)))
        slope = np.vstack([none, slope, none])
        bend = np.abs(np.diff(slope, axis=0)) > SAME_SLOPE * np.maximum(np.abs(slope[1:]), np.abs(slope[:-1]))
        times: NDArray[np.float64] = self.times[(np.vstack([none > 0.0, jumping]) | bend).any(axis=1)]
        return times


@dataclass(frozen=True)
class InputSeries:
    """Values over time for some columns of the recorded table."""

    columns: NDArray[np.int32]
    """Driven columns (n,), those of the parts one after the other."""
    parts: tuple[Part, ...]
    texts: tuple[int, ...] = ()
    """Which of them, from 0 to n, are Strings: the values are numbers of texts."""

    def at(self, times: NDArray[np.float64], step_size: float) -> NDArray[np.float64]:
        """Return the values (len(times), n) at `times` in s."""
        return np.hstack([np.zeros((len(times), 0)), *(part.at(times, step_size) for part in self.parts)])

    def events(self) -> set[float]:
        """Return the times in s at which a value or its slope jumps."""
        return {time for part in self.parts for time in part.events().tolist()}

    def __add__(self, other: "InputSeries") -> "InputSeries":
        texts = self.texts + tuple(len(self.columns) + i for i in other.texts)
        return InputSeries(np.concatenate([self.columns, other.columns]), self.parts + other.parts, texts)


NO_INPUTS = InputSeries(np.zeros(0, np.int32), ())


def series_of(targets: Sequence[Target], rows: Sequence[Sequence[float]]) -> InputSeries:
    """Return checked rows (time in s, then a value per target) as input series."""
    table = np.array(rows, np.float64)
    linear = np.array([target.linear for target in targets], np.bool_)
    columns = np.array([target.column for target in targets], np.int32)
    texts = tuple(i for i, target in enumerate(targets) if target.type == "String")
    return InputSeries(columns, (Series(table[:, 0].copy(), table[:, 1:].copy(), linear),), texts)


def read_inputs(path: str | os.PathLike[str], system: System, problems: Problems) -> InputSeries:
    """Read the CSV file at `path` for the open inputs of `system`; without inputs when there are problems."""
    file, checking = pathlib.Path(path), problems.checking()
    lines: list[tuple[int, list[str]]] = []
    begin = 1
    if is_endless(file):
        problems.add(f"{path} is a device, not a file")
        return NO_INPUTS
    try:
        with file.open(newline="", encoding="utf-8-sig") as stream:
            reader = csv.reader(stream, skipinitialspace=True, strict=True)
            for cells in reader:
                if any(cell.strip() for cell in cells):
                    lines.append((reader.line_num, cells))
                begin = reader.line_num + 1
    except (OSError, UnicodeError) as error:
        problems.add(f"{path}: cannot be read ({getattr(error, 'strerror', None) or error})")
    except csv.Error as error:
        reason = "a quote is not closed" if "end of data" in str(error) else str(error)
        problems.add(f"not readable as CSV: {reason}", Place(file.name, begin))
    if checking.failed:
        return NO_INPUTS
    if len(lines) < 2:
        problems.add(f"{path}: {'the file is empty' if not lines else 'there are no rows below the header'}")
        return NO_INPUTS
    header = [cell.strip() for cell in lines[0][1]]
    targets = _targets(system, header, Place(file.name, lines[0][0]), problems)
    if checking.failed:
        return NO_INPUTS
    rows = [row for number, cells in lines[1:] if (row := _row(cells, targets, Place(file.name, number), problems))]
    for (number, _), previous, current in zip(lines[2:], rows, rows[1:], strict=False):
        if current[0] < previous[0]:
            problems.add(f"time {current[0]!r} follows {previous[0]!r}: time must increase", Place(file.name, number))
    return NO_INPUTS if checking.failed else series_of(targets, rows)


def _targets(system: System, header: Sequence[str], place: Place, problems: Problems) -> list[Target]:
    """Return the target of each header but `time`."""
    if header[0] != "time":
        problems.add("the first column", place, rule=f"must be time, not {header[0]}")
        return []
    targets = []
    for position, name in enumerate(header[1:], 1):
        if name in header[:position]:
            problems.add(f"column {name} is there twice", place)
            continue
        target = find_target(system, name)
        if isinstance(target, str):
            problems.add(target, place)
        else:
            targets.append(target)
    return targets


def find_target(system: System, name: str) -> Target | str:
    """Return the open input called `name` (`component.variable` or a connector of the outermost system), or why a time
    series cannot drive it.
    """
    names = system.columns
    signals = [signal for channel in system.channels for signal in channel.signals]
    if name not in names:
        inputs = [n for n, s in zip(names, signals, strict=True) if s.causality == "input"]
        return f"there is no input {name}{did_you_mean(name, inputs)}"
    column = names.index(name)
    if signals[column].causality != "input":
        return f"{name} is not an input"
    if any(copy.destination == column for copy in system.copies):
        return f"{name} is connected inside the system and cannot be driven"
    return Target(name, column, *signal_type(system, column), ends_of(system, column))


def held_connectors(system: System, inputs: InputSeries) -> list[str]:
    """Return a warning for each connector whose values change between rows, but are held for a discrete input."""
    found, columns = [], iter(inputs.columns.tolist())
    for part in inputs.parts:
        moving = part.moving().tolist() if isinstance(part, Series) else []
        for moves, column in zip(moving, columns, strict=False):
            ends = ends_of(system, column)
            discrete = [end.name for end in ends if end.variable.variability == "discrete"]
            reals = family(signal_type(system, column)[0]) == "Real"
            if moves and reals and 0 < len(discrete) < len(ends):
                found.append(
                    f"{system.columns[column]} is held between the rows of its time series, as {', '.join(discrete)}"
                    " behind it is discrete"
                )
    return found


def _row(cells: Sequence[str], targets: Sequence[Target], place: Place, problems: Problems) -> list[float] | None:
    if len(cells) != 1 + len(targets):
        problems.add(f"{len(cells)} cells where the header has {1 + len(targets)}", place)
        return None
    values = [parse_value(cells[0], "Real")]
    if values[0] is None:
        problems.add(f"time = {cells[0]!r}", place, rule=f"must be {RULES['Real']}")
    for target, cell in zip(targets, cells[1:], strict=True):
        value = parse_value(cell, target.type, target.items)
        values.append(value)
        if value is None:
            problems.add(f"{target.name} = {cell!r}", place, rule=f"must be {RULES[target.type]}")
        elif why := cannot_travel(target.type, value):
            problems.add(f"{target.name} cannot take {cell}, {why}", place)
        else:
            problems.take(objections(target.name, value, target.ends), place)
    row = [in_vector(v) for v in values if v is not None]
    return row if len(row) == len(values) else None
