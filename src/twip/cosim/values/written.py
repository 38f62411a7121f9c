"""Values on their way from the text in a file or of the caller to the type and unit of their target."""

import math
from dataclasses import dataclass
from decimal import Decimal

from ..reading.problems import Place, Problems
from .strings import number_of, passes
from .transformation import Items, Transformation, tabulate
from .types import TYPES, family, misfit, to_float32
from .units import Unit, UnitMismatchError, conversion
from .variable import Variable

Value = float | int | bool | str
_ALSO_FITS = {("Integer", "Real"), ("Integer", "Enumeration"), ("String", "Enumeration")}
"""Types of written values, and the families of other targets that take them."""


@dataclass(frozen=True)
class StartValue:
    """A value to set before initialization, in the unit and type of its variable."""

    variable: Variable
    value: Value
    place: Place


@dataclass(frozen=True)
class Written:
    """A value as it is written, on its way to its target."""

    text: str
    type: str | None
    """None for the caller's values."""
    unit: Unit | None
    place: Place
    transformation: Transformation | None = None
    suppress_unit_conversion: bool = False


def take(
    name: str,
    type_: str,
    items: Items,
    unit: Unit | None,
    written: Written,
    problems: Problems,
    relative: bool = False,
) -> Value | None:
    """Return a written value as its target takes it: in its type and unit, transformed; None for a problem.

    `relative` says whether it is a difference, to which the offsets of units do not matter.
    """
    text, transformation, place = written.text, written.transformation, written.place
    if transformation is not None and (reason := transformation.misfit(type_)):
        problems.add(f"{name}: {reason}", transformation.place)
        return None
    known = items
    if transformation is not None and transformation.kind == "enumeration":
        text = transformation.names.get(text.strip(), text)
    elif transformation is not None and transformation.kind == "integer" and written.type == "Integer":
        known = ()  # the numbers of the set need not be items
    value = _parse(name, type_ if known is items else "Integer", known, text, written, problems)
    if value is None:
        return None
    if family(type_) == "Real":
        own = None if written.suppress_unit_conversion else written.unit
        try:
            value = conversion(own, unit, relative)(float(value))
        except UnitMismatchError as mismatch:
            problems.add(
                f"{name} = {text} [{own.name if own else ''}] for a variable in"
                f" {unit.name if unit else 'no unit'}: {mismatch}",
                place,
            )
            return None
        return value if transformation is None else transformation.affine(value)
    if transformation is None or transformation.kind == "enumeration":
        return value
    table = tabulate(transformation, ("Integer" if known is not items else type_, known), (type_, items), problems)
    moved = value if table is None else table(int(value))
    if moved is None:
        problems.add(f"{name} = {text} has no entry in the mapping", place)
        return None
    return bool(moved) if type_ == "Boolean" else moved


def _parse(name: str, target: str, items: Items, text: str, written: Written, problems: Problems) -> Value | None:
    """Return `text` as a value of the target's type."""
    kinds = (None if written.type is None else family(written.type), family(target))
    fits = written.type is None or kinds[0] == kinds[1] or kinds in _ALSO_FITS
    value = parse_value(text, target, items) if fits else None
    if value is None:
        wrong = "" if fits else f", not {written.type}"
        problems.add(f"{name} = {text!r}", written.place, rule=f"must be {TYPES[target].rule}{wrong}")
    return value


def parse_value(text: str, type_: str, items: tuple[tuple[str, int], ...] = ()) -> Value | None:
    """Return `text` as a value of an FMI type, None when it is none; reals must be finite, whole numbers fit the type.

    A Float32 is the nearest number of 32 bits.
    """
    if type_ == "String":
        return text if passes(text) else None
    text, kind = text.strip(), family(type_)
    values = dict(items) if kind == "Enumeration" else {}
    if text in values:
        return values[text]
    if kind in ("Real", "Integer", "Enumeration") and ("_" in text or not text.isascii()):
        return None
    try:
        if kind == "Real":
            real = to_float32(float(text)) if type_ == "Float32" else float(text)
            return real if math.isfinite(real) else None
        if kind == "Integer":
            integer = Decimal(text)  # exact, however the number is written
            least, most = TYPES[type_].minimum, TYPES[type_].maximum
            return int(integer) if least <= integer <= most and integer == integer.to_integral_value() else None
        if kind == "Enumeration":
            number = Decimal(text)
            return next((value for value in values.values() if value == number), None)
    except (ValueError, ArithmeticError):
        return None
    return {"true": True, "1": True, "1.0": True, "false": False, "0": False, "0.0": False}.get(text.lower())


def in_vector(value: Value) -> float:
    """Return a value as it travels; `cannot_travel` tells of what would not arrive as it is."""
    return number_of(value) if isinstance(value, str) else float(value)


def cannot_travel(type_: str, value: Value) -> str:
    """Return why the vector of values cannot hold a value of a type, or nothing."""
    return "" if isinstance(value, str) else misfit("Int64" if type_ == "Enumeration" else type_, value)


def out_of_range(variable: Variable, value: Value, name: str = "") -> list[str]:
    """Return a line for each bound of the variable that `value`, in the variable's unit, does not keep; the line calls
    it `name`, without one by the variable's.
    """
    if isinstance(value, str):
        return []
    unit, problems = f" {variable.unit.name}" if variable.unit else "", []
    for bound, word, wrong in (
        (variable.minimum, "at least", variable.minimum is not None and value < variable.minimum),
        (variable.maximum, "at most", variable.maximum is not None and value > variable.maximum),
    ):
        if wrong:
            problems.append(f"{name or variable.name} = {value}{unit} must be {word} {bound}{unit}")
    return problems
