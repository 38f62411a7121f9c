"""Signal dictionaries (`.ssb`) of SSP 1.0 and 2.0."""

from dataclasses import dataclass

from ..reading.problems import Place, Problems
from ..reading.xml import METADATA_ATTRIBUTES, Element, name_of
from ..values.units import Unit
from .schemas import opened
from .type_elements import TYPE_ELEMENTS, Enumeration, TypeChoice, read_enumerations, read_type
from .unit_definitions import read_units


@dataclass(frozen=True)
class Entry:
    """One signal of a dictionary."""

    name: str
    type: TypeChoice
    place: Place


@dataclass(frozen=True)
class SignalDictionary:
    """The signals of a dictionary by name, and the units and enumerations it defines."""

    entries: dict[str, Entry]
    units: dict[str, Unit]
    enumerations: dict[str, Enumeration]


def read_signal_dictionary(root: Element, file: str, problems: Problems) -> SignalDictionary | None:
    """Read a `SignalDictionary` element that stands alone or inside an SSD; None when it is invalid."""
    reader = opened(root, "SignalDictionary", file, problems)
    if reader is None:
        return None
    reader.attributes(root, {"version", *METADATA_ATTRIBUTES})
    entries: dict[str, Entry] = {}
    for element in reader.children(root, {"DictionaryEntry"}, {"Enumerations", "Units"}):
        reader.attributes(element, {"name"})
        name, place = reader.required(element, "name"), reader.place(element)
        type_ = None
        for value in reader.children(element, TYPE_ELEMENTS | {"Dimension"}):
            if name_of(value) == "Dimension":
                problems.add(f"dictionary entry {name}: arrays are not supported", reader.place(value))
            else:
                if type_ is not None:
                    problems.add(f"dictionary entry {name} has more than one type", reader.place(value))
                type_ = read_type(reader, value, f"dictionary entry {name}")
        if type_ is None:
            problems.add(f"dictionary entry {name} has no type", place)
        if name in entries:
            problems.add(f"dictionary entry {name} is there twice", place)
        entries[name] = Entry(name, type_ or TypeChoice(), place)
    return SignalDictionary(entries, read_units(reader, root), read_enumerations(reader, root))
