"""Elements with one dotted name (punning): `B.C` beside the element `C` of the system `B`.

Parameters go by hierarchical names, and one that two elements share stands for both (SSP 2.0 section 5.2.3). Results,
inputs and scenarios need names of their own: a later element gets `_2` behind its name.
"""

import dataclasses
from dataclasses import dataclass, field

from ..reading.problems import Problems
from .structure import Connection, SystemElement, join


@dataclass(frozen=True)
class DuplicatePaths:
    """How elements are called where some have been given another name; empty where none has."""

    around: dict[str, frozenset[str]] = field(default_factory=dict)
    """By path: the paths of the systems around an element, and its own."""
    names: dict[str, tuple[str, ...]] = field(default_factory=dict)
    """By path: the names that an element has as seen from these, their paths in front."""


def tell_apart(top: SystemElement, problems: Problems) -> DuplicatePaths:
    """Give the elements in `top` paths of their own, with a warning for each that needs another name for it."""
    seen: set[str] = set()
    before: dict[str, str] = {}
    systems = [("", top)]
    for path, system in systems:
        for element in system.elements:
            name, own = element.name, join(path, element.name)
            if own in seen and "." in own:
                number = 2
                while join(path, f"{name}_{number}") in seen | {join(path, e.name) for e in system.elements}:
                    number += 1
                element.name = f"{name}_{number}"
                system.connections[:] = [_renamed(c, name, element.name) for c in system.connections]
                text = f"{own} is the name of two elements, this one has {join(path, element.name)} in results"
                problems.warn(text, element.place)
                own = join(path, element.name)
                before[own] = name
            seen.add(own)
            if isinstance(element, SystemElement):
                systems.append((own, element))
    return _names(top, before) if before else DuplicatePaths()


def _renamed(connection: Connection, old: str, new: str) -> Connection:
    start, end = ((new if element == old else element, name) for element, name in (connection.start, connection.end))
    return dataclasses.replace(connection, start=start, end=end)


def _names(top: SystemElement, before: dict[str, str]) -> DuplicatePaths:
    found = DuplicatePaths({"": frozenset({""})}, {"": ("",)})
    systems = [("", top, [("", "")])]
    for path, system, seen_from in systems:
        for element in system.elements:
            own = join(path, element.name)
            name = before.get(own, element.name)
            ways = [(base, join(way, name)) for base, way in seen_from]
            found.around[own] = frozenset({own, *(base for base, _ in ways)})
            found.names[own] = tuple(dict.fromkeys([*(join(base, way) for base, way in ways), own]))
            if isinstance(element, SystemElement):
                systems.append((own, element, [*ways, (own, "")]))
    return found
