"""Time series from a CSV file for the inputs that no connection feeds.

The file has a column `time` in s and one column per input, named `component.variable` or by the connector of the
outermost system, in the unit of the variable or connector. Real values are linear between rows unless the variable is
discrete; all others are held. The first and last values hold outside the file's interval. Two rows at one time are a
jump: the second counts from that time on.
"""

import csv
import difflib
import math
import os
import pathlib
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .parameters import parse_value
from .problems import Place, Problems
from .system import System

_EARLY = 1e-9
"""A row counts as reached within this share of a step before its time, since `start + k * step` is rounded."""


class InputSeries:
    """Values over time for some columns of the recorded table."""

    def __init__(
        self,
        columns: NDArray[np.int32],
        times: NDArray[np.float64],
        table: NDArray[np.float64],
        linear: NDArray[np.bool_],
    ):
        self.columns = columns
        """Driven columns (n,)."""
        self._times = times
        self._table = table
        self._linear = linear

    def at(self, times: NDArray[np.float64], step_size: float) -> NDArray[np.float64]:
        """Return the values (len(times), n) at `times` in s."""
        row = np.clip(
            np.searchsorted(self._times, times + _EARLY * step_size, side="right") - 1, 0, len(self._times) - 1
        )
        after = np.minimum(row + 1, len(self._times) - 1)
        begin, span = self._times[row], self._times[after] - self._times[row]
        share = np.clip((times - begin) / np.where(span > 0.0, span, 1.0), 0.0, 1.0)
        held = self._table[row]
        return np.where(self._linear, held + (self._table[after] - held) * share[:, None], held)


NO_INPUTS = InputSeries(np.zeros(0, np.int32), np.zeros(1), np.zeros((1, 0)), np.zeros(0, np.bool_))


def read_inputs(path: str | os.PathLike[str], system: System) -> InputSeries:
    """Read the CSV file at `path` for the open inputs of `system`. Raises `TwipError` with a line per problem."""
    file = pathlib.Path(path)
    problems = Problems()
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
    problems.raise_any()
    if len(lines) < 2:
        problems.add(f"{path}: {'the file is empty' if not lines else 'there are no rows below the header'}")
        problems.raise_any()
    header = [cell.strip() for cell in lines[0][1]]
    targets = _targets(system, header, Place(file.name, lines[0][0]), problems)
    problems.raise_any()
    types = ["Real", *(type_ for _, type_, _ in targets)]
    rows = [
        row for number, cells in lines[1:] if (row := _row(cells, header, types, Place(file.name, number), problems))
    ]
    for (number, _), previous, current in zip(lines[2:], rows, rows[1:], strict=False):
        if current[0] < previous[0]:
            problems.add(f"time {current[0]!r} follows {previous[0]!r}: time must increase", Place(file.name, number))
    problems.raise_any()
    table = np.array(rows, np.float64)
    return InputSeries(
        np.array([column for column, _, _ in targets], np.int32), table[:, 0].copy(), table[:, 1:].copy(),
        np.array([linear for _, _, linear in targets], np.bool_),
    )  # fmt: skip


def _targets(system: System, header: Sequence[str], place: Place, problems: Problems) -> list[tuple[int, str, bool]]:
    """Return column, type, and whether to interpolate, for each header but `time`."""
    if header[0] != "time":
        problems.add(f"the first column must be time, not {header[0]}", place)
        return []
    names = system.columns
    connected = {copy.destination for copy in system.copies}
    continuous = {
        system.first_column[c.name] + i
        for c in system.components
        for i, v in enumerate(c.inputs)
        if v.variability == "continuous"
    } | {connector.column for connector in system.open_connectors}
    signals = [signal for channel in system.channels for signal in channel.signals]
    targets = []
    for position, name in enumerate(header[1:], 1):
        if name in header[:position]:
            problems.add(f"column {name} is there twice", place)
        elif name not in names:
            close = difflib.get_close_matches(
                name, [n for n, s in zip(names, signals, strict=True) if s.causality == "input"], 1
            )
            problems.add(f"there is no input {name}" + (f", did you mean {close[0]}?" if close else ""), place)
        elif signals[names.index(name)].causality != "input":
            problems.add(f"{name} is not an input", place)
        elif names.index(name) in connected:
            problems.add(f"{name} is connected inside the system and cannot be driven", place)
        else:
            column = names.index(name)
            targets.append((column, signals[column].type, column in continuous and signals[column].type == "Real"))
    return targets


def _row(
    cells: Sequence[str], header: Sequence[str], types: Sequence[str], place: Place, problems: Problems
) -> list[float] | None:
    if len(cells) != len(header):
        problems.add(f"{len(cells)} cells where the header has {len(header)}", place)
        return None
    values = [parse_value(cell, type_) for cell, type_ in zip(cells, types, strict=True)]
    for name, cell, type_, value in zip(header, cells, types, values, strict=True):
        if value is None:
            rule = {"Real": "a finite number", "Integer": "an Integer of 32 bits", "Boolean": "true, false, 1 or 0"}[
                type_
            ]
            problems.add(f"{name} = {cell!r} must be {rule}", place)
    row = [float(value) for value in values if value is not None]
    return row if len(row) == len(header) and all(map(math.isfinite, row)) else None
