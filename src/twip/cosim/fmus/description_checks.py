"""Checks of model descriptions that both versions of FMI have in common."""

import math
from typing import Any

from ..reading.problems import Place, Problems
from ..reading.xml import Element


def refuse_twice(root: Element, file: str, problems: Problems) -> None:
    """Report units and types that are defined more than once."""
    for what, path in (("unit", "UnitDefinitions/Unit"), ("type", "TypeDefinitions/*[@name]")):
        seen: set[str | None] = set()
        for item in root.iterfind(path):
            line: Any = item.sourceline
            if item.get("name") in seen:
                problems.add(f"{what} {item.get('name')} is defined twice", Place(file, line))
            seen.add(item.get("name"))


def usable_step(size: float, problems: Problems, place: Place) -> float | None:
    """Return the step of a default experiment in s, None with a warning for one that is none."""
    if size > 0.0 and math.isfinite(size):
        return size
    problems.warn(f"stepSize = {size!r} of DefaultExperiment must be positive, it is ignored", place)
    return None


def usable_nominal(name: str, nominal: float | None, problems: Problems, place: Place) -> float:
    """Return the nominal value of a variable: 1 where there is none, with a warning where it makes no sense."""
    if nominal is None:
        return 1.0
    if nominal != 0.0 and math.isfinite(nominal):
        return abs(nominal)
    problems.warn(f"nominal = {nominal!r} of variable {name} must be positive, it is taken for 1", place)
    return 1.0
