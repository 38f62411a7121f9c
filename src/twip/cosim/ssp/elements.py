"""Reads the systems, components and signal dictionary references of an SSD, with their connectors and connections."""

from ..reading.problems import Problems
from ..reading.xml import Element, Reader, name_of
from ..values.transformation import TRANSFORMATIONS, read_transformation
from .bindings import read_bindings, read_outside
from .structure import (
    FMU,
    AnyElement,
    ComponentElement,
    Connection,
    Connector,
    DictionaryElement,
    DictionaryReference,
    Dimension,
    Document,
    SystemElement,
)
from .type_elements import TYPE_ELEMENTS, TypeChoice, read_type

KINDS = ("input", "output", "parameter", "calculatedParameter", "structuralParameter", "constant", "local", "inout")
"""Kinds of connectors; `inout` on references to signal dictionaries only."""
GRAPHICAL = frozenset({"ElementGeometry", "SystemGeometry", "GraphicalElements", "ConnectorGeometry"})
"""Elements without meaning for a simulation."""
IMPLEMENTATIONS = ("any", "CoSimulation")
_COMMON = frozenset({"Connectors", "ParameterBindings"})


def read_system(reader: Reader, element: Element, document: Document) -> SystemElement:
    """Read a `System` element with all that is in it."""
    reader.attributes(element, {"name"})
    system = SystemElement(
        reader.required(element, "name"),
        reader.place(element),
        document,
        _read_connectors(reader, element, KINDS[:-1]),
        read_bindings(reader, element, document),
    )
    for child in reader.children(element, {"Elements", "Connections", "SignalDictionaries"}, GRAPHICAL | _COMMON):
        reader.attributes(child, set())
        if name_of(child) == "Connections":
            system.connections += [_read_connection(reader, c) for c in reader.children(child, {"Connection"})]
        elif name_of(child) == "SignalDictionaries":
            found = reader.children(child, {"SignalDictionary"})
            system.dictionaries += [_read_dictionary(reader, d, document) for d in found]
        else:
            for part in reader.children(child, {"Component", "System", "SignalDictionaryReference"}):
                system.elements.append(_read_element(reader, part, document))
    _report_duplicates(reader.problems, system)
    return system


def _read_element(reader: Reader, element: Element, document: Document) -> AnyElement:
    if name_of(element) == "System":
        return read_system(reader, element, document)
    if name_of(element) == "Component":
        return _read_component(reader, element, document)
    reader.attributes(element, {"name", "dictionary"})
    for _ in reader.children(element, set(), GRAPHICAL | {"Connectors"}):
        pass
    return DictionaryReference(
        reader.required(element, "name"),
        reader.place(element),
        document,
        _read_connectors(reader, element, KINDS),
        reader.required(element, "dictionary"),
    )


def _report_duplicates(problems: Problems, system: SystemElement) -> None:
    names: set[str] = set()
    for part in system.elements:
        if part.name in names:
            problems.add(f"element {part.name} is there twice in system {system.name}", part.place)
        names.add(part.name)
    owners: list[AnyElement] = [system, *(e for e in system.elements if not isinstance(e, SystemElement))]
    for owner in owners:
        ports: set[str] = set()
        for connector in owner.connectors:
            if connector.name in ports:
                problems.add(f"connector {connector.name} of {owner.name} is there twice", connector.place)
            ports.add(connector.name)
    dictionaries: set[str] = set()
    for dictionary in system.dictionaries:
        if dictionary.name in dictionaries:
            problems.add(
                f"signal dictionary {dictionary.name} is there twice in system {system.name}", dictionary.content.place
            )
        dictionaries.add(dictionary.name)


def _read_component(reader: Reader, element: Element, document: Document) -> ComponentElement:
    reader.attributes(element, {"name", "type", "source", "implementation"})
    for _ in reader.children(element, set(), GRAPHICAL | _COMMON):
        pass
    name, place = reader.required(element, "name"), reader.place(element)
    if element.get("implementation", "any") not in IMPLEMENTATIONS:
        reader.problems.add(
            f"component {name}: only co-simulation is supported, not {element.get('implementation')}", place
        )
    if element.get("source") is not None:
        reader.required(element, "source")
    return ComponentElement(
        name,
        place,
        document,
        _read_connectors(reader, element, KINDS[:-1]),
        read_bindings(reader, element, document, of_component=True),
        element.get("type", FMU),
        element.get("source"),
    )


def _read_connectors(reader: Reader, element: Element, kinds: tuple[str, ...]) -> list[Connector]:
    connectors: list[Connector] = []
    for item in reader.listed(element, "Connectors", {"Connector"}):
        reader.attributes(item, {"name", "kind"})
        name, kind = reader.required(item, "name"), reader.required(item, "kind")
        owner = f"connector {element.get('name')}.{name}"
        if kind and kind not in kinds:
            reader.problems.add(f"{owner}: kind {kind} is not supported", reader.place(item))
            continue
        type_ = TypeChoice()
        dimensions: list[Dimension] = []
        typed = False
        for value in reader.children(item, TYPE_ELEMENTS | {"Dimension"}, GRAPHICAL):
            if name_of(value) == "Dimension":
                dimensions.append(read_dimension(reader, value))
            elif name_of(value) == "Clock" and typed:
                reader.problems.add(f"{owner}: the association with a Clock is not supported", reader.place(value))
            else:
                if typed:
                    reader.problems.add(f"{owner}: has more than one type", reader.place(value))
                type_, typed = read_type(reader, value, owner), True
        connectors.append(Connector(name, kind, type_, tuple(dimensions), reader.place(item)))
    names = {connector.name for connector in connectors}
    for connector in connectors:
        for dimension in connector.dimensions:
            if dimension.size_connector is not None and dimension.size_connector not in names:
                reader.problems.add(
                    f"connector {element.get('name')}.{connector.name}: there is no connector"
                    f" {dimension.size_connector} for its size",
                    connector.place,
                )
    return connectors


def read_dimension(reader: Reader, element: Element) -> Dimension:
    """Read a `Dimension` element of SSP 2.0."""
    reader.leaf(element, {"size", "sizeConnector"})
    if element.get("size") is None:
        return Dimension(None, element.get("sizeConnector"))
    if element.get("sizeConnector") is not None:
        reader.problems.add("a Dimension has either size or sizeConnector, not both", reader.place(element))
    size = reader.integer(element, "size")
    if size is not None and size < 1:
        reader.problems.add(f"size = {size} of Dimension", reader.place(element), rule="must be at least 1")
        return Dimension(1)
    return Dimension(size)


def _read_connection(reader: Reader, element: Element) -> Connection:
    reader.attributes(
        element,
        {"startElement", "startConnector", "endElement", "endConnector", "suppressUnitConversion"}
        | {"startIndices", "endIndices"},
    )
    for attribute in ("startIndices", "endIndices"):
        if element.get(attribute) is not None:
            reader.problems.add(
                f"{attribute} of Connection is not supported: the standard leaves open where indices begin",
                reader.place(element),
            )
    transformation = None
    for item in reader.children(element, TRANSFORMATIONS, {"ConnectionGeometry"}):
        if transformation is not None:
            reader.problems.add("a connection has more than one transformation", reader.place(item))
        transformation = read_transformation(reader, item)
    return Connection(
        (element.get("startElement", ""), reader.required(element, "startConnector")),
        (element.get("endElement", ""), reader.required(element, "endConnector")),
        transformation,
        reader.boolean(element, "suppressUnitConversion"),
        reader.place(element),
    )


def _read_dictionary(reader: Reader, element: Element, document: Document) -> DictionaryElement:
    reader.attributes(element, {"name", "type", "source"})
    content = read_outside(
        reader, element, element, "signal dictionary", "application/x-ssp-signal-dictionary", "SignalDictionary"
    )
    return DictionaryElement(reader.required(element, "name"), content, document)
