"""Writes parameter sets (`.ssv`) that `load(parameters=...)` takes: of SSP 1.0, or of 2.0 where types need it."""

import pathlib
from collections.abc import Iterable
from dataclasses import dataclass

from lxml import etree

from ...outputs import write_file
from ..model.system import System
from ..values.types import FMI2_TYPES, TYPES
from ..values.units import BASE_UNITS, Unit
from ..values.written import Value, parse_value

SSC = "http://ssp-standard.org/SSP1/SystemStructureCommon"
SSV = "http://ssp-standard.org/SSP1/SystemStructureParameterValues"


@dataclass(frozen=True)
class Entry:
    """One parameter of a set: `name` is `component.variable`, `type` as in `values.types`."""

    name: str
    type: str
    value: Value
    unit: Unit | None = None


def parameters_of(system: System) -> list[Entry]:
    """Return every parameter of every component with the value it would start with, in the order of the file."""
    entries = []
    for component in system.components:
        given = {start.variable.name: start.value for start in component.start_values}
        for variable in component.fmu.variables.values():
            if variable.causality != "parameter" or variable.alias_of or variable.type == "Binary":
                continue
            value = given.get(variable.name)
            if value is None and variable.start is not None:
                value = parse_value(variable.start, variable.type, variable.items)
            value = next((name for name, number in variable.items if number == value), value)
            if value is not None:
                entries.append(Entry(f"{component.name}.{variable.name}", variable.type, value, variable.unit))
    return entries


def write_parameter_set(path: pathlib.Path, name: str, entries: Iterable[Entry]) -> None:
    """Write a parameter set called `name` to `path`. Raises `TwipError` when the file cannot be written."""
    entries = list(entries)
    version = "1.0" if all(entry.type in FMI2_TYPES for entry in entries) else "2.0"
    root = etree.Element(f"{{{SSV}}}ParameterSet", {"version": version, "name": name}, nsmap={"ssc": SSC, "ssv": SSV})
    parameters = etree.SubElement(root, f"{{{SSV}}}Parameters")
    units: dict[str, Unit] = {}
    for entry in entries:
        parameter = etree.SubElement(parameters, f"{{{SSV}}}Parameter", {"name": entry.name})
        text = str(entry.value).lower() if isinstance(entry.value, bool) else str(entry.value)
        element = entry.type if version == "1.0" else TYPES[entry.type].fmi3
        value = etree.SubElement(parameter, f"{{{SSV}}}{element}", {"value": text})
        if entry.unit is not None and entry.unit.exponents is not None:
            value.set("unit", entry.unit.name)
            units[entry.unit.name] = entry.unit
    if units:
        definitions = etree.SubElement(root, f"{{{SSV}}}Units")
        for unit in sorted(units.values(), key=lambda u: u.name):
            definition = etree.SubElement(definitions, f"{{{SSC}}}Unit", {"name": unit.name})
            etree.SubElement(definition, f"{{{SSC}}}BaseUnit", _base_unit(unit))
    document = etree.tostring(root, pretty_print=True, xml_declaration=True, encoding="UTF-8")
    write_file(path, document)


def _base_unit(unit: Unit) -> dict[str, str]:
    exponents = zip(BASE_UNITS, unit.exponents or (), strict=True)
    attributes = {symbol: str(power) for symbol, power in exponents if power}
    if unit.factor != 1.0:
        attributes["factor"] = repr(unit.factor)
    if unit.offset != 0.0:
        attributes["offset"] = repr(unit.offset)
    return attributes
