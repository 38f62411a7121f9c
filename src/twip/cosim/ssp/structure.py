"""The elements of a system structure description as plain data, nothing resolved yet."""

from dataclasses import dataclass, field

from ..reading.files import Location
from ..reading.problems import Place
from ..reading.xml import Element
from ..values.transformation import Transformation
from ..values.units import Unit
from .type_elements import Enumeration, TypeChoice

FMU = "application/x-fmu-sharedlibrary"
DEFINITION = "application/x-ssp-definition"
PACKAGE = "application/x-ssp-package"


@dataclass(frozen=True, eq=False)
class Document:
    """The file that an element is from: units and enumerations count within one file (SSP 1.0 section 4.4)."""

    location: Location
    units: dict[str, Unit]
    enumerations: dict[str, Enumeration]
    root: Element


@dataclass(frozen=True)
class Dimension:
    """One dimension of an array: its size, None where the FMU or another connector decides."""

    size: int | None
    size_connector: str | None = None


@dataclass(frozen=True)
class Connector:
    """A port of an element."""

    name: str
    kind: str
    type: TypeChoice
    dimensions: tuple[Dimension, ...]
    """Empty for a scalar."""
    place: Place


@dataclass(frozen=True)
class Connection:
    """A line between two connectors of a system; an empty element name stands for the system itself."""

    start: tuple[str, str]
    end: tuple[str, str]
    transformation: Transformation | None
    suppress_unit_conversion: bool
    place: Place


@dataclass(frozen=True)
class Outside:
    """Content that stands inline or in a file of its own."""

    inline: Element | None
    source: str | None
    in_component: bool
    """Whether `source` is relative to the component rather than to the SSD."""
    place: Place


@dataclass(frozen=True)
class Binding:
    """A source of parameter values, and how its names and values become those of the system."""

    prefix: str
    values: Outside
    mapping: Outside | None
    document: Document


@dataclass
class ComponentElement:
    """A component as the file states it."""

    name: str
    place: Place
    document: Document
    connectors: list[Connector]
    bindings: list[Binding]
    type: str
    source: str | None


@dataclass
class DictionaryReference:
    """A place where a system takes signals from a signal dictionary, or gives them to it."""

    name: str
    place: Place
    document: Document
    connectors: list[Connector]
    dictionary: str


@dataclass(frozen=True)
class DictionaryElement:
    """A signal dictionary as the file states it."""

    name: str
    content: Outside
    document: Document


@dataclass
class SystemElement:
    """A system as the file states it."""

    name: str
    place: Place
    document: Document
    connectors: list[Connector]
    bindings: list[Binding]
    source: str | None = None
    """What a component referred to, where the system stands in its place."""
    expected: frozenset[str] = frozenset()
    """Names of the connectors that this component has."""
    elements: "list[AnyElement]" = field(default_factory=list)
    connections: list[Connection] = field(default_factory=list)
    dictionaries: list[DictionaryElement] = field(default_factory=list)


AnyElement = ComponentElement | DictionaryReference | SystemElement


def join(path: str, name: str) -> str:
    """Return the dotted path of an element in the system at `path`, which is empty for the outermost one."""
    return f"{path}.{name}" if path else name


def systems_of(system: SystemElement, path: str = "") -> dict[str, SystemElement]:
    """Return the system and all systems in it by dotted path, the outermost one first."""
    found = {path: system}
    for element in system.elements:
        if isinstance(element, SystemElement):
            found |= systems_of(element, join(path, element.name))
    return found


def components_of(system: SystemElement) -> dict[str, ComponentElement]:
    """Return all components by dotted path, in the order of the file."""
    found: dict[str, ComponentElement] = {}

    def walk(part: SystemElement, path: str) -> None:
        for element in part.elements:
            if isinstance(element, SystemElement):
                walk(element, join(path, element.name))
            elif isinstance(element, ComponentElement):
                found[join(path, element.name)] = element

    walk(system, "")
    return found


def system_around(top: SystemElement, element: ComponentElement) -> SystemElement:
    """Return the system that has `element` among its elements, `top` or one in it."""
    systems = [top]
    for system in systems:
        if any(part is element for part in system.elements):
            return system
        systems += [part for part in system.elements if isinstance(part, SystemElement)]
    raise LookupError(element.name)
