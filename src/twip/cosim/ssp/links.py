"""Where a connected value comes from, and what becomes of it on the way.

A value that travels along a chain of connections is converted at each hop: first to the unit of the next connector
(unless that is suppressed), then by the connection's transformation, which SSP 1.0 section 4.5.2 defines on the value
already in target units.
"""

import math
from collections.abc import Mapping as AnyMapping
from collections.abc import Set
from dataclasses import dataclass

from ..reading.problems import Place, Problems
from ..values.conversion import Conversion
from ..values.names import Key, full_name
from ..values.transformation import Items, Mapping, tabulate
from ..values.types import EXACT, TYPES, family, holds, misfit
from ..values.units import IDENTITY, Unit, UnitMismatchError, conversion
from ..values.variable import Variable
from .kinds import GIVING
from .structure import Connection


@dataclass(frozen=True)
class Port:
    """A connector with all that is known of it."""

    key: Key
    kind: str
    type: str | None
    unit: Unit | None
    """Unit of the values that pass the connector."""
    variable: Variable | None
    """The variable of the FMU; None for a connector of a system or of a signal dictionary."""
    place: Place
    items: Items = ()
    """Names and values of an enumeration."""
    shared: bool = False
    """Whether it belongs to a signal dictionary or a reference to one."""

    def label(self, unit: Unit | None = None) -> str:
        """Return `component.variable [unit]`."""
        unit = unit or self.unit
        return full_name(self.key) + (f" [{unit.name}]" if unit else "")


@dataclass(frozen=True)
class Edge:
    """One connection in the direction of the data."""

    source: Port
    target: Port
    connection: Connection

    @property
    def label(self) -> str:
        """Both ends."""
        return f"{self.source.label()} → {self.target.label()}"


@dataclass(frozen=True)
class Link:
    """Where a port's value comes from: a component output or an open system connector, through `edges`."""

    source: Port
    edges: tuple[Edge, ...]
    conversion: Conversion

    @property
    def label(self) -> str:
        """Both ends."""
        return f"{full_name(self.source.key)} → {full_name(self.edges[-1].target.key)}"


def differences(edges: AnyMapping[Key, Edge]) -> dict[Key, dict[bool, Edge]]:
    """Return, for each open connector, an edge to a variable that is a difference (True) and one to another (False)."""
    found: dict[Key, dict[bool, Edge]] = {}
    for edge in edges.values():
        variable, source, steps = edge.target.variable, edge.source, 0
        while source.key in edges and steps < len(edges):  # a circle is told by `trace`
            source, steps = edges[source.key].source, steps + 1
        if variable is not None and source.variable is None:
            found.setdefault(source.key, {}).setdefault(variable.relative, edge)
    return found


def trace(
    key: Key, edges: AnyMapping[Key, Edge], severed: Set[Key], differing: Set[Key], problems: Problems
) -> Link | None:
    """Follow the connections from a target back to where its value begins; None where that is not to be known.

    What begins at a key in `differing` is a difference (`relativeQuantity`).
    """
    chain: list[Edge] = []
    passed: set[Key] = set()
    while key in edges:
        if key in passed:
            problems.add(
                f"{chain[-1].target.label()} is connected in a circle without a component", chain[-1].connection.place
            )
            return None
        passed.add(key)
        chain.append(edges[key])
        key = chain[-1].source.key
    chain.reverse()
    source = chain[0].source
    if source.variable is None and source.key in severed:
        return None
    if source.variable is None and (source.shared or source.kind not in GIVING):
        problems.add(
            f"{source.label()} → {chain[0].target.label()}: nothing feeds {full_name(source.key)}",
            chain[0].connection.place,
        )
        return None
    if not _types_fit(chain, problems):
        return None
    converted = convert_along(tuple(chain), problems, relative=source.key in differing)
    return None if converted is None else Link(source, tuple(chain), converted)


def _steps(chain: tuple[Edge, ...] | list[Edge]) -> list[tuple[Edge, tuple[str, Items], tuple[str, Items]]]:
    """Return each edge with the type before and after it; a connector without type has that of the next one that has
    one, the last ones that of the one before.
    """
    ports = [chain[0].source, *(edge.target for edge in chain)]
    types: list[tuple[str, Items] | None] = [None if p.type is None else (p.type, p.items) for p in ports]
    for i in reversed(range(len(types) - 1)):
        types[i] = types[i] or types[i + 1]
    last = types[0] or ("Real", ())
    known = [last := type_ or last for type_ in types]
    return list(zip(chain, known, known[1:], strict=False))


def _types_fit(chain: list[Edge], problems: Problems) -> bool:
    """Check the types along a chain; what does not fit is a problem."""
    for edge, (before, before_items), (after, after_items) in _steps(chain):
        transformation = edge.connection.transformation
        said = ""
        for type_ in (before, after):
            if family(type_) not in TYPES:
                said = f"connections of type {type_} are not supported"
        if not said and transformation is not None:
            said = transformation.misfit(before, after)
        if not said and {family(before), family(after)} == {"Enumeration"} and transformation is None:
            if dict(before_items) != dict(after_items) and before_items and after_items:
                said = "enumerations differ, and there is no mapping"
        elif not said and not holds(after, before) and {family(before), family(after)} != {"Integer", "Enumeration"}:
            said = f"types differ ({before}, {after})"
        if said:
            problems.add(f"{edge.label}: {said}", edge.connection.place)
            return False
    return True


def convert_along(
    edges: tuple[Edge, ...], problems: Problems, unit: Unit | None = None, relative: bool = False
) -> Conversion | None:
    """Return what becomes of a value on its way along `edges`; `unit` is its unit where the first connector does not
    say, `relative` tells whether it is a difference where neither end is a variable, which says so.
    """
    if family(_steps(edges)[0][1][0]) != "Real":
        return Conversion(IDENTITY, _map_along(edges, problems))
    first, last = edges[0].source, edges[-1].target
    unit = first.unit or unit
    ends = [port.variable for port in (first, last) if port.variable is not None]
    relative = any(variable.relative for variable in ends) if ends else relative
    doubtful = not all(variable.relative == relative for variable in ends)
    # the units of a component's connector and variable fit: wiring has refused the others
    result = IDENTITY if first.variable is None else conversion(first.variable.unit, unit, first.variable.relative)
    for edge in edges:
        if edge.connection.suppress_unit_conversion:
            unit = edge.target.unit
        else:
            label = f"{edge.source.label(unit)} → {edge.target.label()}"
            try:
                step = conversion(unit, edge.target.unit, relative)
            except UnitMismatchError as mismatch:
                problems.add(f"{label}: {mismatch}", edge.connection.place)
                return None
            if doubtful and step != conversion(unit, edge.target.unit):
                problems.add(
                    f"{label}: {_one_difference(first, last)}, and the units have offsets", edge.connection.place
                )
                return None
            result = result.then(step)
            unit = edge.target.unit or unit
        if edge.connection.transformation is not None:
            result = result.then(edge.connection.transformation.affine)
    if doubtful:
        problems.warn(
            f"{edges[0].source.label()} → {last.label()}: {_one_difference(first, last)}", edge.connection.place
        )
    if last.variable is not None:
        result = result.then(conversion(last.unit, last.variable.unit, last.variable.relative))
    linear = [edge.connection.transformation.affine for edge in edges if edge.connection.transformation is not None]
    vanishes = not result.factor and all(affine.factor for affine in linear)
    if vanishes or not math.isfinite(result.factor) or not math.isfinite(result.offset):
        label = f"{first.label()} → {last.label()}"
        problems.add(f"{label}: the conversion is beyond the range of float64", edge.connection.place)
        return None
    return Conversion(result)


def _one_difference(first: Port, last: Port) -> str:
    """Say which end of a connection is a difference: FMI wants that of both or none (FMI 2.0.4 section 2.2.2)."""
    names = [full_name(port.key) for port in (first, last)]
    if first.variable is None or not first.variable.relative:
        names.reverse()
    return f"{names[0]} is a difference (relativeQuantity), {names[1]} is not"


def _map_along(edges: tuple[Edge, ...], problems: Problems) -> Mapping | None:
    result: Mapping | None = None
    for edge, before, after in _steps(edges):
        transformation = edge.connection.transformation
        mapping = tabulate(transformation, before, after, problems)
        if mapping is not None:
            for source, moved in mapping.table.items():
                if transformation is not None and abs(source) <= EXACT < abs(moved):
                    problems.add(f"{edge.label}: {moved} cannot travel, {misfit('Int64', moved)}", transformation.place)
            result = mapping if result is None else result.then(mapping)
    return result
