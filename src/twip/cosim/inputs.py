"""Time series for the inputs that no connection feeds, from a CSV file or from a scenario.

A CSV file has a column `time` in s and one column per input, named `component.variable` or by the connector of the
outermost system, in the unit of the variable or connector. Real values are linear between rows unless the variable is
discrete; all others are held. The first and last values hold outside the file's interval. Two rows at one time are a
jump: the second counts from that time on.
"""

import csv
import difflib
import os
import pathlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from .problems import Place, Problems
from .scalar_types import TYPES, rule
from .system import System
from .value_types import family
from .values import cannot_travel, in_vector, parse_value

EARLY = 1e-9
"""A time counts as reached within this share of a step before it, since `start + k * step` is rounded."""

SAME_SLOPE = 1e-9
"""Relative difference of slopes that counts as rounding."""

RULES = {name: rule(name) for name in TYPES} | {"Real": "a finite number", "Boolean": "true, false, 1 or 0"}
"""What a value of a type must be."""


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
        held = self.table[row]
        return np.where(self.linear, held + (self.table[after] - held) * share[:, None], held)

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


@dataclass(frozen=True)
class Target:
    """An input that a time series may drive."""

    column: int
    type: str
    linear: bool


def series_of(targets: Sequence[Target], rows: Sequence[Sequence[float]]) -> InputSeries:
    """Return checked rows (time in s, then a value per target) as input series."""
    table = np.array(rows, np.float64)
    linear = np.array([target.linear for target in targets], np.bool_)
    columns = np.array([target.column for target in targets], np.int32)
    texts = tuple(i for i, target in enumerate(targets) if target.type == "String")
    return InputSeries(columns, (Series(table[:, 0].copy(), table[:, 1:].copy(), linear),), texts)


def read_inputs(path: str | os.PathLike[str], system: System, problems: Problems) -> InputSeries:
    """Read the CSV file at `path` for the open inputs of `system`; without inputs when there are problems."""
    file, before = pathlib.Path(path), len(problems.lines)
    lines: list[tuple[int, list[str]]] = []
    begin = 1
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
    if len(problems.lines) > before:
        return NO_INPUTS
    if len(lines) < 2:
        problems.add(f"{path}: {'the file is empty' if not lines else 'there are no rows below the header'}")
        return NO_INPUTS
    header = [cell.strip() for cell in lines[0][1]]
    targets = _targets(system, header, Place(file.name, lines[0][0]), problems)
    if len(problems.lines) > before:
        return NO_INPUTS
    types = ["Real", *(target.type for target in targets)]
    rows = [
        row for number, cells in lines[1:] if (row := _row(cells, header, types, Place(file.name, number), problems))
    ]
    for (number, _), previous, current in zip(lines[2:], rows, rows[1:], strict=False):
        if current[0] < previous[0]:
            problems.add(f"time {current[0]!r} follows {previous[0]!r}: time must increase", Place(file.name, number))
    return NO_INPUTS if len(problems.lines) > before else series_of(targets, rows)


def _targets(system: System, header: Sequence[str], place: Place, problems: Problems) -> list[Target]:
    """Return the target of each header but `time`."""
    if header[0] != "time":
        problems.add(f"the first column must be time, not {header[0]}", place)
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
        close = difflib.get_close_matches(name, inputs, 1)
        return f"there is no input {name}" + (f", did you mean {close[0]}?" if close else "")
    column = names.index(name)
    if signals[column].causality != "input":
        return f"{name} is not an input"
    if any(copy.destination == column for copy in system.copies):
        return f"{name} is connected inside the system and cannot be driven"
    continuous = any(connector.column == column for connector in system.open_connectors) or any(
        v.variability == "continuous"
        for c in system.components
        for i, v in enumerate(c.inputs)
        if system.first_column[c.name] + i == column
    )
    return Target(column, signals[column].type, continuous and family(signals[column].type) == "Real")


def _row(
    cells: Sequence[str], header: Sequence[str], types: Sequence[str], place: Place, problems: Problems
) -> list[float] | None:
    if len(cells) != len(header):
        problems.add(f"{len(cells)} cells where the header has {len(header)}", place)
        return None
    values = [parse_value(cell, type_) for cell, type_ in zip(cells, types, strict=True)]
    for name, cell, type_, value in zip(header, cells, types, values, strict=True):
        if value is None:
            problems.add(f"{name} = {cell!r} must be {RULES[type_]}", place)
        elif why := cannot_travel(type_, value):
            problems.add(f"{name} cannot take {cell}, {why}", place)
    row = [in_vector(v) for v in values if v is not None]
    return row if len(row) == len(header) else None
