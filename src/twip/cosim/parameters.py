"""Start values and parameters: from bindings, parameter files and the caller to the variables of the FMUs.

Precedence, lowest first (SSP 1.0 section 4.3.4): bindings of components, of inner systems, of the outermost system (a
later binding before an earlier one), parameter files of the caller in their order, start values of the caller.
"""

import difflib
import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from .fmu import Fmu, Variable
from .problems import Place, Problems
from .ssv import ParameterSet
from .units import IDENTITY, Unit, UnitMismatchError, conversion, lookup
from .wiring import Key, Port, Wiring, convert_along, full_name

Value = float | int | bool | str


@dataclass(frozen=True)
class StartValue:
    """A value to set before initialization, in the unit and type of its variable."""

    variable: Variable
    value: Value
    place: Place


@dataclass
class Assignments:
    """Collects values by target; a later one replaces an earlier one."""

    fmus: Mapping[str, Fmu]
    wiring: Wiring
    units: dict[str, Unit]
    problems: Problems
    variables: dict[Key, StartValue] = field(default_factory=dict)
    connectors: dict[Key, float] = field(default_factory=dict)
    """Values given to system connectors, in the connector's unit."""
    callers: dict[Key, Place] = field(default_factory=dict)
    """What the caller or a parameter file of the caller gives a value to."""

    def __post_init__(self) -> None:
        self._names: dict[str, list[tuple[Key, Variable | Port]]] = {}
        for path, fmu in self.fmus.items():
            for variable in fmu.variables.values():
                self._enter((path, variable.name), variable)
        for key, port in self.wiring.ports.items():
            if port.variable is None:
                self._enter(key, port)

    def _enter(self, key: Key, target: Variable | Port) -> None:
        self._names.setdefault(full_name(key), []).append((key, target))

    def apply_set(self, parameters: ParameterSet, scope: str, prefix: str = "", from_caller: bool = False) -> None:
        """Apply a parameter set to the component or system at the dotted path `scope`."""
        for parameter in parameters.parameters:
            name = prefix + parameter.name
            found = self._find(scope, name, parameter.place)
            if found is None:
                continue
            key, target = found
            if from_caller:
                self.callers[key] = parameter.place
            unit = lookup(parameter.unit, parameters.units, self.units)
            if unit is not None and unit.exponents is None and key[0] in self.fmus:
                unit = lookup(unit.name, self.fmus[key[0]].units)
            self._assign(key, target, parameter.text, parameter.type, unit, parameter.place)

    def apply_values(self, values: Mapping[str, Value]) -> None:
        """Apply values by `component.variable`, in the variables' own units."""
        place = Place("start values")
        for name, value in values.items():
            found = self._find("", name, place)
            if found is not None:
                self.callers[found[0]] = place
                text = str(value).lower() if isinstance(value, bool) else str(value)
                self._assign(*found, text, None, None, place)

    def _find(self, scope: str, name: str, place: Place) -> tuple[Key, Variable | Port] | None:
        full = f"{scope}.{name}" if scope else name
        matches = self._names.get(full, [])
        if len(matches) == 1:
            return matches[0]
        if matches:
            self.problems.add(f"parameter {name} is ambiguous", place)
            return None
        known = [n[len(scope) + 1 :] for n in self._names if n.startswith(f"{scope}.")] if scope else list(self._names)
        close = difflib.get_close_matches(name, known, 1)
        hint = f", did you mean {close[0]}?" if close else ""
        self.problems.add(
            f"unknown parameter {name}{hint}", Place(place.file, place.line, scope if scope in self.fmus else None)
        )
        return None

    def _assign(
        self, key: Key, target: Variable | Port, text: str, type_: str | None, unit: Unit | None, place: Place
    ) -> None:
        if isinstance(target, Variable):
            place = Place(place.file, place.line, key[0])
            if not target.settable:
                self.problems.add(
                    f"{target.name} cannot be set: it is a {target.variability} {target.causality}", place
                )
                return
            value = self._convert(target.name, target.type, target, text, type_, place)
            if value is None:
                return
            if target.type == "Real":
                try:
                    value = conversion(unit, target.unit)(float(value))
                except UnitMismatchError as mismatch:
                    self.problems.add(
                        f"{target.name} = {text} [{unit.name if unit else ''}] for a variable in"
                        f" {target.unit.name if target.unit else 'no unit'}: {mismatch}",
                        place,
                    )
                    return
            self.variables[key] = StartValue(target, value, place)
            return
        self._forward(target, text, type_, unit, place)

    def _forward(self, port: Port, text: str, type_: str | None, unit: Unit | None, place: Place) -> None:
        """Give a value to a system connector: it becomes the start value of every component variable behind it."""
        links = [
            (key, link)
            for key, link in sorted(self.wiring.links.items())
            if any(e.source.key == port.key for e in link.edges)
        ]
        port_type = port.type or next((e.target.type for _, link in links for e in link.edges if e.target.type), "Real")
        value = self._convert(full_name(port.key), port_type, None, text, type_, place)
        if value is None or isinstance(value, str):
            return
        start = port.unit or unit
        try:
            in_connector = conversion(unit, port.unit) if port_type == "Real" else IDENTITY
        except UnitMismatchError as mismatch:
            self.problems.add(f"{full_name(port.key)} = {text} [{unit.name if unit else ''}]: {mismatch}", place)
            return
        number = in_connector(float(value)) if port_type == "Real" else value
        self.connectors[port.key] = float(number)
        for key, link in links:
            first = next(i for i, edge in enumerate(link.edges) if edge.source.key == port.key)
            variable = link.edges[-1].target.variable
            converted = convert_along(link.edges[first:], self.problems, start)
            if variable is not None and converted is not None:
                inner = converted(float(number)) if port_type == "Real" else value
                self.variables[key] = StartValue(variable, inner, Place(place.file, place.line, key[0]))

    def _convert(
        self, name: str, target: str, variable: Variable | None, text: str, type_: str | None, place: Place
    ) -> Value | None:
        """Return `text` as a value of the target's type; `type_` is the type it was written in, None for the caller's
        values.
        """
        fits = type_ in (None, target) or (type_, target) in (
            ("Integer", "Real"),
            ("Integer", "Enumeration"),
            ("String", "Enumeration"),
        )
        value = parse_value(text, target, () if variable is None else variable.items) if fits else None
        if value is None:
            self.problems.add(
                f"{name} = {text!r} must be {_ARTICLE[target]}" + (f", not {type_}" if not fits else ""), place
            )
        return value

    def check_connected(self) -> None:
        """Report the caller's values for what a component or a given connector feeds: they would have no effect.

        Those of the system's description may stay: where an initial value is sought, they are where it begins.
        """
        for key, place in self.callers.items():
            link, port = self.wiring.links.get(key), self.wiring.ports.get(key)
            if link is None or port is None or port.kind == "parameter":
                continue
            if link.source.variable is not None or link.source.key in self.connectors:
                self.problems.add(
                    f"{full_name(key)} is connected inside the system and cannot be given a start value", place
                )

    def check_ranges(self) -> None:
        """Report every value outside the bounds that the model description states."""
        for start in self.variables.values():
            for problem in out_of_range(start.variable, start.value):
                self.problems.add(problem, start.place)


def out_of_range(variable: Variable, value: Value) -> list[str]:
    """Return a line for each bound of the variable that `value`, in the variable's unit, does not keep."""
    if isinstance(value, str):
        return []
    unit, problems = f" {variable.unit.name}" if variable.unit else "", []
    for bound, word, wrong in (
        (variable.minimum, "at least", variable.minimum is not None and value < variable.minimum),
        (variable.maximum, "at most", variable.maximum is not None and value > variable.maximum),
    ):
        if wrong:
            if variable.type != "Real" and bound is not None and bound.is_integer():
                bound = int(bound)
            problems.append(f"{variable.name} = {value}{unit} must be {word} {bound}{unit}")
    return problems


_ARTICLE = {
    "Real": "a finite Real number",
    "Integer": "an Integer of 32 bits",
    "Boolean": "a Boolean (true or false)",
    "String": "a String",
    "Enumeration": "an item of the enumeration",
}


def parse_value(text: str, type_: str, items: tuple[tuple[str, int], ...] = ()) -> Value | None:
    """Return `text` as a value of an FMI type, None when it is none; Reals must be finite, Integers fit 32 bits."""
    text = text if type_ == "String" else text.strip()
    if type_ in ("Real", "Integer") and "_" in text:
        return None
    try:
        if type_ == "Real":
            real = float(text)
            return real if math.isfinite(real) else None
        if type_ == "Integer":
            integer = int(text) if not any(c in text for c in ".eE") else float(text)
            return int(integer) if integer == int(integer) and -(2**31) <= integer < 2**31 else None
    except (ValueError, OverflowError):
        return None
    if type_ == "Boolean":
        return {"true": True, "1": True, "1.0": True, "false": False, "0": False, "0.0": False}.get(text.lower())
    if type_ == "Enumeration":
        values = dict(items)
        if text in values:
            return values[text]
        return (
            int(text)
            if text.lstrip("-").isascii() and text.lstrip("-").isdigit() and (int(text) in values.values())
            else None
        )
    return text
