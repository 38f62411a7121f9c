"""Reads bench data: recordings from CSV and MCAP, steady samples from CSV."""

import csv
from collections.abc import Mapping
from math import pi
from pathlib import Path

import numpy as np

from ...cosim import ForeignLogError, read_log
from ...errors import TwipError
from .columns import Column, Columns
from .foreign import read_foreign
from .recording import Array, Recording
from .steady import SteadySamples, given_samples

MCAP_MAGIC = b"\x89MCAP"
FEWEST = 100
"""Fewest rows of a time series."""
LARGEST_GAP = 0.1
"""Largest interval between two rows that is bridged, in s."""


def read_data(path: Path, columns: Columns, encoder_resolution: float, zero: float) -> Recording | SteadySamples:
    """Read one file: a recording, or, from a CSV file without a time column, steady samples.

    encoder_resolution: counts per revolution of the motor shaft; zero: time at the beginning in which the motor is
    switched off [s], whose mean current is subtracted; 0: none. Raises TwipError with one line that names file, line
    and column.
    """
    try:
        with path.open("rb") as stream:
            logged = stream.read(5) == MCAP_MAGIC
    except OSError as error:
        raise TwipError(f"{path}: cannot be read ({error.strerror})") from None
    if logged:
        lines = None
        try:
            log = read_log(path)
        except ForeignLogError:
            signals, columns = read_foreign(path, columns)
        else:
            numbers = {name: np.asarray(v, np.float64) for name, v in log.signals.items() if v.dtype != object}
            signals = {"time": log.times, **numbers}
    else:
        signals, lines = _read_csv(path)
    place = str(path)
    found = {quantity: columns.find(quantity, signals, place) for quantity in ("time", "current", "speed", "count")}
    current = found["current"]
    if current is None:
        raise TwipError(
            f"{place}: no column for the current; name it by --current, there are {', '.join(list(signals)[:8])}"
        )
    if "speed" in columns.given and "count" not in columns.given:
        found["count"] = None
    time, speed, count = (_values(signals, found[quantity]) for quantity in ("time", "speed", "count"))
    shaft = count if count is not None else speed
    if shaft is None:
        raise TwipError(f"{place}: no column for the shaft; name it by --count (encoder) or --speed")
    amperes = signals[current.name] * current.factor
    _check_finite(place, signals, [c for c in found.values() if c is not None], lines)
    if time is None:
        if speed is None:
            raise TwipError(f"{place}: steady samples (no time column) need a speed, not counts")
        return given_samples(amperes, speed)
    _check_time(place, time, lines)
    step = 2.0 * pi / encoder_resolution
    time, amperes, shaft = _evenly(time, amperes, shaft)
    if count is not None:
        recording = Recording(place, time, amperes, angle=shaft * step, angle_step=step)
    else:
        recording = Recording(place, time, amperes, speed=shaft)
    return recording.zeroed(zero) if zero > 0.0 else recording


def _values(signals: Mapping[str, Array], column: Column | None) -> Array | None:
    return None if column is None else signals[column.name] * column.factor


def _read_csv(path: Path) -> tuple[dict[str, Array], list[int]]:
    """Return the columns and the line number of each row."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeError) as error:
        raise TwipError(
            f"{path}: cannot be read ({getattr(error, 'strerror', None) or 'it is no text in UTF-8'})"
        ) from None
    numbered = [(n, line) for n, line in enumerate(text.splitlines(), 1) if line.strip() and not line.startswith("#")]
    if len(numbered) < 2:
        raise TwipError(f"{path}: {'there are no rows below the header' if numbered else 'the file is empty'}")
    delimiter = max(",;\t", key=numbered[0][1].count)
    rows = list(csv.reader((line for _, line in numbered), delimiter=delimiter, skipinitialspace=True))
    header = [cell.strip() for cell in rows[0]]
    values = np.empty((len(rows) - 1, len(header)))
    for index, row in enumerate(rows[1:]):
        line = numbered[index + 1][0]
        if len(row) != len(header):
            raise TwipError(f"{path} line {line}: {len(row)} cells where the header has {len(header)}")
        for column, cell in enumerate(row):
            try:
                values[index, column] = float(cell)
            except ValueError:  # a column that nobody asks for may hold words
                values[index, column] = np.nan
    return {name: values[:, column].copy() for column, name in enumerate(header)}, [n for n, _ in numbered[1:]]


def _where(place: str, lines: list[int] | None, row: int) -> str:
    return f"{place} line {lines[row]}" if lines else f"{place} row {row + 1}"


def _check_finite(place: str, signals: Mapping[str, Array], used: list[Column], lines: list[int] | None) -> None:
    for column in used:
        bad = np.flatnonzero(~np.isfinite(signals[column.name]))
        if bad.size:
            raise TwipError(f"{_where(place, lines, int(bad[0]))}: {column.name} must be a finite number")


def _check_time(place: str, time: Array, lines: list[int] | None) -> None:
    if len(time) < FEWEST:
        raise TwipError(f"{place}: {len(time)} rows are too few for a time series, it takes at least {FEWEST}")
    back = np.flatnonzero(np.diff(time) <= 0.0)
    if back.size:
        row = int(back[0]) + 1
        raise TwipError(
            f"{_where(place, lines, row)}: time {time[row]:g} s follows {time[row - 1]:g} s, it must increase"
        )
    steps = np.diff(time)
    gap, usual = int(np.argmax(steps)), float(np.median(steps))
    if steps[gap] > max(LARGEST_GAP, 3.0 * usual):
        raise TwipError(
            f"{_where(place, lines, gap + 1)}: {steps[gap]:g} s after the row before, where {usual:g} s are usual;"
            " cut the file there"
        )


def _evenly(time: Array, current: Array, shaft: Array) -> tuple[Array, Array, Array]:
    """Return equal times and the columns (n,) at them: rows that jitter or lack are interpolated."""
    steps = np.diff(time)
    usual = float(np.median(steps))
    if np.ptp(steps) <= 1e-6 * usual:
        return time, current, shaft
    even = np.linspace(time[0], time[-1], round((time[-1] - time[0]) / usual) + 1)
    return even, np.interp(even, time, current), np.interp(even, time, shaft)
