"""System structure descriptions (`.ssd`) of SSP 1.0 and 2.0: the file as plain data, nothing resolved yet."""

from dataclasses import dataclass, field

from .document import METADATA_ATTRIBUTES, Element, Reader, name_of, valid
from .problems import Place, Problems
from .units import IDENTITY, Affine, Unit, read_units

ANNOTATION = "org.twip.cosim"
"""Type of the annotation by which a file proposes a coupling and a step size."""
COUPLINGS = ("jacobi", "gauss-seidel")
_TYPES = {
    "Real": "Real", "Float64": "Real", "Integer": "Integer", "Int32": "Integer", "Boolean": "Boolean",
    "String": "String", "Enumeration": "Enumeration",
}  # fmt: skip
_KINDS = ("input", "output", "parameter")


@dataclass(frozen=True)
class Connector:
    """A port of a component or system."""

    name: str
    kind: str
    """`input`, `output` or `parameter`."""
    type: str | None
    unit: str | None
    place: Place


@dataclass(frozen=True)
class Connection:
    """A line between two connectors of a system; an empty element name stands for the system itself."""

    start: tuple[str, str]
    end: tuple[str, str]
    transformation: Affine
    transformed: bool
    suppress_unit_conversion: bool
    place: Place


@dataclass(frozen=True)
class Binding:
    """A source of parameter values: a file or an inline parameter set."""

    prefix: str
    source: str | None
    inline: Element | None
    place: Place


@dataclass
class ComponentElement:
    """A component as the file states it."""

    name: str
    place: Place
    source: str
    connectors: list[Connector]
    bindings: list[Binding]


@dataclass
class SystemElement:
    """A system as the file states it."""

    name: str
    place: Place
    connectors: list[Connector]
    bindings: list[Binding]
    elements: "list[ComponentElement | SystemElement]" = field(default_factory=list)
    connections: list[Connection] = field(default_factory=list)


@dataclass(frozen=True)
class Experiment:
    """What a file proposes for a run; None where it says nothing."""

    start_time: float | None = None
    stop_time: float | None = None
    step_size: float | None = None
    coupling: str | None = None
    mid_step: tuple[tuple[str, Place], ...] = ()
    """Inputs (`component.variable`) that are to be taken at the middle of a step."""


@dataclass(frozen=True)
class Description:
    """A whole system structure description."""

    name: str
    system: SystemElement
    units: dict[str, Unit]
    experiment: Experiment


def read_description(root: Element, file: str, problems: Problems) -> Description | None:
    """Turn the XML of an SSD into data; None when it cannot be one. What it says and nobody here reads is a problem."""
    reader = Reader(file, problems)
    if name_of(root) != "SystemStructureDescription":
        problems.add(f"expected a SystemStructureDescription, found {name_of(root)}", reader.place(root))
        return None
    if not valid(root, "SystemStructureDescription.xsd", file, problems):
        return None
    reader.attributes(root, {"version", "name", *METADATA_ATTRIBUTES})
    for _ in reader.children(root, {"System"}, {"Enumerations", "Units", "DefaultExperiment", "Annotations"}):
        pass
    top = reader.child(root, "System")
    if top is None:
        problems.add("the description has no System", reader.place(root))
        return None
    system = _read_system(reader, top)
    return Description(
        root.get("name", system.name), system, read_units(reader, root), _read_experiment(reader, root, top)
    )


def _read_system(reader: Reader, element: Element) -> SystemElement:
    reader.attributes(element, {"name"})
    system = SystemElement(
        reader.required(element, "name"),
        reader.place(element),
        _read_connectors(reader, element),
        _read_bindings(reader, element),
    )
    ignored = {
        "Connectors",
        "ParameterBindings",
        "ElementGeometry",
        "SystemGeometry",
        "GraphicalElements",
        "Annotations",
    }
    for child in reader.children(element, {"Elements", "Connections"}, ignored):
        if name_of(child) == "Connections":
            system.connections += [_read_connection(reader, c) for c in reader.children(child, {"Connection"})]
            continue
        for part in reader.children(child, {"Component", "System"}):
            system.elements.append(
                _read_system(reader, part) if name_of(part) == "System" else _read_component(reader, part)
            )
    _report_duplicates(reader, system)
    return system


def _report_duplicates(reader: Reader, system: SystemElement) -> None:
    names: set[str] = set()
    for part in system.elements:
        if part.name in names:
            reader.problems.add(f"element {part.name} is there twice in system {system.name}", part.place)
        names.add(part.name)
    owners: list[ComponentElement | SystemElement] = [system]
    owners += [element for element in system.elements if isinstance(element, ComponentElement)]
    for owner in owners:
        ports: set[str] = set()
        for connector in owner.connectors:
            if connector.name in ports:
                reader.problems.add(f"connector {connector.name} of {owner.name} is there twice", connector.place)
            ports.add(connector.name)


def _read_component(reader: Reader, element: Element) -> ComponentElement:
    reader.attributes(element, {"name", "type", "source", "implementation"})
    for _ in reader.children(element, set(), {"Connectors", "ElementGeometry", "ParameterBindings", "Annotations"}):
        pass
    name = reader.required(element, "name")
    kind = element.get("type", "application/x-fmu-sharedlibrary")
    if kind != "application/x-fmu-sharedlibrary":
        reader.problems.add(f"component {name}: type {kind} is not supported", reader.place(element))
    if element.get("implementation", "any") not in ("any", "CoSimulation"):
        reader.problems.add(
            f"component {name}: only co-simulation is supported, not {element.get('implementation')}",
            reader.place(element),
        )
    return ComponentElement(
        name,
        reader.place(element),
        reader.required(element, "source"),
        _read_connectors(reader, element),
        _read_bindings(reader, element),
    )


def _read_connectors(reader: Reader, element: Element) -> list[Connector]:
    container = reader.child(element, "Connectors")
    connectors: list[Connector] = []
    for item in () if container is None else reader.children(container, {"Connector"}):
        reader.attributes(item, {"name", "kind"})
        name, kind = reader.required(item, "name"), reader.required(item, "kind")
        if kind and kind not in _KINDS:
            reader.problems.add(
                f"connector {element.get('name')}.{name}: kind {kind} is not supported", reader.place(item)
            )
            continue
        type_, unit = None, None
        for value in reader.children(item, {*_TYPES}, {"ConnectorGeometry", "Annotations"}):
            reader.attributes(value, {"unit", "name"})
            type_, unit = _TYPES[name_of(value)], value.get("unit")
        connectors.append(Connector(name, kind, type_, unit, reader.place(item)))
    return connectors


def _read_connection(reader: Reader, element: Element) -> Connection:
    reader.attributes(
        element, {"startElement", "startConnector", "endElement", "endConnector", "suppressUnitConversion"}
    )
    transformation, transformed = IDENTITY, False
    for item in reader.children(element, {"LinearTransformation"}, {"ConnectionGeometry", "Annotations"}):
        reader.attributes(item, {"factor", "offset"})
        factor, offset = reader.number(item, "factor", 1.0), reader.number(item, "offset", 0.0)
        transformation, transformed = Affine(1.0 if factor is None else factor, offset or -0.0), True
    return Connection(
        (element.get("startElement", ""), reader.required(element, "startConnector")),
        (element.get("endElement", ""), reader.required(element, "endConnector")),
        transformation,
        transformed,
        reader.boolean(element, "suppressUnitConversion"),
        reader.place(element),
    )


def _read_bindings(reader: Reader, element: Element) -> list[Binding]:
    container = reader.child(element, "ParameterBindings")
    bindings: list[Binding] = []
    for item in () if container is None else reader.children(container, {"ParameterBinding"}):
        reader.attributes(item, {"type", "source", "sourceBase", "prefix"})
        kind = item.get("type", "application/x-ssp-parameter-set")
        if kind != "application/x-ssp-parameter-set":
            reader.problems.add(f"parameter binding of type {kind} is not supported", reader.place(item))
        if item.get("sourceBase", "SSD") != "SSD":
            reader.problems.add("a parameter binding with sourceBase component is not supported", reader.place(item))
        values = [
            v
            for c in reader.children(item, {"ParameterValues"}, {"Annotations"})
            for v in reader.children(c, {"ParameterSet"})
        ]
        source = item.get("source")
        if (source is None) == (not values):
            reader.problems.add(
                "a parameter binding needs either a source or one inline ParameterSet", reader.place(item)
            )
            continue
        prefix, place = item.get("prefix", ""), reader.place(item)
        bindings += [Binding(prefix, None, value, place) for value in values] or [Binding(prefix, source, None, place)]
    return bindings


def _read_experiment(reader: Reader, root: Element, top: Element) -> Experiment:
    experiment = reader.child(root, "DefaultExperiment")
    start = stop = step = coupling = None
    mid_step: list[tuple[str, Place]] = []
    hosts = [root, top]
    if experiment is not None:
        hosts.insert(0, experiment)
        reader.attributes(experiment, {"startTime", "stopTime"})
        start, stop = reader.number(experiment, "startTime"), reader.number(experiment, "stopTime")
    known = [reader.child(host, "Annotations") for host in hosts]
    for annotation in root.iter("{*}Annotation"):
        if annotation.get("type") != ANNOTATION:
            continue
        if annotation.getparent() not in known:
            reader.problems.add(f"annotation {ANNOTATION} has no meaning here", reader.place(annotation))
        for item in annotation.iterchildren("{*}*"):
            if item.tag.rpartition("}")[2] != "Algorithm":
                reader.problems.add(f"{item.tag} in annotation {ANNOTATION} is not supported", reader.place(item))
                continue
            reader.attributes(item, {"coupling", "stepSize"})
            step = reader.number(item, "stepSize", step)
            coupling = item.get("coupling", coupling)
            if coupling is not None and coupling not in COUPLINGS:
                reader.problems.add(f"coupling {coupling!r} must be one of {', '.join(COUPLINGS)}", reader.place(item))
            for child in item.iterchildren("{*}*"):
                if child.tag.rpartition("}")[2] != "MidStep":
                    reader.problems.add(f"{child.tag} in Algorithm is not supported", reader.place(child))
                    continue
                reader.attributes(child, {"input"})
                mid_step.append((reader.required(child, "input"), reader.place(child)))
    return Experiment(start, stop, step, coupling, tuple(mid_step))
