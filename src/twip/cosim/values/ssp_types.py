"""The value types of SSP 1.0 and 2.0, and which of them can be connected.

`Real` is `Float64` and `Integer` is `Int32` (SSP 2.0 section 4.5.1). A value may pass to a type that holds every value
of its own, `Float32` to `Float64` for example; what loses information is refused. An enumeration travels as `Integer`.
"""

from dataclasses import dataclass

from ..reading.xml import Element, Reader, name_of

REFUSED = ("Binary", "Clock")
"""Types of SSP that are not supported."""
_INTEGERS = {f"{sign}Int{bits}": (sign, bits) for sign in ("", "U") for bits in (8, 16, 32, 64)}
_FAMILIES = {
    **dict.fromkeys(("Real", "Float64", "Float32"), "Real"),
    **dict.fromkeys(("Integer", *_INTEGERS), "Integer"),
    **{name: name for name in ("Boolean", "String", "Enumeration")},
}
TYPES = frozenset(_FAMILIES)
"""Names of the types that are supported."""


def family(type_: str) -> str:
    """Return `Real`, `Integer`, `Boolean`, `String` or `Enumeration`."""
    return _FAMILIES.get(type_, type_)


def canonical(type_: str) -> str:
    """Return the one name of a type that has two: `Real` and `Integer` rather than `Float64` and `Int32`."""
    return {"Float64": "Real", "Int32": "Integer"}.get(type_, type_)


def limits(type_: str) -> tuple[int, int]:
    """Return the least and the greatest value of an integer type; an enumeration has those of `Integer`."""
    sign, bits = _INTEGERS.get(type_, ("", 32))
    return (0, 2**bits - 1) if sign else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)


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


@dataclass(frozen=True)
class Enumeration:
    """An enumeration by name."""

    name: str
    items: tuple[tuple[str, int], ...]
    """Names and values."""


@dataclass(frozen=True)
class TypeChoice:
    """The type of a connector or dictionary entry as written; all None where it is left open."""

    type: str | None = None
    unit: str | None = None
    enumeration: str | None = None


TYPE_ELEMENTS = TYPES | set(REFUSED)


def read_type(reader: Reader, element: Element, owner: str) -> TypeChoice:
    """Read a type element; `owner` names its parent in messages."""
    name = name_of(element)
    if name in REFUSED:
        reader.problems.add(f"{owner}: type {name} is not supported", reader.place(element))
        return TypeChoice()
    reader.leaf(element, {"Real": {"unit"}, "Enumeration": {"name"}}.get(family(name), set()))
    return TypeChoice(
        canonical(name), element.get("unit"), reader.required(element, "name") if name == "Enumeration" else None
    )


def read_enumerations(reader: Reader, parent: Element) -> dict[str, Enumeration]:
    """Read the `Enumerations` element of a document, if `parent` has one."""
    found: dict[str, Enumeration] = {}
    for element in reader.listed(parent, "Enumerations", {"Enumeration"}):
        reader.attributes(element, {"name"})
        name = reader.required(element, "name")
        items: dict[str, int] = {}
        for item in reader.children(element, {"Item"}):
            reader.leaf(item, {"name", "value"})
            label, value = reader.required(item, "name"), reader.integer(item, "value")
            if label in items:
                reader.problems.add(f"enumeration {name}: item {label} is there twice", reader.place(item))
            if value is not None:
                items[label] = value
        if name in found:
            reader.problems.add(f"enumeration {name} is defined twice", reader.place(element))
        if not items:
            reader.problems.add(f"enumeration {name} has no items", reader.place(element))
        found[name] = Enumeration(name, tuple(items.items()))
    return found
