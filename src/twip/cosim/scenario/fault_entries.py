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
from ..values.ssp_types import family
from ..values.transformation import Items
from ..values.written import cannot_travel, in_vector
from .plan import Fault, Scenario, point_of
from .scenario_entries import Entries, typed
from .targets import RULES, End, objections, signal_type

FAULTS: dict[str, tuple[str, bool]] = {
    "stuck": ("value", False),
    "bias": ("value", True),
    "noise": ("deviation", True),
    "dropout": ("probability", False),
    "delay": ("delay", True),
}
"""Kinds of faults: the key that gives the size, and whether it must be there."""
LONGEST_DELAY = 10_000_000
"""In steps; each is kept in memory."""
_DIVIDES = 1e-9
"""Relative deviation of a delay from a whole number of steps that counts as rounding."""


class FaultEntries(Entries):
    """Reads `[[faults]]`."""

    def read(self, index: int, entry: Mapping[str, object], driven: set[int]) -> Fault | None:
        """Return the fault that `faults[index]` describes; `driven` are the columns with time series."""
        before, label = len(self.problems.lines), f"faults[{index}]"
        kind = entry.get("kind")
        if not isinstance(kind, str) or kind not in FAULTS:
            self.required(entry, ("kind",), "faults", index)
            if "kind" in entry:
                place = self.file.place("faults", index, "kind")
                self.problems.add(f"{label}.kind = {shown(kind)} must be one of {', '.join(FAULTS)}", place)
            return None
        key, needed = FAULTS[kind]
        seeded = kind in ("noise", "dropout")
        known = {"signal", "kind", "start", "stop", key, *(("seed",) if seeded else ())}
        self.known(entry, known, "faults", index)
        self.required(entry, ("signal", key) if needed else ("signal",), "faults", index)
        times = tuple(self.time(entry, end, "faults", index) if end in entry else None for end in ("start", "stop"))
        seed = entry.get("seed", 0)
        if isinstance(seed, bool) or not isinstance(seed, int):
            self.problems.add(f"{label}.seed = {shown(seed)} must be a whole number", self._at(index, "seed"))
        if "signal" not in entry:
            return None
        column, targets = self._connections(label, entry["signal"], driven, self._at(index, "signal"))
        type_, items = signal_type(self.system, column)
        size = self._size(label, kind, entry, type_, items, self._at(index, key)) if targets else None
        if kind == "stuck" and type_ != "String" and size is not None:
            variables = self.system.variables
            ends = [
                End(self.names[c], variables[c], None if c == column else convert)
                for c, convert in targets
                if c in variables
            ]
            number = size if family(type_) == "Real" else int(size)
            for line in objections(f"{label}.value", number, ends):
                self.problems.add(line, self._at(index, key))
        first, last = self._interval(label, times[0], times[1], self._at(index, "start"))
        if self.grid is None or len(self.problems.lines) > before or not isinstance(seed, int):
            return None
        unit = {"delay": "s", "dropout": ""}.get(kind, self._signal(column).unit or "")
        text = "" if size is None else f"{size!r} {unit}".rstrip()
        if kind == "stuck" and type_ in ("String", "Enumeration") and text:
            text = next((item for item, number in items if number == size), shown(entry[key]))
        delay = round(size / self.grid.step_size) if kind == "delay" and size is not None else 0
        signal = self.names[column]
        return Fault(
            label,
            signal,
            kind,
            text,
            size,
            seed,
            targets,
            (times[0], times[1]),
            first,
            last,
            delay,
            self._at(index, "signal"),
        )

    def _signal(self, column: int) -> Signal:
        return [signal for channel in self.system.channels for signal in channel.signals][column]

    def _at(self, index: int, key: str) -> Place:
        return self.file.place("faults", index, key)

    def _connections(
        self, label: str, name: object, driven: set[int], place: Place
    ) -> tuple[int, tuple[tuple[int, Conversion], ...]]:
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
            return column, tuple((c.destination, Conversion(c.conversion, c.mapping)) for c in leaving)
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

    def _size(
        self, label: str, kind: str, entry: Mapping[str, object], type_: str, items: Items, place: Place
    ) -> float | None:
        """Return the size of a fault of a signal of type `type_`."""
        key = FAULTS[kind][0]
        if kind == "delay" and type_ == "String":
            self.problems.add(f"{label}: a String cannot be delayed", place)
            return None
        if kind in ("bias", "noise") and family(type_) != "Real":
            self.problems.add(f"{label}: {kind} needs a Real signal, not {type_}", place)
            return None
        if key not in entry:
            return 1.0 if kind == "dropout" else None
        given = entry[key]
        value = typed(given, type_ if kind == "stuck" else "Real", items)
        size = None if value is None else in_vector(value)
        if kind == "stuck" and value is not None and (why := cannot_travel(type_, value)):
            self.problems.add(f"{label}.value: {shown(given)} cannot be taken, {why}", place)
            return None
        rule = {"stuck": RULES[type_], "dropout": "a probability above 0, at most 1"}.get(kind, RULES["Real"])
        if kind in ("noise", "delay"):
            rule = "a positive number"
        if (
            size is None
            or (kind in ("noise", "delay") and size <= 0.0)
            or (kind == "dropout" and not 0.0 < size <= 1.0)
        ):
            self.problems.add(f"{label}.{key} = {shown(given)} must be {rule}", place)
            return None
        if kind == "delay" and self.grid is not None:
            steps = size / self.grid.step_size
            if steps > LONGEST_DELAY:
                self.problems.add(f"{label}.delay = {size!r} s is more than {LONGEST_DELAY} steps", place)
            elif not math.isclose(steps, round(steps), rel_tol=_DIVIDES):
                self.problems.add(
                    f"{label}.delay = {size!r} s must be a whole multiple of the step, {self.grid.step_size!r} s", place
                )
        return size

    def _interval(self, label: str, start: float | None, stop: float | None, place: Place) -> tuple[int, int]:
        """Return the first step of a fault and the one after its last; nothing of use where times are wrong."""
        if self.grid is None:
            return 0, 0
        first = 0 if start is None else point_of(start, self.grid)
        last = self.grid.steps if stop is None else point_of(stop, self.grid)
        if stop is not None and stop <= (self.grid.start if start is None else start):
            begin = f"start time of the run, {self.grid.start:g} s" if start is None else f"start, {start:g} s"
            self.problems.add(f"{label}.stop = {stop:g} s must be later than the {begin}", place)
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
            if fault.delay % multiple:
                text = f"{fault.name}.delay = {fault.text} must be a whole multiple of the step of {component}"
                problems.add(f"{text}, {multiple} communication steps", fault.place)
