"""Parameter sets (`.ssv`) of SSP 1.0 and 2.0."""

import itertools
import math
import pathlib
from dataclasses import dataclass

from ..reading.files import read_file
from ..reading.problems import Place, Problems
from ..reading.xml import METADATA_ATTRIBUTES, Element, Reader, name_of
from ..values.shapes import Shape, indices, shape_text
from ..values.types import ALL_NAMES, canonical, family, limits
from ..values.units import Unit
from .schemas import opened
from .type_elements import REFUSED, Enumeration, read_enumerations
from .unit_definitions import read_units


@dataclass(frozen=True)
class Parameter:
    """One value of a parameter set, as written."""

    name: str
    type: str
    """Name of a type of SSP, such as `Real` or `Int8`."""
    text: str
    unit: str | None
    place: Place
    index: str = ""
    """Of one element of an array: `[1]` or `[2,1]`, counted from 1, which follows the name."""
    shape: Shape = ()
    """Of the array."""


@dataclass(frozen=True)
class ParameterSet:
    """The values of one parameter set, and the units it defines."""

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
    reader = opened(root, "ParameterSet", file, problems)
    if reader is None:
        return None
    reader.attributes(root, {"version", "name", *METADATA_ATTRIBUTES})
    units, enumerations = read_units(reader, root), read_enumerations(reader, root)
    whole, silent = root.getroottree().getroot(), Reader(file, Problems())  # a set inside a file may use what that has
    known_units = {**read_units(silent, whole), **units}
    known_enumerations = {**read_enumerations(silent, whole), **enumerations}
    parameters: dict[str, list[Parameter]] = {}
    for container in reader.children(root, {"Parameters"}, {"Enumerations", "Units"}):
        reader.attributes(container, set())
        for element in reader.children(container, {"Parameter"}):
            reader.attributes(element, {"name"})
            name = reader.required(element, "name")
            if name in parameters:
                problems.add(f"parameter {name} is given twice", reader.place(element))
            parameters[name] = _read_parameter(reader, element, name, known_units, known_enumerations)
    return ParameterSet(file, tuple(itertools.chain(*parameters.values())), units)


def _read_parameter(
    reader: Reader, element: Element, name: str, units: dict[str, Unit], enumerations: dict[str, Enumeration]
) -> list[Parameter]:
    values: list[Element] = []
    shape: list[int] = []
    for child in reader.children(element, {*ALL_NAMES, *REFUSED, "Dimension"}):
        if name_of(child) != "Dimension":
            values.append(child)
            continue
        reader.leaf(child, {"size"})
        size = reader.integer(child, "size")
        shape.append(1 if size is None else size)
    if len(values) != 1:
        reader.problems.add(f"parameter {name} has {'no value' if not values else 'two values'}", reader.place(element))
        return []
    value, place = values[0], reader.place(values[0])
    kind = name_of(value)
    if kind in REFUSED:
        reader.problems.add(f"parameter {name}: type {kind} is not supported", place)
        return []
    enumeration, unit = value.get("name"), value.get("unit")
    if enumeration is not None and enumeration not in enumerations:
        reader.problems.add(f"parameter {name}: enumeration {enumeration} has no definition", place)
    if unit is not None and unit not in units:
        reader.problems.warn(f"unit {unit} has no definition in the file", place)
    reader.attributes(value, {"value", *{"Real": {"unit"}, "Enumeration": {"name"}}.get(family(kind), set())})
    texts = _texts(reader, value, name, array=bool(shape))
    if texts is None:
        return []
    if min(shape, default=1) < 1 or len(texts) != math.prod(shape):
        size_text = shape_text(tuple(shape)) if shape else "1"
        reader.problems.add(f"parameter {name} has {len(texts)} values where its size is {size_text}", place)
        return []
    type_ = canonical(kind)
    for text in texts:
        _check(reader, name, type_, text, enumerations.get(enumeration or ""), place)
    sizes = tuple(shape)
    return [
        Parameter(name, type_, text, unit, place, index, sizes)
        for text, index in zip(texts, indices(sizes), strict=True)
    ]


def _texts(reader: Reader, value: Element, name: str, array: bool) -> list[str] | None:
    """Return the written values: one, or those of an array in row-major order (SSP 2.0 section 6.2)."""
    items = list(reader.children(value, {"Value"}))
    for item in items:
        reader.leaf(item, {"value"})
    inner = [item.get("value") for item in items]
    text = value.get("value")
    if (text is None) == (not inner) or None in inner:
        reader.problems.add(f"parameter {name} has no value or more than one", reader.place(value))
        return None
    if inner:
        return [item for item in inner if item is not None]
    assert text is not None
    return text.split() if array and family(name_of(value)) not in ("String", "Enumeration") else [text]


def _check(reader: Reader, name: str, type_: str, text: str, enumeration: Enumeration | None, place: Place) -> None:
    """Report a value that the enumeration of the file lacks, or that an integer type cannot hold."""
    if type_ == "Enumeration" and enumeration is not None and text not in dict(enumeration.items):
        reader.problems.add(f"parameter {name} = {text!r} is no item of enumeration {enumeration.name}", place)
    if family(type_) == "Integer":
        low, high = limits(type_)
        digits = text.strip().removeprefix("-").removeprefix("+")
        if digits.isascii() and digits.isdigit() and not low <= (int(text) if len(digits) < 21 else 2**70) <= high:
            reader.problems.add(f"parameter {name} = {text} is out of the range of {type_}", place)
