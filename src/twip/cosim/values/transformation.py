"""Transformations of values on connections and in parameter mappings (SSP 1.0 section 4.5.2).

A linear transformation acts on Real values that are already in the target's unit. The mapping transformations replace
Boolean, Integer or Enumeration values by a table; a value that the table lacks is kept (SSP 1.0.1), as long as the
target can take it: what is no item of the target's enumeration is a failure.
"""

from collections.abc import Mapping as AnyMapping
from dataclasses import dataclass, field

from ..reading.problems import Place, Problems
from ..reading.xml import Element, Reader, name_of
from .types import family, limits
from .units import IDENTITY, Affine

_KINDS = {
    "LinearTransformation": "linear",
    "BooleanMappingTransformation": "boolean",
    "IntegerMappingTransformation": "integer",
    "EnumerationMappingTransformation": "enumeration",
}
TRANSFORMATIONS = frozenset(_KINDS)
_NEEDS = {
    "linear": ("a linear transformation needs Real values", {"Real"}),
    "boolean": ("a boolean mapping needs Boolean values", {"Boolean"}),
    "integer": ("an integer mapping needs Integer or Enumeration values", {"Integer", "Enumeration"}),
    "enumeration": ("an enumeration mapping needs Enumeration values", {"Enumeration"}),
}
Items = tuple[tuple[str, int], ...]


@dataclass(frozen=True)
class Transformation:
    """A transformation as written."""

    kind: str
    """`linear`, `boolean`, `integer` or `enumeration`."""
    affine: Affine
    """Of a linear transformation."""
    names: AnyMapping[str, str]
    """Of an enumeration mapping, names of items."""
    numbers: AnyMapping[int, int]
    """Of a boolean or integer mapping."""
    place: Place

    def misfit(self, *types: str) -> str:
        """Return why values of `types` cannot be transformed, or nothing."""
        needs, families = _NEEDS[self.kind]
        wrong = [type_ for type_ in types if family(type_) not in families]
        return f"{needs}, not {wrong[0]}" if wrong else ""


@dataclass(frozen=True)
class Mapping:
    """A table from numbers to numbers."""

    table: AnyMapping[int, int] = field(default_factory=dict)
    keeps: bool = True
    """Whether a value that the table lacks is kept; otherwise it is a failure."""

    def __call__(self, value: int) -> int | None:
        """Return what becomes of `value`, None when it must not occur."""
        return self.table.get(value, value if self.keeps else None)

    def then(self, after: "Mapping") -> "Mapping":
        """Return the mapping that applies this one first, `after` next."""
        sources = self.table.keys() | (after.table.keys() if self.keeps else set())
        results = {source: self._next(source, after) for source in sorted(sources)}
        return Mapping({s: r for s, r in results.items() if r is not None}, self.keeps and after.keeps)

    def _next(self, source: int, after: "Mapping") -> int | None:
        value = self(source)
        return None if value is None else after(value)

    def inverse(self, value: float) -> float:
        """Return the least number that becomes `value`, `value` itself when there is none."""
        return min((s for s, target in self.table.items() if target == value), default=value)


def read_transformation(reader: Reader, element: Element) -> Transformation:
    """Read one of the elements `TRANSFORMATIONS`."""
    kind = _KINDS[name_of(element)]
    affine, names, numbers = IDENTITY, dict[str, str](), dict[int, int]()
    if kind == "linear":
        reader.leaf(element, {"factor", "offset"})
        factor, offset = reader.number(element, "factor", 1.0), reader.number(element, "offset", 0.0)
        affine = Affine(1.0 if factor is None else factor, offset or -0.0)
        return Transformation(kind, affine, names, numbers, reader.place(element))
    reader.attributes(element, set())
    for entry in reader.children(element, {"MapEntry"}):
        reader.leaf(entry, {"source", "target"})
        text = reader.required(entry, "source")
        if kind == "enumeration":
            twice = text in names
            names[text] = reader.required(entry, "target")
        else:
            source, target = (
                int(reader.boolean(entry, side)) if kind == "boolean" else reader.integer(entry, side)
                for side in ("source", "target")
            )
            if source is None or target is None:
                continue
            twice = source in numbers
            numbers[source] = target
        if twice:
            reader.problems.add(f"the mapping has two entries for {text}", reader.place(entry))
    if not names and not numbers:
        reader.problems.add(f"{name_of(element)} has no entries", reader.place(element))
    return Transformation(kind, affine, names, numbers, reader.place(element))


def tabulate(
    transformation: Transformation | None, source: tuple[str, Items], target: tuple[str, Items], problems: Problems
) -> Mapping | None:
    """Return what happens to Boolean, Integer and Enumeration values between two types with their items (empty where
    there are none or they are not known), None if nothing does. What the table cannot mean is a problem.
    """
    (_, from_items), (to_type, to_items) = source, target
    before, after = dict(from_items), dict(to_items)
    if transformation is None:
        checked = bool(after) and family(source[0]) == "Integer"
        return Mapping({value: value for value in after.values()}, False) if checked else None
    place = transformation.place
    if transformation.kind == "enumeration":
        for side, known in ((transformation.names, before), (transformation.names.values(), after)):
            for name in sorted(set(side) - known.keys()):
                problems.add(f"{name} is no item of the enumeration", place)
        moved = {value: transformation.names.get(name, name) for name, value in from_items}
        return Mapping({value: after[name] for value, name in moved.items() if name in after}, False)
    low, high = (0, 1) if to_type == "Boolean" else limits(to_type)
    for number in sorted(set(transformation.numbers.values())):
        if (after and number not in after.values()) or not low <= number <= high:
            problems.add(f"{number} is no {'item of the enumeration' if after else to_type}", place)
    for number in sorted(transformation.numbers):
        if before and number not in before.values():
            problems.add(f"{number} is no item of the enumeration", place)
    if not after:
        return Mapping(dict(transformation.numbers))
    kept = {value: value for value in after.values() if not before or value in before.values()}
    moved_numbers = {s: t for s, t in transformation.numbers.items() if t in after.values()}
    return Mapping({**{s: t for s, t in kept.items() if s not in transformation.numbers}, **moved_numbers}, False)
