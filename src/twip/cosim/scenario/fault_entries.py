"""Reads the faults of a scenario file, and checks them against the steps of the components they lead to."""

import math
from collections.abc import Mapping

from ..coupling.coupling import Coupling
from ..model.signals import Signal
from ..model.system import System
from ..reading.problems import Place, Problems
from ..reading.toml import shown
from ..reading.wording import did_you_mean
from ..values.conversion import Conversion
from ..values.transformation import Items
from ..values.types import family
from ..values.written import cannot_travel, in_vector
from .faults import kinds
from .faults.base import Amount, Fault, Key
from .plan import Scenario, point_of
from .scenario_entries import Entries, typed
from .targets import RULES, End, objections, signal_type

MOST_STEPS = 10_000_000
"""Longest delay; each step of it is kept in memory."""
_DIVIDES = 1e-9
"""Relative deviation of a time from a whole number of steps that counts as rounding."""

Targets = tuple[tuple[int, Conversion], ...]
"""Columns that failing connections lead to, and the conversions to them, as in `Fault`."""


class FaultEntries(Entries):
    """Reads `[[faults]]`."""

    def read(self, index: int, entry: Mapping[str, object], driven: set[int]) -> Fault | None:
        """Return the fault that `faults[index]` describes; `driven` are the columns with time series."""
        checking, label = self.problems.checking(), f"faults[{index}]"
        kind = kinds().get(given) if isinstance(given := entry.get("kind"), str) else None
        if kind is None:
            self.required(entry, ("kind",), "faults", index)
            if "kind" in entry:
                place = self.file.place("faults", index, "kind")
                self.problems.add(f"{label}.kind = {shown(given)}", place, rule=f"must be one of {', '.join(kinds())}")
            return None
        seeded = ("seed",) if kind.seeded else ()
        known = {"signal", "kind", "start", "stop", *(key.name for key in kind.keys), *seeded}
        self.known(entry, known, "faults", index)
        self.required(entry, ("signal", *(key.name for key in kind.keys if key.required)), "faults", index)
        times = tuple(self.time(entry, end, "faults", index) if end in entry else None for end in ("start", "stop"))
        seed = entry.get("seed", 0)
        if isinstance(seed, bool) or not isinstance(seed, int):
            self.problems.add(f"{label}.seed = {shown(seed)}", self._at(index, "seed"), rule="must be a whole number")
        if "signal" not in entry:
            return None
        column, targets = self._connections(label, entry["signal"], driven, self._at(index, "signal"))
        amounts = self._amounts(index, kind, entry, column, targets) if targets else {}
        first, last = self._interval(label, times[0], times[1], self._at(index, "start"))
        if self.grid is None or checking.failed or not isinstance(seed, int):
            return None
        at = self._at(index, "signal")
        return kind(label, self.names[column], targets, (times[0], times[1]), first, last, amounts, seed, at)

    def _signal(self, column: int) -> Signal:
        return [signal for channel in self.system.channels for signal in channel.signals][column]

    def _at(self, index: int, key: str) -> Place:
        return self.file.place("faults", index, key)

    def _connections(self, label: str, name: object, driven: set[int], place: Place) -> tuple[int, Targets]:
        """Return the column called `name` and the connections from it or the one to it; none on a problem."""
        copies = self.system.copies
        carrying = {c.source for c in copies} | {i for c in self.system.components for i in self._inputs_of(c.name)}
        if not isinstance(name, str) or name not in self.names:
            known = [self.names[i] for i in sorted(carrying)]
            self.problems.add(f"{label}: there is no signal {name}{did_you_mean(str(name), known)}", place)
            return 0, ()
        column = self.names.index(name)
        opened = {connector.column for connector in self.system.open_connectors}
        leaving = [c for c in copies if c.source == column]
        beginning = next((c.source for c in copies if c.destination == column), column)
        if beginning in opened and beginning not in driven:
            carry = "connections carry" if beginning == column else f"connection to {name} carries"
            text = f"{label}: no time series drives {self.names[beginning]}, its {carry} nothing"
            self.problems.add(text, place)
        elif leaving:
            return column, tuple((c.destination, c.conversion) for c in leaving)
        elif column not in carrying and any(c.destination == column for c in copies):
            self.problems.add(f"{label}: {name} is a connector: name the output or the input behind it", place)
        elif not any(c.destination == column for c in copies):
            self.problems.add(f"{label}: {name} is not connected", place)
        else:
            return column, ((column, Conversion()),)
        return column, ()

    def _inputs_of(self, component: str) -> range:
        first = self.system.first_column[component]
        return range(first, first + next(len(c.inputs) for c in self.system.components if c.name == component))

    def _amounts(
        self, index: int, kind: type[Fault], entry: Mapping[str, object], column: int, targets: Targets
    ) -> dict[str, Amount]:
        """Return what the entry gives under the keys of its kind of fault, for the signal in `column`."""
        type_, items = signal_type(self.system, column)
        if why := kind.objection(type_):
            place = self._at(index, kind.keys[0].name if kind.keys else "kind")
            self.problems.add(f"faults[{index}]: {why}", place)
            return {}
        found: dict[str, Amount] = {}
        for key in kind.keys:
            unit = (self._signal(column).unit or "") if key.unit is None else key.unit
            if key.name not in entry:
                if key.default is not None:
                    found[key.name] = Amount(key.default, f"{key.default!r} {unit}".rstrip())
                continue
            given, label = entry[key.name], f"faults[{index}].{key.name}"
            size = self._number(label, key, given, type_, items, self._at(index, key.name))
            if size is None:
                continue
            text, steps = f"{size!r} {unit}".rstrip(), 0
            if key.steps:
                steps = self._steps(label, size, self._at(index, key.name))
            if key.of_signal and type_ in ("String", "Enumeration"):
                text = next((item for item, number in items if number == size), shown(given))
            if key.of_signal and type_ != "String":
                number = size if family(type_) == "Real" else int(size)
                self.problems.take(objections(label, number, self._ends(column, targets)), self._at(index, key.name))
            found[key.name] = Amount(size, text, steps)
        return found

    def _ends(self, column: int, targets: Targets) -> list[End]:
        variables = self.system.variables
        return [
            End(self.names[c], variables[c], None if c == column else convert)
            for c, convert in targets
            if c in variables
        ]

    def _number(self, label: str, key: Key, given: object, type_: str, items: Items, place: Place) -> float | None:
        """Return the number of a key, None on a problem; `type_` is that of the signal."""
        value = typed(given, type_ if key.of_signal else "Real", items)
        size = None if value is None else in_vector(value)
        if key.of_signal and value is not None and (why := cannot_travel(type_, value)):
            self.problems.add(f"{label}: {shown(given)} cannot be taken, {why}", place)
            return None
        too_small = size is not None and key.above is not None and size <= key.above
        too_large = size is not None and key.most is not None and size > key.most
        if size is None or too_small or too_large:
            rule = RULES[type_] if key.of_signal else key.rule
            self.problems.add(f"{label} = {shown(given)}", place, rule=f"must be {rule}")
            return None
        return size

    def _steps(self, label: str, time: float, place: Place) -> int:
        """Return a time in s as a number of steps."""
        grid = self.grid
        if grid is None:
            return 0
        steps = time / grid.step_size
        if steps > MOST_STEPS:
            self.problems.add(f"{label} = {time!r} s is more than {MOST_STEPS} steps", place)
            return 0
        if not math.isclose(steps, round(steps), rel_tol=_DIVIDES):
            text = f"{label} = {time!r} s must be a whole multiple of the step, {grid.step_size!r} s"
            self.problems.add(text, place)
        return round(steps)

    def _interval(self, label: str, start: float | None, stop: float | None, place: Place) -> tuple[int, int]:
        """Return the first step of a fault and the one after its last; nothing of use where times are wrong."""
        if self.grid is None:
            return 0, 0
        first = 0 if start is None else point_of(start, self.grid)
        last = self.grid.steps if stop is None else point_of(stop, self.grid)
        if stop is not None and stop <= (self.grid.start if start is None else start):
            begin = f"start time of the run, {self.grid.start:g} s" if start is None else f"start, {start:g} s"
            self.problems.add(f"{label}.stop = {stop:g} s", place, rule=f"must be later than the {begin}")
        elif start is not None and start >= self.grid.stop:
            self.warnings.append(f"{label}: {start:g} s is not before the stop time, the fault does not occur")
        elif first == last:
            self.problems.add(f"{label} begins and ends between two communication points, it would do nothing", place)
        return first, last


def check_own_steps(system: System, coupling: Coupling, scenario: Scenario, problems: Problems) -> None:
    """Add a problem for each fault that cannot do what it says because of the steps of the components it leads to."""
    multiples = dict(coupling.own_steps)
    owner = {
        column: component.name
        for component in system.components
        for column, _ in enumerate(component.inputs, system.first_column[component.name])
    }
    for fault in scenario.faults:
        for component in dict.fromkeys(owner[column] for column, _ in fault.targets if column in owner):
            multiple = multiples.get(component, 1)
            first = -(-(fault.first + 1) // multiple) * multiple - 1
            if fault.first < fault.last <= first:
                text = f"{fault.name} begins and ends between two steps of {component}, it would do nothing there"
                problems.add(text, fault.place)
            for key, amount in fault.amounts.items():
                if amount.steps % multiple:
                    text = f"{fault.name}.{key} = {amount} must be a whole multiple of the step of {component}"
                    problems.add(f"{text}, {multiple} communication steps", fault.place)
