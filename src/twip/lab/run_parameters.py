"""The parameters of a logged run, as its metadata tell them, against the robot's nominal ones."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from ..cosim import Playback
from ..errors import TwipError
from ..robot import PARAMETERS, Parameter

SIDES = ("left", "right")
"""Components that are one of two motors; their friction has nominal values per side."""


@dataclass(frozen=True)
class Given:
    """A start value that the system's files or the command gave; `nominal` is None where the robot has no such one."""

    name: str
    value: str
    nominal: str | None
    unit: str


def given(log: Playback) -> Iterator[Given]:
    """Yield the start values of a run that are not the nominal ones."""
    for title, values in log.metadata.items():
        if not title.startswith("start values "):
            continue
        component = title.removeprefix("start values ")
        for name, value in values.items():
            known = _nominal(component, name)
            if known is None:
                yield Given(f"{component}.{name}", value, None, "")
            elif not _same(value, known.value):
                yield Given(f"{component}.{name}", value, repr(known.value), known.unit)


def number(metadata: Mapping[str, Mapping[str, str]], component: str, name: str, where: str = "") -> float:
    """Return a parameter that the run had: the one given, else the robot's nominal one, in its SI unit.

    `metadata` is that of the run's log (or `System.provenance`), which lies `where`. Raises TwipError when it gives no
    number.
    """
    known = _nominal(component, name)
    text = metadata.get(f"start values {component}", {}).get(name)
    if text is None and known is not None:
        return float(known.value)
    try:
        value = float(text or "")
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        place = f"log {where!r}: " if where else ""
        raise TwipError(f"{place}start value {component}.{name} = {text!r} is no finite number")
    return value


def _nominal(component: str, name: str) -> Parameter | None:
    return PARAMETERS.get(f"{component}.{name}" if component in SIDES else name) or PARAMETERS.get(name)


def _same(text: str, value: float | int | bool) -> bool:
    try:
        return float({"True": "1", "False": "0"}.get(text, text)) == float(value)
    except ValueError:
        return False
