"""Start values and parameters: from bindings, parameter files and the caller to the variables of the FMUs.

A name stands for every variable and connector of that hierarchical name (SSP 1.0 section 5.2.3). What a binding of the
description names and nobody has is ignored, with a warning; what the caller names must be there.
"""

import dataclasses
import difflib
import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from .fmu import Fmu, Variable
from .kinds import GIVING
from .links import Conversion, Key, Port, convert_along, full_name
from .problems import Place, Problems
from .scalar_types import EXACT, TYPES, misfit, rule, to_float32
from .ssm import MappingEntry, ParameterMapping
from .ssv import Parameter, ParameterSet
from .texts import number_of
from .transformation import Transformation, tabulate
from .units import Unit, UnitMismatchError, conversion, lookup
from .value_types import family
from .wiring import Wiring

Value = float | int | bool | str
_NAMED = 10
"""Most names in one warning."""


@dataclass(frozen=True)
class StartValue:
    """A value to set before initialization, in the unit and type of its variable."""

    variable: Variable
    value: Value
    place: Place


@dataclass(frozen=True)
class Scope:
    """What a parameter set is applied to."""

    path: str
    """Dotted path of a component or system."""
    prefix: str
    """Comes before every name of the set."""
    units: Mapping[str, Unit]
    """Units of the file that holds the binding, for what the set itself does not define."""
    from_caller: bool = False


@dataclass(frozen=True)
class Written:
    """A value as it is written, on its way to its target."""

    text: str
    type: str | None
    """None for the caller's values."""
    unit: Unit | None
    place: Place
    transformation: Transformation | None = None
    suppress_unit_conversion: bool = False


@dataclass
class Assignments:
    """Collects values by target; a later one replaces an earlier one."""

    fmus: Mapping[str, Fmu]
    wiring: Wiring
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
            if port.variable is None and not port.shared:
                self._enter(key, port)

    def _enter(self, key: Key, target: Variable | Port) -> None:
        self._names.setdefault(full_name(key), []).append((key, target))

    def apply_set(self, parameters: ParameterSet, scope: Scope, mapping: ParameterMapping | None = None) -> None:
        """Apply a parameter set to a component or system; with a mapping, only what it names."""
        names = {scope.prefix + parameter.name for parameter in parameters.parameters}
        entries: dict[str, list[MappingEntry | None]] = {}
        for item in () if mapping is None else mapping.entries:
            entries.setdefault(item.source, []).append(item)
            if item.source not in names:
                self.problems.warn(f"the parameter set has no {item.source} to map", item.place)
        missing: list[tuple[str, Place]] = []
        for parameter in parameters.parameters:
            name = scope.prefix + parameter.name
            for entry in [None] if mapping is None else entries.get(name, []):
                target = (name if entry is None else entry.target) + parameter.index
                if not self._apply(parameter, parameters, scope, target, entry):
                    missing.append((target, parameter.place))
        if missing:
            self._warn_of_missing(missing, scope)

    def _warn_of_missing(self, missing: list[tuple[str, Place]], scope: Scope) -> None:
        place = Place(missing[0][1].file, missing[0][1].line, scope.path if scope.path in self.fmus else None)
        names = ", ".join(name for name, _ in missing[:_NAMED])
        more = f" and {len(missing) - _NAMED} more" if len(missing) > _NAMED else ""
        what = f"unknown parameter {names} is" if len(missing) == 1 else f"unknown parameters {names}{more} are"
        self.problems.warn(f"{what} ignored", place)

    def _apply(
        self, parameter: Parameter, parameters: ParameterSet, scope: Scope, name: str, entry: MappingEntry | None
    ) -> bool:
        """Apply one parameter; return whether it is known, or reported as unknown."""
        place = parameter.place
        matches = self._find(scope, name, place)
        for key, target in matches:
            if scope.from_caller:
                self.callers[key] = place
            unit = lookup(parameter.unit, parameters.units, scope.units)
            if unit is not None and unit.exponents is None and key[0] in self.fmus:
                unit = lookup(unit.name, self.fmus[key[0]].units)
            written = Written(parameter.text, parameter.type, unit, place)
            if entry is not None:
                written = dataclasses.replace(
                    written,
                    transformation=entry.transformation,
                    suppress_unit_conversion=entry.suppress_unit_conversion,
                )
            self._assign(key, target, written)
        return bool(matches) or scope.from_caller

    def apply_values(self, values: Mapping[str, Value]) -> None:
        """Apply values by `component.variable`, in the variables' own units."""
        place = Place("start values")
        for name, value in values.items():
            for key, target in self._find(Scope("", "", {}, from_caller=True), name, place):
                self.callers[key] = place
                text = str(value).lower() if isinstance(value, bool) else str(value)
                self._assign(key, target, Written(text, None, None, place))

    def apply_constants(self) -> None:
        """Give parameters that a constant of another component feeds its value."""
        for key, link in self.wiring.links.items():
            source, variable = link.source.variable, link.edges[-1].target.variable
            if source is None or variable is None or source.variability != "constant" or variable.causality == "input":
                continue
            place = dataclasses.replace(link.edges[-1].connection.place, component=key[0])
            value = None if source.start is None else parse_value(source.start, source.type, source.items)
            if value is None:
                self.problems.add(f"{link.label}: the constant has no value that could be passed", place)
            elif isinstance(value, str):
                self._set_variable(key, variable, value, place)
            else:
                moved = self._converted(link.conversion, value, variable, link.label, place)
                self._set_variable(key, variable, moved, place)

    def _find(self, scope: Scope, name: str, place: Place) -> list[tuple[Key, Variable | Port]]:
        path = scope.path
        matches = self._names.get(f"{path}.{name}" if path else name, [])
        if not matches and scope.from_caller:
            close = difflib.get_close_matches(name, self._names, 1)
            self.problems.add(f"unknown parameter {name}" + (f", did you mean {close[0]}?" if close else ""), place)
        return matches

    def _assign(self, key: Key, target: Variable | Port, written: Written) -> None:
        if isinstance(target, Port):
            self._forward(target, written)
            return
        place = dataclasses.replace(written.place, component=key[0])
        written = dataclasses.replace(written, place=place)
        if target.obstacle:
            self.problems.add(f"{target.name} cannot be set: {target.obstacle}", place)
            return
        value = self._value(target.name, target.type, target.items, target.unit, written)
        self._set_variable(key, target, value, place)

    def _set_variable(self, key: Key, variable: Variable, value: Value | None, place: Place) -> None:
        if value is None:
            return
        if not isinstance(value, str) and variable.type != "Enumeration":
            value = to_float32(value) if variable.type == "Float32" else value
            limited = family(variable.type) == "Real" or abs(value) <= EXACT
            if limited and (why := misfit(variable.type, value)):
                self.problems.add(f"{variable.name} cannot be set: {value} is a value {why}", place)
                return
        self.variables[key] = StartValue(variable, value, place)

    def _value(
        self, name: str, type_: str, items: tuple[tuple[str, int], ...], unit: Unit | None, written: Written
    ) -> Value | None:
        """Return a written value as its target takes it: in its type and unit, transformed; None for a problem."""
        text, transformation, place = written.text, written.transformation, written.place
        if transformation is not None and (misfit := transformation.misfit(type_)):
            self.problems.add(f"{name}: {misfit}", transformation.place)
            return None
        known = items
        if transformation is not None and transformation.kind == "enumeration":
            text = transformation.names.get(text.strip(), text)
        elif transformation is not None and transformation.kind == "integer" and written.type == "Integer":
            known = ()  # the numbers of the set need not be items
        value = self._parse(name, type_ if known is items else "Integer", known, text, written.type, place)
        if value is None:
            return None
        if family(type_) == "Real":
            own = None if written.suppress_unit_conversion else written.unit
            try:
                value = conversion(own, unit)(float(value))
            except UnitMismatchError as mismatch:
                self.problems.add(
                    f"{name} = {text} [{own.name if own else ''}] for a variable in"
                    f" {unit.name if unit else 'no unit'}: {mismatch}",
                    place,
                )
                return None
            return value if transformation is None else transformation.affine(value)
        if transformation is None or transformation.kind == "enumeration":
            return value
        table = tabulate(
            transformation, ("Integer" if known is not items else type_, known), (type_, items), self.problems
        )
        moved = value if table is None else table(int(value))
        if moved is None:
            self.problems.add(f"{name} = {text} has no entry in the mapping", place)
            return None
        return bool(moved) if type_ == "Boolean" else moved

    def _forward(self, port: Port, written: Written) -> None:
        """Give a value to a system connector: it becomes the start value of every component variable behind it."""
        if port.kind not in GIVING:
            self._backward(port, written)
            return
        place = written.place
        links = [
            (key, link)
            for key, link in sorted(self.wiring.links.items())
            if any(e.source.key == port.key for e in link.edges)
        ]
        behind = [e.target for _, link in links for e in link.edges]
        type_ = port.type or next((p.type for p in behind if p.type), "Real")
        items = port.items or next((p.items for p in behind if p.items), ())
        name = full_name(port.key)
        value = self._value(name, type_, items, port.unit, written)
        if value is None:
            return
        self.connectors[port.key] = number_of(value) if isinstance(value, str) else float(value)
        for key, link in links:
            first = next(i for i, edge in enumerate(link.edges) if edge.source.key == port.key)
            variable = link.edges[-1].target.variable
            converted = convert_along(link.edges[first:], self.problems, port.unit or written.unit)
            if variable is not None and converted is not None:
                own = dataclasses.replace(place, component=key[0])
                label = f"{name} → {full_name(key)}"
                inner = value if isinstance(value, str) else self._converted(converted, value, variable, label, own)
                self._set_variable(key, variable, inner, own)

    def _backward(self, port: Port, written: Written) -> None:
        """Give a value to a connector that a component feeds: it becomes the start value of the output."""
        link = self.wiring.links.get(port.key)
        variable = None if link is None else link.source.variable
        name = full_name(port.key)
        if link is None or variable is None or not variable.settable:
            self.problems.add(f"{name} cannot be set: no settable variable feeds it", written.place)
            return
        type_, items = port.type or variable.type, port.items or variable.items
        value = self._value(name, type_, items, port.unit, written)
        if value is None or isinstance(value, str):
            self._set_variable(link.source.key, variable, value, written.place)
            return
        before: Value = link.conversion.inverse(value)
        if family(type_) != "Real":
            before = int(before)
        place = dataclasses.replace(written.place, component=link.source.key[0])
        self._set_variable(link.source.key, variable, bool(before) if type_ == "Boolean" else before, place)

    def _converted(
        self, convert: Conversion, value: Value, variable: Variable, label: str, place: Place
    ) -> Value | None:
        """Return a number after a connection, as the variable's type takes it."""
        moved = convert(float(value))
        if moved is None:
            self.problems.add(f"{label}: {value} is no item of the enumeration, and not mapped", place)
            return None
        if family(variable.type) == "Real":
            return moved
        return bool(moved) if variable.type == "Boolean" else int(moved)

    def _parse(
        self,
        name: str,
        target: str,
        items: tuple[tuple[str, int], ...],
        text: str,
        type_: str | None,
        place: Place,
    ) -> Value | None:
        """Return `text` as a value of the target's type; `type_` is the type it was written in, None for the caller's
        values.
        """
        kinds = (None if type_ is None else family(type_), family(target))
        fits = type_ is None or kinds[0] == kinds[1] or kinds in _ALSO_FITS
        value = parse_value(text, target, items) if fits else None
        if value is None:
            self.problems.add(
                f"{name} = {text!r} must be {rule(target)}" + (f", not {type_}" if not fits else ""), place
            )
        return value

    def check_connected(self) -> None:
        """Report the caller's values for what a component or a given connector feeds: they would have no effect.

        Those of the system's description may stay: where an initial value is sought, they are where it begins.
        """
        for key, place in self.callers.items():
            link, port = self.wiring.links.get(key), self.wiring.ports.get(key)
            if link is None or port is None:
                continue
            source = link.source.variable
            if port.kind in ("parameter", "structuralParameter") and (
                source is None or source.variability == "constant"
            ):
                continue  # what is given last counts
            if source is not None or link.source.key in self.connectors:
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
            if family(variable.type) != "Real" and bound is not None and bound.is_integer():
                bound = int(bound)
            problems.append(f"{variable.name} = {value}{unit} must be {word} {bound}{unit}")
    return problems


_ALSO_FITS = {("Integer", "Real"), ("Integer", "Enumeration"), ("String", "Enumeration")}


def parse_value(text: str, type_: str, items: tuple[tuple[str, int], ...] = ()) -> Value | None:
    """Return `text` as a value of an FMI type, None when it is none; reals must be finite, whole numbers fit the type.

    A Float32 is the nearest number of 32 bits.
    """
    if type_ == "String":
        return text
    text, kind = text.strip(), family(type_)
    if kind in ("Real", "Integer") and "_" in text:
        return None
    try:
        if kind == "Real":
            real = to_float32(float(text)) if type_ == "Float32" else float(text)
            return real if math.isfinite(real) else None
        if kind == "Integer":
            integer = int(text) if not any(c in text for c in ".eE") else float(text)
            least, most = TYPES[type_].minimum, TYPES[type_].maximum
            return int(integer) if integer == int(integer) and least <= integer <= most else None
        if kind == "Enumeration":
            values = dict(items)
            number = values[text] if text in values else int(text)
            return number if number in values.values() else None
    except (ValueError, OverflowError):
        return None
    return {"true": True, "1": True, "1.0": True, "false": False, "0": False, "0.0": False}.get(text.lower())
