"""Parameter sets (`.ssv`) of SSP 1.0 and 2.0."""

import pathlib
from dataclasses import dataclass

from .document import METADATA_ATTRIBUTES, Element, Reader, name_of, read_file, valid
from .problems import Place, Problems
from .units import Unit, read_units

TYPES = {
    "Real": "Real", "Float64": "Real", "Float32": "Real", "Integer": "Integer", "Int32": "Integer",
    "Boolean": "Boolean", "String": "String", "Enumeration": "Enumeration",
}  # fmt: skip


@dataclass(frozen=True)
class Parameter:
    """One value of a parameter set, as written."""

    name: str
    type: str
    """`Real`, `Integer`, `Boolean`, `String` or `Enumeration`."""
    text: str
    unit: str | None
    place: Place


@dataclass(frozen=True)
class ParameterSet:
    """The values of one parameter set and the units it defines."""

    file: str
    parameters: tuple[Parameter, ...]
    units: dict[str, Unit]


def read_parameter_file(
    path: pathlib.Path, file: str, problems: Problems, place: Place | None = None
) -> ParameterSet | None:
    """Read the parameter set at `path`, called `file` in messages; `place` is where it is referred to."""
    root = read_file(path, file, problems, place)
    return None if root is None else read_parameter_set(root, file, problems)


def read_parameter_set(root: Element, file: str, problems: Problems) -> ParameterSet | None:
    """Read a `ParameterSet` element that stands alone or inside an SSD; None when it is invalid."""
    reader = Reader(file, problems)
    if name_of(root) != "ParameterSet":
        problems.add(f"expected a ParameterSet, found {name_of(root)}", reader.place(root))
        return None
    if not valid(root, "SystemStructureParameterValues.xsd", file, problems):
        return None
    reader.attributes(root, {"version", "name", *METADATA_ATTRIBUTES})
    parameters: dict[str, Parameter] = {}
    for container in reader.children(root, {"Parameters"}, {"Enumerations", "Units", "Annotations"}):
        for element in reader.children(container, {"Parameter"}):
            parameter = _read_parameter(reader, element)
            if parameter is None:
                continue
            if parameter.name in parameters:
                problems.add(f"parameter {parameter.name} is given twice", parameter.place)
            parameters[parameter.name] = parameter
    return ParameterSet(file, tuple(parameters.values()), read_units(reader, root))


def _read_parameter(reader: Reader, element: Element) -> Parameter | None:
    reader.attributes(element, {"name"})
    name = reader.required(element, "name")
    for value in reader.children(element, set(TYPES), {"Annotations"}):
        reader.attributes(value, {"value", "unit", "name"})
        text = value.get("value")
        if text is None:
            reader.problems.add(f"parameter {name} has no value", reader.place(value))
            return None
        return Parameter(name, TYPES[name_of(value)], text, value.get("unit"), reader.place(value))
    reader.problems.add(f"parameter {name} has no value", reader.place(element))
    return None
