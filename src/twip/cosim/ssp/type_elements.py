"""The type elements of SSP 1.0 and 2.0, and the enumerations that a document defines."""

from dataclasses import dataclass

from ..reading.xml import Element, Reader, name_of
from ..values.types import ALL_NAMES, canonical, family

REFUSED = ("Binary", "Clock")
"""Types of SSP that are not supported."""
TYPE_ELEMENTS = ALL_NAMES | set(REFUSED)


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
