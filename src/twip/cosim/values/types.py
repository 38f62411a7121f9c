"""The types of variables: one table for both versions of FMI and of SSP.

Each has one name here: `Real` is Float64, `Integer` is Int32 of FMI 3 (SSP 2.0 section 4.5.1). All numbers travel as
float64: 64-bit integers only as far as that holds them exactly, to ±2**53. A text travels as its number in `strings`,
an enumeration as Integer (FMI 2) or Int64 (FMI 3). A value may pass to a type that holds every value of its own,
Float32 to Real for example; what loses information is refused.
"""

import ctypes
import math
from dataclasses import dataclass

EXACT = 2**53
"""The whole numbers from minus this to this are float64 numbers."""


@dataclass(frozen=True)
class ScalarType:
    """What is known of a type."""

    fmi3: str
    """Name in FMI 3 and SSP 2.0."""
    family: str
    """`Real`, `Integer`, `Boolean`, `String` or `Enumeration`."""
    rule: str
    """What a text must be to be a value of it."""
    fmi3_type: type
    """How the functions of FMI 3 take it."""
    fmi2_type: type | None = None
    """How the functions of FMI 2 take it; None for what neither FMI 2 nor SSP 1.0 has."""
    minimum: int = 0
    """Of whole numbers, as `maximum`."""
    maximum: int = 0


def _integer(name: str, fmi3_type: type, sign: int, bits: int) -> ScalarType:
    least, most = (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) if sign else (0, 2**bits - 1)
    rule = f"a value of type {name} ({least} to {most})"
    return ScalarType(name, "Integer", rule, fmi3_type, minimum=least, maximum=most)


_INT32 = -(2**31), 2**31 - 1
TYPES = {
    "Real": ScalarType("Float64", "Real", "a finite Real number", ctypes.c_double, ctypes.c_double),
    "Float32": ScalarType("Float32", "Real", "a finite number within the range of Float32", ctypes.c_float),
    "Int8": _integer("Int8", ctypes.c_int8, 1, 8),
    "UInt8": _integer("UInt8", ctypes.c_uint8, 0, 8),
    "Int16": _integer("Int16", ctypes.c_int16, 1, 16),
    "UInt16": _integer("UInt16", ctypes.c_uint16, 0, 16),
    "Integer": ScalarType("Int32", "Integer", "an Integer of 32 bits", ctypes.c_int32, ctypes.c_int, *_INT32),
    "UInt32": _integer("UInt32", ctypes.c_uint32, 0, 32),
    "Int64": _integer("Int64", ctypes.c_int64, 1, 64),
    "UInt64": _integer("UInt64", ctypes.c_uint64, 0, 64),
    "Boolean": ScalarType("Boolean", "Boolean", "a Boolean (true or false)", ctypes.c_bool, ctypes.c_int, 0, 1),
    "String": ScalarType(
        "String", "String", "a String of Unicode characters without NUL", ctypes.c_char_p, ctypes.c_char_p
    ),
    "Enumeration": ScalarType(
        "Enumeration", "Enumeration", "an item of the enumeration", ctypes.c_int64, ctypes.c_int, *_INT32
    ),
}
"""The types that are supported, by their names here."""
RECORDED_TYPES = tuple(name for name in TYPES if name != "Enumeration")
"""The types that are connected and recorded, in the order of a component's columns."""
FMI2_TYPES = tuple(name for name, kind in TYPES.items() if kind.fmi2_type is not None)
"""The types of FMI 2 and SSP 1.0."""
_NAMES = {kind.fmi3: name for name, kind in TYPES.items()}
ALL_NAMES = frozenset({*TYPES, *_NAMES})
"""All names of the supported types."""


def canonical(name: str) -> str:
    """Return the name here of a type of FMI 3 or SSP; that of an unknown type is its own."""
    return _NAMES.get(name, name)


def family(type_: str) -> str:
    """Return `Real`, `Integer`, `Boolean`, `String` or `Enumeration`; an unknown type is a family of its own."""
    kind = TYPES.get(canonical(type_))
    return type_ if kind is None else kind.family


def limits(type_: str) -> tuple[int, int]:
    """Return the least and the greatest value of an integer type; an enumeration has those of `Integer`."""
    kind = TYPES[canonical(type_)]
    return kind.minimum, kind.maximum


def holds(target: str, source: str) -> bool:
    """Tell whether a connector of type `target` can take every value of type `source`, both of one family or an
    enumeration and an integer.
    """
    kinds = (family(source), family(target))
    if kinds == ("Real", "Real"):
        return target != "Float32" or source == "Float32"
    if set(kinds) <= {"Integer", "Enumeration"} and kinds != ("Integer", "Enumeration"):
        (low, high), (least, greatest) = limits(source), limits(target)
        return least <= low and high <= greatest
    return kinds[0] == kinds[1]


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
