"""An FMU that goes into a container: what the container must know of it."""

import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import fmpy
from fmpy.model_description import ModelDescription, ModelVariable, Unit
from lxml import etree

from ..errors import TwipError
from ..platform import PLATFORMS
from .units import BASE_UNITS

KINDS = {
    "Real": ("Float64", "Real"),
    "Integer": ("Int32", "Integer"),
    "Boolean": ("Boolean", "Boolean"),
    "Float64": ("Float64", "Real"),
    "Int32": ("Int32", "Integer"),
}
"""What a container can carry: types of FMI 2.0 and 3.0, as the container's library and as a declaration call them."""

Name = tuple[str, str]
"""Component and variable."""


@dataclass(frozen=True)
class Nested:
    """One component of a container."""

    name: str
    fmu: Path
    """The archive, or the folder of an unpacked FMU."""
    start_values: Mapping[str, float | int | bool | str]
    """Values to start with, in the units of the variables, where they are not those of the FMU."""


@dataclass(frozen=True)
class Connection:
    """An output that feeds an input."""

    source: Name
    destination: Name


@dataclass(frozen=True)
class Connector:
    """A connector of the system, and what is behind it."""

    name: str
    behind: tuple[Name, ...]
    start: float | None = None


@dataclass(frozen=True)
class NestedFmu:
    """An FMU as it lies in the container."""

    path: Path
    folder: str
    description: ModelDescription
    variables: dict[str, ModelVariable]
    platforms: frozenset[str]
    """In FMI 2.0's words."""
    differences: frozenset[str]
    """Variables that are relative quantities: the offsets of their units do not count."""

    @property
    def fmi(self) -> str:
        """Version of FMI."""
        return str(self.description.fmiVersion)

    @property
    def model(self) -> str:
        """Name of the model."""
        return str(self.description.modelName)

    @property
    def token(self) -> str:
        """FMI 2.0's GUID or FMI 3.0's instantiation token."""
        return str(self.description.instantiationToken or self.description.guid)

    @property
    def identifier(self) -> str:
        """Name of the library."""
        return str(self.description.coSimulation.modelIdentifier)

    @property
    def author(self) -> str:
        """Who made it."""
        return str(self.description.author or "")

    @property
    def copyright(self) -> str:
        """Who holds the copyright."""
        return str(self.description.copyright or "")

    @property
    def license(self) -> str:
        """Its licence."""
        return str(self.description.license or "")

    def kind(self, name: str) -> str | None:
        """Return the type of a variable as the container's library calls it, None if it cannot carry it."""
        v = self.variables[name]
        return None if v.dimensions or v.type not in KINDS else KINDS[v.type][0]

    def inherited(self, name: str, attribute: str) -> str | None:
        """Return an attribute of a variable or of its declared type."""
        v = self.variables[name]
        own = getattr(v, attribute, None)
        return own if own is not None or v.declaredType is None else getattr(v.declaredType, attribute, None)

    def depends(self, name: str, initially: bool) -> set[str]:
        """Return the inputs that an output depends on at the same instant; all where the FMU does not say.

        An FMU that says nothing of the initialization is taken at its word for the steps.
        """
        inputs = {v.name for v in self.description.modelVariables if v.causality == "input"}
        for unknown in (*(self.description.initialUnknowns if initially else ()), *self.description.outputs):
            if unknown.variable.name == name and unknown.dependencies is not None:
                return inputs & {v.name for v in unknown.dependencies}
        return inputs

    def units(self) -> list[etree._Element]:
        """Return the definitions of its units."""
        return [_unit_element(unit) for unit in self.description.unitDefinitions]

    def files(self) -> dict[str, bytes]:
        """Return path → content."""
        if self.path.is_dir():
            paths = (p for p in sorted(self.path.rglob("*")) if p.is_file())
            return {p.relative_to(self.path).as_posix(): p.read_bytes() for p in paths}
        with zipfile.ZipFile(self.path) as archive:
            return {n: archive.read(n) for n in archive.namelist() if not n.endswith("/")}


def read_nested(path: Path, folder: str) -> NestedFmu:
    """Read an FMU. Raises TwipError when it cannot go into a container."""
    description = fmpy.read_model_description(str(path), validate=False)
    if description.coSimulation is None:
        raise TwipError(f"{path.name} offers no co-simulation")
    names = {platform.fmi3: platform.fmi2 for platform in PLATFORMS}
    platforms = frozenset(names.get(p, p) for p in fmpy.supported_platforms(str(path)))
    variables = {v.name: v for v in description.modelVariables}
    return NestedFmu(path, folder, description, variables, platforms, _differences(path, description))


def _differences(path: Path, description: ModelDescription) -> frozenset[str]:
    """Return the variables that are differences; fmpy reads the attribute of types only."""
    if path.is_dir():
        root = etree.parse(path / "modelDescription.xml").getroot()
    else:
        with zipfile.ZipFile(path) as archive:
            root = etree.fromstring(archive.read("modelDescription.xml"))
    told = {t.name: "true" for t in description.typeDefinitions if getattr(t, "relativeQuantity", False)}
    found = set()
    for element in root.iterfind("ModelVariables/*"):
        scalar = element.find("Real") if element.tag == "ScalarVariable" else element
        if scalar is not None:
            inherited = told.get(scalar.get("declaredType", ""), "false")
            if scalar.get("relativeQuantity", inherited).strip() in ("true", "1"):
                found.add(element.get("name", ""))
    return frozenset(found)


def _unit_element(unit: Unit) -> etree._Element:
    element = etree.Element("Unit", {"name": unit.name})
    if unit.baseUnit is not None:
        base = {b: str(int(getattr(unit.baseUnit, b))) for b in BASE_UNITS if int(getattr(unit.baseUnit, b))}
        base |= _scale(unit.baseUnit)
        etree.SubElement(element, "BaseUnit", base)
    for display in unit.displayUnits:
        etree.SubElement(element, "DisplayUnit", {"name": display.name, **_scale(display)})
    return element


def _scale(unit: object) -> dict[str, str]:
    """Return factor and offset of a unit where they are not 1 and 0."""
    scale = {"factor": float(getattr(unit, "factor", 1.0)), "offset": float(getattr(unit, "offset", 0.0))}
    return {name: repr(x) for name, x in scale.items() if x != (1.0 if name == "factor" else 0.0)}
