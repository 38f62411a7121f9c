"""Values that have found their target: variables of FMUs, and connectors of systems with all that is behind them."""

from dataclasses import dataclass, field, replace

from ..reading.problems import Place, Problems
from ..values.conversion import Conversion
from ..values.names import Key, full_name
from ..values.types import EXACT, family, misfit, to_float32
from ..values.units import Unit
from ..values.variable import Variable
from ..values.written import StartValue, Value, Written, cannot_travel, in_vector, out_of_range, take
from .kinds import GIVING, PARAMETERS
from .links import Port, convert_along
from .wiring import Wiring


@dataclass(kw_only=True)
class Assigned:
    """Values by target; a later one replaces an earlier one."""

    wiring: Wiring
    problems: Problems
    variables: dict[Key, StartValue] = field(default_factory=dict)
    connectors: dict[Key, float] = field(default_factory=dict)
    """Values given to system connectors, in the connector's unit."""
    postponed: list[tuple[Port, Written]] | None = field(default_factory=list)
    """Values for parameters of systems, which come after all bindings of the description; None from then on."""
    bound: dict[Key, Written] = field(default_factory=dict)
    """What a binding of the description gives a value to, and the last such value."""

    def of(self, path: str) -> tuple[StartValue, ...]:
        """Return the start values of the component at a dotted path."""
        return tuple(value for key, value in self.variables.items() if key[0] == path)

    def assign(self, key: Key, target: Variable | Port, written: Written, before: Variable | None = None) -> None:
        """Give a target what is written; `before` is the variable that it was written for, if another."""
        if self.postponed is not None:
            self.bound[key] = written
            if isinstance(target, Port) and target.kind in PARAMETERS:
                self.postponed.append((target, written))
                return
        if isinstance(target, Port):
            self._forward(target, written)
            return
        place = replace(written.place, component=key[0])
        written = replace(written, place=place)
        if target.obstacle:
            self.problems.add(f"{target.name} cannot be set: {target.obstacle}", place)
            return
        unit = self.unit_of(key, target)
        items = before.items if before is not None and before.items and target.items else target.items
        value = take(target.name, target.type, items, unit, written, self.problems, target.relative)
        if value is not None and dict(items) != dict(target.items):
            label = next(label for label, number in items if number == value)
            value = dict(target.items).get(label)
            if value is None:
                self.problems.add(f"{target.name} = {written.text!r}: the enumeration has no item {label} now", place)
        self.set_variable(key, target, value, place)

    def apply_connections(self) -> None:
        """Give what parameters of systems feed their values: a connection wins over bindings of what it leads to.

        Of several on one way the outermost that has a value counts.
        """
        postponed, self.postponed = self.postponed or [], None
        outer = {port.key for port, _ in postponed}
        for key, link in self.wiring.links.items():
            calculated = link.source.variable is not None and link.edges[-1].target.kind in PARAMETERS
            giving = (edge.source.key for edge in link.edges if edge.source.key in outer)
            source = link.source.key if calculated else next(giving, None)
            if source is not None and key in self.bound:
                self._tell_overridden(link.edges[-1].target, source)
        for port, written in sorted(postponed, key=lambda item: -self._depth(item[0])):
            self._forward(port, written)

    def _tell_overridden(self, target: Port, source: Key) -> None:
        written, name = self.bound[target.key], full_name(target.key)
        place = written.place if target.variable is None else replace(written.place, component=target.key[0])
        connection = f"{full_name(source)} → {name}"
        self.problems.warn(f"{name} = {written.text} is overridden by the connection {connection}", place)

    def _depth(self, port: Port) -> int:
        """Return the number of connections from the beginning of a value to a connector."""
        link = self.wiring.links.get(port.key)
        return 0 if link is None else len(link.edges)

    def unit_of(self, key: Key, variable: Variable) -> Unit | None:
        """Return the unit of a variable's values: its own, else that of its connector."""
        port = self.wiring.ports.get(key)
        return port.unit if variable.unit is None and port is not None else variable.unit

    def set_variable(self, key: Key, variable: Variable, value: Value | None, place: Place) -> None:
        """Give a variable a value of its own type and unit; None is a problem that has been told."""
        if value is None:
            return
        if not isinstance(value, str):
            value = to_float32(value) if variable.type == "Float32" else value
            travels = variable.causality in ("input", "output") or family(variable.type) == "Real"
            if (travels or abs(value) <= EXACT) and (why := misfit(variable.recorded_type, value)):
                self.problems.add(f"{variable.name} cannot be set: {value} is a value {why}", place)
                return
        self.variables[key] = StartValue(variable, value, place)

    def _forward(self, port: Port, written: Written) -> None:
        """Give a value to a system connector: it becomes the start value of every component variable behind it."""
        if port.kind not in GIVING:
            self._backward(port, written)
            return
        place = written.place
        links = self.wiring.through(port.key)
        behind = [e.target for _, link in links for e in link.edges]
        if port.key in self.wiring.severed and port.type is None:
            return  # its type is that of what it leads to
        declared, items = self.wiring.type_of(port)
        type_ = declared or "Real"
        name = full_name(port.key)
        relative = any(p.variable.relative for p in behind if p.variable is not None)
        value = take(name, type_, items, port.unit, written, self.problems, relative)
        if value is None:
            return
        if port.kind == "input" and (why := cannot_travel(type_, value)):
            self.problems.add(f"{name} cannot be set: {value} is a value {why}", place)
            return
        self.connectors[port.key] = in_vector(value)
        for key, link in links:
            first = next(i for i, edge in enumerate(link.edges) if edge.source.key == port.key)
            variable = link.edges[-1].target.variable
            converted = convert_along(link.edges[first:], self.problems, port.unit or written.unit)
            if variable is not None and converted is not None:
                own = replace(place, component=key[0])
                label = f"{name} → {full_name(key)}"
                inner = value if isinstance(value, str) else self.converted(converted, value, variable, label, own)
                self.set_variable(key, variable, inner, own)

    def _backward(self, port: Port, written: Written) -> None:
        """Give a value to a connector that a component feeds: it becomes the start value of the output."""
        link = self.wiring.links.get(port.key)
        if link is None and port.key in self.wiring.severed:
            return
        variable = None if link is None else link.source.variable
        name = full_name(port.key)
        if link is None or variable is None or not variable.settable:
            self.problems.add(f"{name} cannot be set: no settable variable feeds it", written.place)
            return
        type_, items = port.type or variable.type, port.items or variable.items
        value = take(name, type_, items, port.unit, written, self.problems, variable.relative)
        if value is None or isinstance(value, str):
            self.set_variable(link.source.key, variable, value, written.place)
            return
        before: Value = link.conversion.inverse(value)
        if family(type_) != "Real":
            before = int(before)
        place = replace(written.place, component=link.source.key[0])
        self.set_variable(link.source.key, variable, bool(before) if type_ == "Boolean" else before, place)

    def converted(
        self, convert: Conversion, value: Value, variable: Variable, label: str, place: Place
    ) -> Value | None:
        """Return a number after a connection, as the variable's type takes it."""
        moved = convert(value if isinstance(value, int) else float(value))
        if moved is None:
            self.problems.add(f"{label}: {value} is no item of the enumeration, and not mapped", place)
            return None
        if family(variable.type) == "Real":
            return moved
        return bool(moved) if variable.type == "Boolean" else int(moved)

    def check_ranges(self) -> None:
        """Report every value outside the bounds that the model description states."""
        for start in self.variables.values():
            for problem in out_of_range(start.variable, start.value):
                self.problems.add(problem, start.place)
