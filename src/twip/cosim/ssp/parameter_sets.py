"""Applies a parameter set to a component or system, with the units of its file and through a parameter mapping."""

import dataclasses

from ..reading.problems import Place, Problems
from ..reading.wording import some_of
from ..values.names import Key, full_name
from ..values.shapes import shape_text
from ..values.types import family
from ..values.units import Unit, lookup
from ..values.variable import Variable
from ..values.written import Written
from .links import Port
from .parameters import Assignments, Scope
from .ssm import MappingEntry, ParameterMapping
from .ssv import Parameter, ParameterSet


def apply_set(
    assignments: Assignments, parameters: ParameterSet, scope: Scope, mapping: ParameterMapping | None = None
) -> None:
    """Apply a parameter set; with a mapping, only what it names."""
    _Application(assignments, parameters, scope).apply(mapping)


class _Application:
    """Applies one set, and collects what is warned of for all of it."""

    def __init__(self, assignments: Assignments, parameters: ParameterSet, scope: Scope):
        self.assignments = assignments
        self.problems: Problems = assignments.problems
        self.parameters = parameters
        self.scope = scope
        self._missing: dict[str, Place] = {}
        self._bare: dict[str, Place] = {}
        self._misshapen: dict[str, bool] = {}

    def apply(self, mapping: ParameterMapping | None) -> None:
        names = {self.scope.prefix + parameter.name for parameter in self.parameters.parameters}
        entries: dict[str, list[MappingEntry | None]] = {}
        for item in () if mapping is None else mapping.entries:
            entries.setdefault(item.source, []).append(item)
            if item.source not in names:
                self.problems.warn(f"the parameter set has no {item.source} to map", item.place)
        for parameter in self.parameters.parameters:
            name = self.scope.prefix + parameter.name
            for entry in [None] if mapping is None else entries.get(name, []):
                self._apply(parameter, name if entry is None else entry.target, entry)
        one = len(self._missing) == 1
        self._warn(f"unknown parameter{'' if one else 's'} {{}} {'is' if one else 'are'} ignored", self._missing)
        self._warn("a variable without unit takes the value as it is: {}", self._bare)

    def _warn(self, text: str, found: dict[str, Place]) -> None:
        if found:
            names = list(found)
            self.problems.warn(text.format(some_of(names)), self._own(found[names[0]]))

    def _own(self, place: Place) -> Place:
        path = self.scope.path
        return dataclasses.replace(place, component=path if path in self.assignments.fmus else None)

    def _apply(self, parameter: Parameter, target: str, entry: MappingEntry | None) -> None:
        """Apply a parameter or an element of one to what is called `target`."""
        scope, place, name = self.scope, parameter.place, target + parameter.index
        if target not in self._misshapen:
            self._misshapen[target] = self._refuse_shape(parameter, target)
        if self._misshapen[target]:
            return
        matches = self.assignments.find(scope, name, place)
        for key, found in matches:
            if scope.from_caller:
                self.assignments.callers[key] = place
            before = None if scope.from_caller else self.assignments.before.get(key)
            written = Written(parameter.text, parameter.type, self._unit(parameter, key, before), place)
            if entry is not None:
                written = dataclasses.replace(
                    written,
                    transformation=entry.transformation,
                    suppress_unit_conversion=entry.suppress_unit_conversion,
                )
            self._note_bare(key, found, written)
            self.assignments.assign(key, found, written, before)
        if not matches and not scope.from_caller and not self.assignments.is_unreadable(scope, name):
            self._missing.setdefault(name, place)

    def _unit(self, parameter: Parameter, key: Key, before: Variable | None) -> Unit | None:
        """Return the unit that a value is in: as written, else that of the variable it was written for."""
        unit = lookup(parameter.unit, self.parameters.units, self.scope.units)
        if unit is None and before is not None:
            unit = before.unit
        if unit is not None and unit.exponents is None and key[0] in self.assignments.fmus:
            unit = lookup(unit.name, self.assignments.fmus[key[0]].units)
        return unit

    def _note_bare(self, key: Key, target: Variable | Port, written: Written) -> None:
        """Remember a value that has a unit where its variable has none."""
        if written.unit is None or written.suppress_unit_conversion or isinstance(target, Port):
            return
        if family(target.type) == "Real" and self.assignments.unit_of(key, target) is None:
            self._bare.setdefault(f"{full_name(key)} [{written.unit.name}]", written.place)

    def _refuse_shape(self, parameter: Parameter, name: str) -> bool:
        """Tell whether what is called `name` has another shape than the parameter, which is a problem."""
        whole = f"{self.scope.path}.{name}" if self.scope.path else name
        there = self.assignments.shapes.get(whole, parameter.shape)
        if there == parameter.shape:
            return False
        text = f"parameter {parameter.name} is {shape_text(parameter.shape)}, but {whole} is {shape_text(there)}"
        self.problems.add(text, parameter.place)
        return True
