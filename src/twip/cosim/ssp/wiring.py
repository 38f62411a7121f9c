"""Connections of nested systems, flattened to links that end at a component or at an open system connector."""

from dataclasses import dataclass, field
from functools import cached_property

from ..model.fmu import Fmu
from ..reading.problems import Problems
from ..values.names import Key, full_name
from ..values.transformation import Items
from ..values.types import canonical
from ..values.units import UnitMismatchError, conversion, lookup
from .dictionaries import Dictionaries
from .kinds import ALLOWED, refusal
from .links import Edge, Link, Port, differences, trace
from .structure import ComponentElement, Connection, Connector, DictionaryReference, Document, SystemElement, join
from .type_elements import Enumeration


@dataclass
class Wiring:
    """A checked system's ports and links."""

    ports: dict[Key, Port] = field(default_factory=dict)
    links: dict[Key, Link] = field(default_factory=dict)
    """By target: component inputs and parameters, and system connectors fed from elsewhere."""
    severed: set[Key] = field(default_factory=set)
    """Ports of connections whose other end is unusable: what feeds them, or what they feed, is not known."""

    @cached_property
    def _through(self) -> dict[Key, list[tuple[Key, Link]]]:
        found: dict[Key, list[tuple[Key, Link]]] = {}
        for key, link in sorted(self.links.items(), key=lambda item: item[0]):
            for edge in link.edges:
                found.setdefault(edge.source.key, []).append((key, link))
        return found

    def through(self, key: Key) -> list[tuple[Key, Link]]:
        """Return the links whose values pass `key` or begin there, by name of their target."""
        return self._through.get(key, [])

    def type_of(self, port: Port) -> tuple[str | None, Items]:
        """Return the type and the items of an enumeration of a connector of a system, those of what takes its values
        if it has none; no type where nobody has one.
        """
        behind = [edge.target for _, link in self.through(port.key) for edge in link.edges]
        type_ = port.type or next((p.type for p in behind if p.type), None)
        return type_, port.items or next((p.items for p in behind if p.items), ())

    def fed_by(self, key: Key) -> list[tuple[Key, Link]]:
        """Return the links that begin at `key`, by name of their target."""
        return [item for item in self.through(key) if item[1].source.key == key]


def wire(
    system: SystemElement,
    fmus: dict[str, Fmu | None],
    components: dict[str, ComponentElement],
    problems: Problems,
) -> Wiring:
    """Flatten the connections of `system` and everything in it; `fmus` by dotted component path, None where the FMU is
    unusable.
    """
    wirer = _Wirer(fmus, problems)
    for path, component in components.items():
        fmu = fmus[path]
        if fmu is not None:
            for connector in component.connectors:
                wirer.add_component_port(path, connector, fmu, component.document)
    wirer.add_system(system, "", ())
    wirer.join_dictionaries()
    takers = differences(wirer.edges)
    differing = {key for key, found in takers.items() if True in found}
    links = {key: trace(key, wirer.edges, wirer.severed, differing, problems) for key in wirer.edges}
    for key, found in takers.items():
        if len(found) > 1:
            one, other = (full_name(found[relative].target.key) for relative in (True, False))
            place = found[True].connection.place
            text = f"{full_name(key)} feeds {one}, a difference (relativeQuantity), and {other}, which is none"
            problems.warn(text, place)
    return Wiring(wirer.ports, {key: link for key, link in links.items() if link is not None}, wirer.severed)


class _Wirer:
    """Collects ports and edges."""

    def __init__(self, fmus: dict[str, Fmu | None], problems: Problems):
        self.ports: dict[Key, Port] = {}
        self.edges: dict[Key, Edge] = {}
        self.severed: set[Key] = set()
        self.problems = problems
        self._declared: set[Key] = set()
        """Connectors of components and of systems in their place; why one of them has no port has been told."""
        self._unusable = {path for path, fmu in fmus.items() if fmu is None}
        self._dictionaries = Dictionaries(problems)

    def add_component_port(self, path: str, connector: Connector, fmu: Fmu, document: Document) -> None:
        """Add a connector of a component, checked against the FMU's variable."""
        self._declared.add((path, connector.name))
        variable = fmu.variables.get(connector.name)
        label = f"connector {path}.{connector.name}"
        if variable is None:
            self.problems.add(f"{label}: {fmu.name} has no such variable", connector.place)
            return
        variable = fmu.meant(variable)
        if connector.kind not in variable.kinds:
            self.problems.add(f"{label}: is {connector.kind}, but {variable.kinds[-1]} in {fmu.name}", connector.place)
            return
        type_ = connector.type.type
        if type_ is not None and type_ != canonical(variable.type):
            self.problems.add(f"{label}: is {type_}, but {variable.type} in {fmu.name}", connector.place)
            return
        enumeration = _enumeration(connector, document, self.problems)
        if enumeration is not None and dict(enumeration.items) != dict(variable.items):
            self.problems.add(
                f"{label}: enumeration {enumeration.name} has other items than that of the variable", connector.place
            )
            return
        unit = variable.unit
        if connector.type.unit:
            unit = lookup(connector.type.unit, document.units, fmu.units)
            self._warn_of_unit(connector, document)
            try:
                conversion(variable.unit, unit)
            except UnitMismatchError as mismatch:
                have, want = connector.type.unit, variable.unit.name if variable.unit else ""
                self.problems.add(f"{label}: is in {have}, but in {want} in {fmu.name}: {mismatch}", connector.place)
                return
        self.ports[path, connector.name] = Port(
            (path, variable.name), connector.kind, variable.type, unit, variable, connector.place, variable.items
        )

    def add_system(self, system: SystemElement, path: str, above: tuple[tuple[str, SystemElement], ...]) -> None:
        """Add a system's connectors, its elements and its connections; `above` are the systems around it."""
        for connector in system.connectors:
            self._add_connector(path, connector, system.document)
        self._dictionaries.read(system)
        inner = {element.name: join(path, element.name) for element in system.elements}
        for element in system.elements:
            if isinstance(element, SystemElement):
                self._declared |= {(inner[element.name], name) for name in element.expected}
                self.add_system(element, inner[element.name], (*above, (path, system)))
            elif isinstance(element, DictionaryReference):
                found = self._dictionaries.find(element, (*above, (path, system)))
                for connector in element.connectors:
                    port = self._add_connector(inner[element.name], connector, element.document, shared=True)
                    if found is not None:
                        self._dictionaries.add(port, *found)
        for connection in system.connections:
            self._connect(connection, path, inner)

    def _add_connector(self, path: str, connector: Connector, document: Document, shared: bool = False) -> Port:
        enumeration = _enumeration(connector, document, self.problems)
        self._warn_of_unit(connector, document)
        port = Port(
            (path, connector.name), connector.kind, connector.type.type, lookup(connector.type.unit, document.units),
            None, connector.place, () if enumeration is None else enumeration.items, shared,
        )  # fmt: skip
        self.ports[port.key] = port
        return port

    def _warn_of_unit(self, connector: Connector, document: Document) -> None:
        if connector.type.unit and connector.type.unit not in document.units:
            self.problems.warn(f"unit {connector.type.unit} has no definition in the file", connector.place)

    def _connect(self, connection: Connection, path: str, inner: dict[str, str]) -> None:
        ends = []
        for element_name, name in (connection.start, connection.end):
            where = inner.get(element_name) if element_name else path
            port = None if where is None else self.ports.get((where, name))
            if where is None:
                self.problems.add(f"{_describe(connection)}: there is no element {element_name}", connection.place)
            elif port is None and where not in self._unusable and (where, name) not in self._declared:
                self.problems.add(
                    f"{_describe(connection)}: {element_name or 'the system'} has no connector {name}",
                    connection.place,
                )
            ends.append((port, not element_name))
        (a, a_own), (b, b_own) = ends
        if a is None or b is None:
            self.severed |= {port.key for port in (a, b) if port is not None}
            return
        first, second = (a_own, a.kind), (b_own, b.kind)
        if reason := refusal(first, second):
            self.problems.add(f"{a.label()} → {b.label()}: {reason}", connection.place)
            return
        source, target = (a, b) if (first, second) in ALLOWED else (b, a)
        self._add_edge(Edge(source, target, connection))

    def _add_edge(self, edge: Edge) -> None:
        if edge.target.key in self.edges:
            other = self.edges[edge.target.key]
            first = f"{other.source.label()} (line {other.connection.place.line})"
            self.problems.add(
                f"{edge.target.label()} is connected twice: to {first} and {edge.source.label()}",
                edge.connection.place,
            )
            return
        self.edges[edge.target.key] = edge

    def join_dictionaries(self) -> None:
        """Join the connectors of references to one signal of a dictionary."""
        for port in self._dictionaries.signals():
            self.ports[port.key] = port
        for edge in self._dictionaries.edges(self.edges):
            self._add_edge(edge)


def _enumeration(connector: Connector, document: Document, problems: Problems) -> Enumeration | None:
    name = connector.type.enumeration
    if name is None:
        return None
    if name not in document.enumerations:
        problems.add(f"connector {connector.name}: enumeration {name} has no definition", connector.place)
    return document.enumerations.get(name)


def _describe(connection: Connection) -> str:
    return f"{full_name(connection.start)} → {full_name(connection.end)}"
