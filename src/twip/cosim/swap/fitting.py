"""Fits one FMU to a component that was made for another one: gives it the system's names, and tells what differs.

An array connector is one port: the FMU's array has its shape, and every element fits.
"""

import dataclasses
import math
from collections.abc import Iterable, Mapping

from ..model.fmu import Fmu
from ..reading.problems import Problems
from ..reading.wording import nearest
from ..ssp.arrays import MAXIMUM_SIZE
from ..ssp.structure import ComponentElement, Connector, SystemElement, system_around
from ..values.shapes import Shape, indices, shape_text
from ..values.types import canonical, family
from ..values.units import Unit, UnitMismatchError, conversion, lookup
from ..values.variable import Variable
from .swap_map import SwapMap


class Fitting:
    """Fits one FMU."""

    def __init__(
        self,
        top: SystemElement,
        path: str,
        element: ComponentElement,
        old: Fmu | None,
        new: Fmu,
        swap_map: SwapMap,
        problems: Problems,
    ):
        self.path = path
        self.element = element
        self.old = old
        self.new = new
        self.map = swap_map
        self.problems = problems
        self.system = system_around(top, element)
        self._back = {own: name for name, own in swap_map.names.items()}

    def fit(self) -> Fmu | None:
        """Return the FMU with the system's names, and leave the connectors that it has; None when it does not fit."""
        checking = self.problems.checking()
        self._ignore()
        variables = self._renamed()
        new = dataclasses.replace(self.new, variables=variables)
        kept = [c for connector in self.element.connectors if (c := self._fitted(connector, new)) is not None]
        lacking = [c.name for c in self.element.connectors if c.name not in {k.name for k in kept}]
        if checking.failed:
            return None
        if lacking:
            self._warn(f"{self.new.name} lacks what nothing is connected to: {', '.join(lacking)}")
        self._tell_new_inputs(variables, {c.name for c in kept})
        self.element.connectors[:] = kept
        sets = {inputs: frozenset(map(self._name, inputs)) for inputs in set(self.new.feedthrough.values())}
        feedthrough = {self._name(output): sets[inputs] for output, inputs in self.new.feedthrough.items()}
        known = {} if self.old is None else self.old.units  # what the description says is in these
        document = self.element.document
        self.element.document = dataclasses.replace(document, units={**known, **document.units})
        return dataclasses.replace(new, feedthrough=feedthrough, units={**self.new.units, **known})

    def _refuse(self, text: str, connector: Connector | None = None) -> None:
        self.problems.add(f"swap {self.path}: {text}", (connector or self.element).place)

    def _warn(self, text: str) -> None:
        self.problems.warn(f"swap {self.path}: {text}")

    def _name(self, own: str) -> str:
        """Return the system's name of a variable; an array is renamed with all its elements."""
        array, index = _split(own)
        return self._back[own] if own in self._back else self._back.get(array, array) + index

    def _known(self) -> set[str]:
        """Return the names that the system has for variables of the component."""
        return {c.name for c in self.element.connectors} | (set() if self.old is None else _names(self.old))

    def _renamed(self) -> dict[str, Variable]:
        """Return the FMU's variables by the system's names, with the units of the map."""
        there, known = _names(self.new), self._known()
        for name, own in self.map.names.items():
            if own not in there:
                self._refuse(f"{self.new.name} has no variable {own}{_hint(own, there)}, which the map names")
            if name not in known:
                self._refuse(f"the system has no {self.path}.{name}{_hint(name, known)}, which the map names")
        units: dict[str, Unit | None] = {}
        for own, named in self.map.units.items():
            if own not in there:
                self._refuse(f"{self.new.name} has no variable {own}{_hint(own, there)}, which the map names")
            definitions = ({} if self.old is None else self.old.units, self.element.document.units)
            units[own] = lookup(named, self.new.units, *definitions)
            if units[own] == Unit(named):
                self._refuse(f"unit {named} of {own} in the map is not defined")
        variables: dict[str, Variable] = {}
        for variable in self.new.variables.values():
            name = self._name(variable.name)
            if name in variables:
                self._refuse(f"{name} is the name of another variable of {self.new.name}: the map must name that too")
            unit = units.get(variable.name, units.get(_split(variable.name)[0], variable.unit))
            array, alias_of = (None if own is None else self._name(own) for own in (variable.array, variable.alias_of))
            variables[name] = dataclasses.replace(variable, name=name, unit=unit, array=array, alias_of=alias_of)
        return variables

    def _ignore(self) -> None:
        """Remove the connections to what the new FMU does without."""
        connectors = {c.name: c for c in self.element.connectors}
        for name in self.map.ignore:
            connector = connectors.get(name)
            if connector is None:
                self._refuse(f"the system has no {self.path}.{name}{_hint(name, connectors)}, which the map ignores")
            elif connector.kind == "output":
                self._refuse(f"{name} is an output and cannot be ignored", connector)
            end = (self.element.name, name)
            self.system.connections[:] = [c for c in self.system.connections if end not in (c.start, c.end)]

    def _partners(self, name: str) -> list[str]:
        """Return what is connected to a connector."""
        end = (self.element.name, name)
        others = [c.end if c.start == end else c.start for c in self.system.connections if end in (c.start, c.end)]
        return [f"{element}.{other}" if element else other for element, other in others]

    def _fitted(self, connector: Connector, new: Fmu) -> Connector | None:
        """Return the connector as the new FMU has it; None when it has none, a problem if that is used."""
        name, partners = connector.name, self._partners(connector.name)
        shape, misfit = self._shape(connector, new)
        for element in () if misfit else (name + index for index in indices(shape)):
            variable = new.variables.get(element)
            old = None if self.old is None else self.old.variables.get(element)
            if misfit := self._misfit(connector, element, variable, old, new):
                break
            if partners and variable is not None:
                self._tell_differences(connector, variable, old)
        if misfit:
            if partners:
                used = f", which {', '.join(partners)} {'takes' if connector.kind == 'output' else 'feeds'}"
                self._refuse(misfit + used, connector)
            return None
        first = None if self.old is None else self.old.variables.get(name + indices(shape)[0])
        if connector.type.unit or first is None or first.unit is None or family(first.type) != "Real":
            return connector
        return dataclasses.replace(connector, type=dataclasses.replace(connector.type, unit=first.unit.name))

    def _shape(self, connector: Connector, new: Fmu) -> tuple[Shape, str]:
        """Return the shape of a connector, and why the new FMU's variable has another one, or nothing."""
        name, sizes = connector.name, [dimension.size for dimension in connector.dimensions]
        if not sizes:
            return (), ""
        there = new.shapes.get((name, len(sizes)))
        if there is None:
            return (), f"{self.new.name} has no {connector.kind} array {name}{_hint(name, _names(new))}"
        if math.prod(there) > MAXIMUM_SIZE:
            return (), f"{name} has more than {MAXIMUM_SIZE} elements in {self.new.name}"
        before = there if self.old is None else self.old.shapes.get((name, len(sizes)), there)
        shape = tuple(n if n is not None else m for n, m in zip(sizes, before, strict=True))
        wrong = f"{name} is {shape_text(there)} in {self.new.name}, {shape_text(shape)} in the system"
        return there, "" if shape == there else wrong

    def _misfit(
        self, connector: Connector, name: str, variable: Variable | None, old: Variable | None, new: Fmu
    ) -> str:
        """Return why a variable cannot take the place of the `old` one, or nothing."""
        if variable is None or connector.kind not in variable.kinds:
            other = _hint(name, new.variables) if variable is None else f" (it is {variable.kinds[-1]} there)"
            return f"{self.new.name} has no {connector.kind} {name}{other}"
        type_ = connector.type.type or (None if old is None else canonical(old.type))
        if type_ is not None and canonical(variable.type) != type_:
            return f"{name} is {variable.type} in {self.new.name}, not {type_}"
        unit = self._unit(connector, old)
        try:
            conversion(unit, variable.unit)
        except UnitMismatchError as mismatch:
            have, want = (u.name if u else "no unit" for u in (variable.unit, unit))
            return f"{name} is in {have} in {self.new.name}, in {want} in the system: {mismatch}"
        offset = conversion(unit, variable.unit) != conversion(unit, variable.unit, relative=True)
        if old is not None and old.relative != variable.relative and offset:
            return f"{self._difference(connector, variable)}, and the units have offsets"
        return ""

    def _difference(self, connector: Connector, variable: Variable) -> str:
        """Return that a variable is a difference (`relativeQuantity`) in one of two FMUs only."""
        names = (f"in {self.new.name}", "in the system")
        one, other = names if variable.relative else names[::-1]
        return f"{connector.name} is a difference (relativeQuantity) {one}, not {other}"

    def _unit(self, connector: Connector, old: Variable | None) -> Unit | None:
        """Return the unit of the values that pass a connector, as the system knows it."""
        if connector.type.unit:
            definitions = {} if self.old is None else self.old.units
            return lookup(connector.type.unit, self.element.document.units, definitions)
        return None if old is None else old.unit

    def _tell_differences(self, connector: Connector, variable: Variable, old: Variable | None) -> None:
        """Warn of what differs and does not keep a connected variable from its place."""
        unit = self._unit(connector, old)
        if unit is not None and variable.unit is None:
            self._warn(f"{connector.name} has no unit in {self.new.name}, it is taken to be in {unit.name}")
        if old is None:
            return
        if old.relative != variable.relative:
            self._warn(self._difference(connector, variable))
        if dict(old.items) != dict(variable.items):
            self._warn(f"{connector.name} has other items in {self.new.name}: numbers mean what they mean there")
        self._tell_bounds(connector, old, variable)

    def _tell_bounds(self, connector: Connector, old: Variable, new: Variable) -> None:
        """Warn of an input that allows less than before, and of an output that may give more."""
        try:
            convert = conversion(old.unit, new.unit, new.relative)
        except UnitMismatchError:  # the connector's unit fits
            return
        takes = new.causality == "input"
        for word, was, now, sign in (
            ("least", old.minimum, new.minimum, 1.0),
            ("most", old.maximum, new.maximum, -1.0),
        ):
            if now is None or (was is None and not takes):
                continue
            before = None if was is None else convert(was)
            if before is None or (sign * (now - before) > 0.0 if takes else sign * (before - now) > 0.0):
                said = "not bounded" if before is None else f"at {word} {before:g}"
                unit = f" {new.unit.name}" if new.unit else ""
                self._warn(f"{connector.name} is at {word} {now:g}{unit} in {self.new.name}, {said} before")

    def _tell_new_inputs(self, variables: Mapping[str, Variable], connected: set[str]) -> None:
        before = connected if self.old is None else connected | {v.name for v in self.old.ports("input")}
        starts: dict[str, list[str]] = {}
        for name, variable in variables.items():
            fed = name in before or _split(name)[0] in connected
            if variable.causality == "input" and variable.alias_of is None and not fed:
                starts.setdefault(variable.array or name, []).append(
                    "unknown" if variable.start is None else variable.start
                )
        if starts:
            more = ", ".join(f"{name} = {' '.join(s[:3])}{' …' * (len(s) > 3)}" for name, s in starts.items())
            self._warn(f"nothing feeds the inputs that are new with {self.new.name}, they keep {more}")


def _split(name: str) -> tuple[str, str]:
    """Return the name of an array and the index of its element, the name itself and nothing for anything else."""
    array, bracket, index = name.rpartition("[") if name.endswith("]") else (name, "", "")
    return array, bracket + index


def _names(fmu: Fmu) -> set[str]:
    """Return the names of an FMU's variables, of arrays and of their elements."""
    return set(fmu.variables) | {array for array, _ in fmu.shapes}


def _hint(name: str, known: Iterable[str]) -> str:
    close = nearest(name, sorted(known))
    return f" (there is {close[0]})" if close else ""
