"""Connections of nested systems, flattened to links that end at a component or at an open system connector.

A value that travels along a chain of connections is converted at each hop: first to the unit of the next connector
(unless that is suppressed), then by the connection's linear transformation, which SSP 1.0 section 4.5.3 defines on the
value already in target units.
"""

from dataclasses import dataclass, field

from .fmu import RECORDED_TYPES, Fmu, Variable
from .problems import Place, Problems
from .ssd import ComponentElement, Connection, Connector, SystemElement
from .units import IDENTITY, Affine, Unit, UnitMismatchError, conversion, lookup

Key = tuple[str, str]
"""Dotted path of a component or system (empty for the outermost system), and the name of a connector or variable."""


@dataclass(frozen=True)
class Port:
    """A connector with all that is known of it."""

    key: Key
    kind: str
    type: str | None
    unit: Unit | None
    """Unit of the values that pass the connector."""
    variable: Variable | None
    """The variable of the FMU; None for a connector of a system."""
    place: Place

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


@dataclass(frozen=True)
class Link:
    """Where a port's value comes from: a component output or an open system connector, through `edges`."""

    source: Port
    edges: tuple[Edge, ...]
    conversion: Affine


@dataclass
class Wiring:
    """A checked system's ports and links."""

    ports: dict[Key, Port] = field(default_factory=dict)
    links: dict[Key, Link] = field(default_factory=dict)
    """By target: component inputs and parameters, and system connectors fed from elsewhere."""

    def fed_by(self, key: Key) -> list[tuple[Key, Link]]:
        """Return the links that begin at `key`, by name of their target."""
        return sorted((item for item in self.links.items() if item[1].source.key == key), key=lambda item: item[0])


def full_name(key: Key) -> str:
    """Return `component.variable`, or the bare name of a connector of the outermost system."""
    return f"{key[0]}.{key[1]}" if key[0] else key[1]


def wire(
    system: SystemElement,
    fmus: dict[str, Fmu | None],
    units: dict[str, Unit],
    components: dict[str, ComponentElement],
    problems: Problems,
) -> Wiring:
    """Flatten the connections of `system` and everything in it; `fmus` by dotted component path, None where the FMU is
    unusable.
    """
    wiring = Wiring()
    for path, component in components.items():
        fmu = fmus[path]
        if fmu is not None:
            for connector in component.connectors:
                port = _component_port(path, connector, fmu, units, problems)
                if port is not None:
                    wiring.ports[port.key] = port
    unusable = {path for path, fmu in fmus.items() if fmu is None}
    edges: dict[Key, Edge] = {}
    _collect(system, "", wiring, units, unusable, edges, problems)
    for key in edges:
        link = _trace(key, edges, problems)
        if link is not None:
            wiring.links[key] = link
    return wiring


def systems_of(system: SystemElement, path: str = "") -> dict[str, SystemElement]:
    """Return the system and all systems in it by dotted path, the outermost one first."""
    found = {path: system}
    for element in system.elements:
        if isinstance(element, SystemElement):
            found |= systems_of(element, _join(path, element.name))
    return found


def components_of(system: SystemElement) -> dict[str, ComponentElement]:
    """Return all components by dotted path, in the order of the file."""
    found: dict[str, ComponentElement] = {}

    def walk(part: SystemElement, path: str) -> None:
        for element in part.elements:
            if isinstance(element, SystemElement):
                walk(element, _join(path, element.name))
            else:
                found[_join(path, element.name)] = element

    walk(system, "")
    return found


def report_shared_names(system: SystemElement, problems: Problems) -> None:
    """Report elements on different levels whose dotted names are the same, such as `a.b` beside `b` in `a`."""
    seen: set[str] = set()
    levels = [("", system)]
    for path, level in levels:
        for element in level.elements:
            name = _join(path, element.name)
            if name in seen and "." in name:
                problems.add(f"{name} is the name of two elements", element.place)
            seen.add(name)
            if isinstance(element, SystemElement):
                levels.append((name, element))


def _join(path: str, name: str) -> str:
    return f"{path}.{name}" if path else name


def _component_port(
    path: str, connector: Connector, fmu: Fmu, units: dict[str, Unit], problems: Problems
) -> Port | None:
    variable = fmu.variables.get(connector.name)
    label = f"{path}.{connector.name}"
    if variable is None:
        problems.add(f"connector {label}: {fmu.name} has no such variable", connector.place)
        return None
    if variable.causality != connector.kind:
        problems.add(f"connector {label}: is {connector.kind}, but {variable.causality} in {fmu.name}", connector.place)
        return None
    if connector.type not in (None, variable.type):
        problems.add(f"connector {label}: is {connector.type}, but {variable.type} in {fmu.name}", connector.place)
        return None
    unit = lookup(connector.unit, units, fmu.units) if connector.unit else variable.unit
    return Port((path, connector.name), connector.kind, variable.type, unit, variable, connector.place)


def _collect(
    system: SystemElement,
    path: str,
    wiring: Wiring,
    units: dict[str, Unit],
    unusable: set[str],
    edges: dict[Key, Edge],
    problems: Problems,
) -> None:
    for connector in system.connectors:
        unit = lookup(connector.unit, units)
        wiring.ports[path, connector.name] = Port(
            (path, connector.name), connector.kind, connector.type, unit, None, connector.place
        )
    inner = {element.name: _join(path, element.name) for element in system.elements}
    for element in system.elements:
        if isinstance(element, SystemElement):
            _collect(element, inner[element.name], wiring, units, unusable, edges, problems)
    for connection in system.connections:
        ends = []
        for element_name, name in (connection.start, connection.end):
            where = inner.get(element_name) if element_name else path
            port = None if where is None else wiring.ports.get((where, name))
            if where is None:
                problems.add(f"{_describe(connection)}: there is no element {element_name}", connection.place)
            elif port is None and where not in unusable and not _reported(where, name, problems):
                problems.add(
                    f"{_describe(connection)}: {element_name or 'the system'} has no connector {name}", connection.place
                )
            ends.append(port)
        if ends[0] is None or ends[1] is None:
            continue
        edge = _direct(ends[0], ends[1], path, connection, problems)
        if edge is None:
            continue
        if edge.target.key in edges:
            other = edges[edge.target.key]
            first = f"{other.source.label()} (line {other.connection.place.line})"
            problems.add(
                f"{edge.target.label()} is connected twice: to {first} and {edge.source.label()}", connection.place
            )
            continue
        edges[edge.target.key] = edge


def _reported(path: str, name: str, problems: Problems) -> bool:
    return any(line.startswith(f"connector {path}.{name}: ") for line in problems.lines)


def _describe(connection: Connection) -> str:
    return f"{full_name(connection.start)} → {full_name(connection.end)}"


def _direct(a: Port, b: Port, path: str, connection: Connection, problems: Problems) -> Edge | None:
    """Find which end gives the value: outputs of elements, and inputs and parameters of the enclosing system."""
    gives = [(port.kind == "output") != (port.key[0] == path and port.variable is None) for port in (a, b)]
    text = f"{a.label()} → {b.label()}"
    if gives[0] == gives[1]:
        problems.add(
            f"{text}: both ends {'give' if gives[0] else 'take'} a value ({a.kind} to {b.kind})", connection.place
        )
        return None
    source, target = (a, b) if gives[0] else (b, a)
    if (source.kind == "parameter") != (target.kind == "parameter"):
        problems.add(f"{text}: {source.kind} cannot feed {target.kind}", connection.place)
        return None
    for port in (source, target):
        if port.type is not None and port.type not in RECORDED_TYPES:
            problems.add(f"{text}: connections of type {port.type} are not supported", connection.place)
            return None
    return Edge(source, target, connection)


def _trace(key: Key, edges: dict[Key, Edge], problems: Problems) -> Link | None:
    """Follow the connections from a target back to where its value begins."""
    chain: list[Edge] = []
    while key in edges:
        if any(edge.target.key == key for edge in chain):
            problems.add(
                f"{chain[0].target.label()} is connected in a circle without a component", chain[0].connection.place
            )
            return None
        chain.insert(0, edges[key])
        key = chain[0].source.key
    source = chain[0].source
    if source.variable is None and source.kind == "output":
        problems.add(
            f"{source.label()} → {chain[0].target.label()}: nothing feeds {full_name(source.key)}",
            chain[0].connection.place,
        )
        return None
    type_ = source.type
    for edge in chain:
        text = f"{edge.source.label()} → {edge.target.label()}"
        if edge.target.type is not None and type_ is not None and edge.target.type != type_:
            problems.add(f"{text}: types differ ({type_}, {edge.target.type})", edge.connection.place)
            return None
        type_ = type_ or edge.target.type
        if edge.connection.transformed and type_ not in (None, "Real"):
            problems.add(f"{text}: a linear transformation needs Real values, not {type_}", edge.connection.place)
            return None
    converted = convert_along(tuple(chain), problems)
    return None if converted is None else Link(source, tuple(chain), converted)


def convert_along(edges: tuple[Edge, ...], problems: Problems, unit: Unit | None = None) -> Affine | None:
    """Return what becomes of a value on its way along `edges`; `unit` is its unit where the first connector does not
    say.
    """
    first = edges[0].source
    unit = first.unit or unit
    step = first.label(unit)
    result = IDENTITY
    try:
        if first.variable is not None:
            result = conversion(first.variable.unit, unit)
        for edge in edges:
            target = edge.target
            if edge.connection.suppress_unit_conversion:
                unit = target.unit
            else:
                step = f"{edge.source.label(unit)} → {target.label()}"
                result = result.then(conversion(unit, target.unit))
                unit = target.unit or unit
            result = result.then(edge.connection.transformation)
        last = edges[-1].target
        if last.variable is not None:
            step = f"{last.label()} → the variable's unit {last.variable.unit.name if last.variable.unit else ''}"
            result = result.then(conversion(unit, last.variable.unit) if unit is last.unit else IDENTITY)
    except UnitMismatchError as mismatch:
        problems.add(f"{step}: {mismatch}", edge.connection.place)
        return None
    return result
