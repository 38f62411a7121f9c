"""The types of variables by one name each for both versions of FMI: `Real` is Float64, `Integer` is Int32 of FMI 3.
 All numbers travel as float64: 64-bit integers only as far as that holds them exactly, to ±2**53. A text travels
as its number in `strings`.
"""

import ctypes
import math
from dataclasses import dataclass

from .ssp_types import family, limits

EXACT = 2**53
"""The whole numbers from minus this to this are float64 numbers."""


@dataclass(frozen=True)
class ScalarType:
    """What is known of a type."""

    fmi3: str
    """Name in FMI 3."""
    minimum: int = 0
    """Of whole numbers, as `maximum`."""
    maximum: int = 0


def _integer(name: str) -> ScalarType:
    return ScalarType(name, *limits(name))


TYPES = {
    "Real": ScalarType("Float64"),
    "Float32": ScalarType("Float32"),
    "Int8": _integer("Int8"),
    "UInt8": _integer("UInt8"),
    "Int16": _integer("Int16"),
    "UInt16": _integer("UInt16"),
    "Integer": _integer("Int32"),
    "UInt32": _integer("UInt32"),
    "Int64": _integer("Int64"),
    "UInt64": _integer("UInt64"),
    "Boolean": ScalarType("Boolean", 0, 1),
    "String": ScalarType("String"),
}
"""The types that are connected and recorded, in the order of a component's columns."""
NAMES = {kind.fmi3: name for name, kind in TYPES.items()}
"""Names here by those of FMI 3."""


def rule(type_: str) -> str:
    """Return what a text must be to be a value of a type."""
    if type_ in _RULES:
        return _RULES[type_]
    kind = TYPES[type_]
    return f"a value of type {type_} ({kind.minimum} to {kind.maximum})"


_RULES = {
    "Real": "a finite Real number",
    "Float32": "a finite number within the range of Float32",
    "Integer": "an Integer of 32 bits",
    "Boolean": "a Boolean (true or false)",
    "String": "a String of Unicode characters without NUL",
    "Enumeration": "an item of the enumeration",
}


def misfit(type_: str, value: float) -> str:
    """Return why `value` is no value of a type, or nothing."""
    if family(type_) == "Real":
        if not math.isfinite(value):
            return "which is not finite"
        return "" if type_ == "Real" or math.isfinite(to_float32(value)) else "which is beyond the range of Float32"
    if type_ == "Boolean":
        return "" if value in (0.0, 1.0) else "which is neither 0 nor 1"
    if family(type_) != "Integer":
        return ""
    kind = TYPES[type_]
    if not math.isfinite(value) or value != math.trunc(value):
        return "which is not a whole number"
    if abs(value) > EXACT:
        return "which is beyond ±2^53, where float64 no longer holds every integer"
    if not kind.minimum <= value <= kind.maximum:
        return f"which is beyond the range of {kind.fmi3} ({kind.minimum} to {kind.maximum})"
    return ""


def to_float32(value: float) -> float:
    """Return the nearest number of 32 bits (of two equally near ones the even one); infinity beyond their range."""
    return ctypes.c_float(value).value
