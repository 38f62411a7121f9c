"""Reads the units that an SSD, SSV or SSB document defines."""

from ..reading.xml import Element, Reader
from ..values.units import BASE_UNITS, Unit


def read_units(reader: Reader, parent: Element) -> dict[str, Unit]:
    """Read the `Units` element of an SSD or SSV document, if `parent` has one."""
    units: dict[str, Unit] = {}
    for element in reader.listed(parent, "Units", {"Unit"}):
        reader.attributes(element, {"name"})
        name = reader.required(element, "name")
        bases = list(reader.children(element, {"BaseUnit"}))
        if len(bases) != 1:
            reader.problems.add(f"unit {name} has {'more than one' if bases else 'no'} BaseUnit", reader.place(element))
            continue
        base = bases[0]
        reader.leaf(base, {*BASE_UNITS, "factor", "offset"})
        if name in units:
            reader.problems.add(f"unit {name} is defined twice", reader.place(element))
        powers = [reader.number(base, symbol, 0.0) or 0.0 for symbol in BASE_UNITS]
        if any(power != int(power) for power in powers):
            reader.problems.add(f"unit {name}: exponents", reader.place(base), rule="must be whole numbers")
        exponents = tuple(map(int, powers))
        factor = reader.number(base, "factor", 1.0) or 0.0
        if factor == 0.0:
            reader.problems.add(f"unit {name}: factor", reader.place(base), rule="must not be zero")
            factor = 1.0
        units[name] = Unit(name, exponents, factor, reader.number(base, "offset", 0.0) or 0.0)
    return units
