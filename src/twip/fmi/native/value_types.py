"""The types of the kernel subset, and what they are in C.

A type is one of the words below or a tuple of types. `WHOLE` is what `floor` gives: in Python an integer of any size,
in C a whole number in a double, which has no -0 as integers have none.
"""

import types
from typing import Any, get_args, get_origin

DOUBLE, WHOLE, INTEGER, BOOL, VALUES, NOTHING = "double", "whole", "integer", "bool", "values", "nothing"

Type = str | tuple["Type", ...]

C_NAMES = {DOUBLE: "double", WHOLE: "double", INTEGER: "int64_t", BOOL: "bool", NOTHING: "void"}
_LETTERS = {DOUBLE: "d", WHOLE: "d", INTEGER: "i", BOOL: "b"}
_HINTS: dict[object, Type] = {
    float: DOUBLE, int: INTEGER, bool: BOOL, Any: VALUES, None: NOTHING, types.NoneType: NOTHING,
}  # fmt: skip


def type_of_hint(hint: object) -> Type | None:
    """Return the type that an annotation stands for, or None where the subset has none for it."""
    if get_origin(hint) is tuple:
        parts = [type_of_hint(part) for part in get_args(hint)]
        known = tuple(part for part in parts if part is not None)
        return known if known and len(known) == len(parts) else None
    try:
        return _HINTS.get(hint)
    except TypeError:
        return None


def letters(kind: Type) -> str:
    """Return a short name of a type, the same for types that C does not tell apart."""
    if isinstance(kind, str):
        return _LETTERS[kind]
    return f"{len(kind)}" + "".join(letters(part) for part in kind)


def struct_name(kind: tuple[Type, ...]) -> str:
    """Return the name of the struct that holds a tuple: `t_2dd` for two doubles."""
    return f"t_{letters(kind)}"


def alike(one: Type, other: Type) -> bool:
    """Return whether both types are the same, in tuples up to `WHOLE` for `DOUBLE`."""
    if isinstance(one, str) or isinstance(other, str):
        return one == other
    return letters(one) == letters(other)


def shown(kind: Type) -> str:
    """Return a type as messages name it."""
    words = {DOUBLE: "float", WHOLE: "int", INTEGER: "int", BOOL: "bool", VALUES: "values", NOTHING: "None"}
    return words[kind] if isinstance(kind, str) else f"tuple[{', '.join(map(shown, kind))}]"
