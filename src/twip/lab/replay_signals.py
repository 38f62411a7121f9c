"""Chosen signals of anybody's MCAP file as an FMU, `NAME=TOPIC.FIELD[:UNIT]` each."""

import keyword
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import TwipError
from ..fmi import NAME, Recording, Variable, write_replay
from .recordings import Series, open_log


@dataclass(frozen=True)
class Choice:
    """An output of the FMU: its name, the signal it plays, and its unit; a unit makes it a Real."""

    name: str
    signal: str
    unit: str | None


def choices(texts: Sequence[str]) -> list[Choice]:
    """Return what `--signals` says; a name that has colons and no unit ends in one.

    Raises TwipError that names everything that is wrong with it.
    """
    found: list[Choice] = []
    problems = []
    for text in texts:
        name, equals, rest = text.partition("=")
        signal, _, unit = rest.rpartition(":") if ":" in rest else (rest, "", "")
        if not (equals and signal) or not unit.isprintable():
            problems.append(f"--signals {text}: it must be NAME=TOPIC.FIELD or NAME=TOPIC.FIELD:UNIT")
        elif not NAME.fullmatch(name) or any(map(keyword.iskeyword, name.split("."))):
            problems.append(f"--signals {text}: {name!r} must be made of identifiers, joined by dots")
        elif any(name == other.name for other in found):
            problems.append(f"--signals {text}: there are two outputs of the name {name}")
        else:
            found.append(Choice(name, signal, unit or None))
    if problems:
        raise TwipError(problems)
    return found


def replay_signals(log: Path, signals: Sequence[str], output: Path, linear: bool = False) -> None:
    """Write an FMU that plays signals of `log`, each written as `NAME=TOPIC.FIELD[:UNIT]`.

    `linear`: Real signals are linear between their rows instead of held. Signals have the times of their own topics;
    the FMU has a row at each of them. Raises TwipError when the file cannot be read or lacks a signal.
    """
    chosen = choices(signals)
    series = open_log(log).series(choice.signal for choice in chosen)
    flags = [c.name for c in chosen if c.unit and series[c.signal].kind == "Boolean"]
    if flags:
        raise TwipError(f"{log}: {name} is Boolean and has no unit" for name in flags)
    kinds = ["Real" if c.unit else series[c.signal].kind for c in chosen]
    variables = tuple(
        Variable(
            c.name,
            "output",
            "continuous" if linear and kind == "Real" else "discrete",
            kind,
            c.unit,
            description=f"recorded {c.signal}",
        )
        for c, kind in zip(chosen, kinds, strict=True)
    )
    times = np.unique(np.concatenate([series[c.signal].times for c in chosen]))
    columns = tuple(
        _at(series[c.signal], times, linear and kind == "Real").tolist() for c, kind in zip(chosen, kinds, strict=True)
    )
    text = f"Signals played from {log.name}"
    write_replay(Recording(output.stem, text, variables, times.tolist(), columns), output)


def _at(series: Series, times: NDArray[np.float64], linear: bool) -> NDArray[np.float64]:
    """Return the values at `times` (n,), which include the signal's own: held or linear, the first one before them."""
    if linear:
        return np.interp(times, series.times, series.values)
    last = np.searchsorted(series.times, times, side="right") - 1
    held: NDArray[np.float64] = series.values[np.maximum(last, 0)]
    return held
