"""The types of the kernel subset, and what they are in C.

A type is one of the words below or a tuple of types, with names where it is a NamedTuple. `WHOLE` is what `floor`
gives: in Python an integer of any size, in C a whole number in a double, which has no -0 as integers have none.
"""

import types
from typing import Any, TypeGuard, get_args, get_origin, get_type_hints

DOUBLE, WHOLE, INTEGER, BOOL, VALUES, NOTHING = "double", "whole", "integer", "bool", "values", "nothing"

Type = str | tuple["Type", ...]


class Named(tuple[Type, ...]):
    """The type of a NamedTuple: to C a tuple like any other."""

    title: str
    names: tuple[str, ...]

    @staticmethod
    def of(hint: type, parts: tuple[Type, ...]) -> "Named":
        """Return the type of the NamedTuple `hint`, whose fields are of the types `parts`."""
        named = Named(parts)
        named.title, named.names = hint.__name__, tuple(get_type_hints(hint))
        return named


def is_named(value: object) -> TypeGuard[type]:
    """Tell whether a value is a NamedTuple, the class."""
    return isinstance(value, type) and issubclass(value, tuple) and hasattr(value, "_fields")


C_NAMES = {DOUBLE: "double", WHOLE: "double", INTEGER: "int64_t", BOOL: "bool", NOTHING: "void"}
_LETTERS = {DOUBLE: "d", WHOLE: "d", INTEGER: "i", BOOL: "b"}
_HINTS: dict[object, Type] = {
    float: DOUBLE, int: INTEGER, bool: BOOL, Any: VALUES, None: NOTHING, types.NoneType: NOTHING,
}  # fmt: skip


def type_of_hint(hint: object) -> Type | None:
    """Return the type that an annotation stands for, or None where the subset has none for it."""
    if get_origin(hint) is tuple or is_named(hint):
        parts = [type_of_hint(part) for part in (get_type_hints(hint).values() if is_named(hint) else get_args(hint))]
        known = tuple(part for part in parts if part is not None)
        if not known or len(known) != len(parts):
            return None
        return Named.of(hint, known) if is_named(hint) else known
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
    """Return whether both types are the same, in tuples up to `WHOLE` for `DOUBLE`; names must be the same too."""
    if isinstance(one, str) or isinstance(other, str):
        return one == other
    return letters(one) == letters(other) and _title(one) == _title(other)


def _title(kind: tuple[Type, ...]) -> tuple[str, tuple[str, ...]] | None:
    return (kind.title, kind.names) if isinstance(kind, Named) else None


def shown(kind: Type) -> str:
    """Return a type as messages name it."""
    words = {DOUBLE: "float", WHOLE: "int", INTEGER: "int", BOOL: "bool", VALUES: "values", NOTHING: "None"}
    if isinstance(kind, Named):
        return kind.title
    return words[kind] if isinstance(kind, str) else f"tuple[{', '.join(map(shown, kind))}]"
