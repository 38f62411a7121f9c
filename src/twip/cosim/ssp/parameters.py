"""Start values and parameters: from bindings, parameter files and the caller to the variables of the FMUs.

A name stands for every variable and connector of that hierarchical name (SSP 1.0 section 5.2.3). What a binding of the
description names and nobody has is ignored, with a warning; what the caller names must be there.
"""

import copy
import dataclasses
from collections.abc import Mapping, Set
from dataclasses import dataclass, field
from functools import cached_property

from ..model.fmu import Fmu
from ..reading.problems import Place, Problems
from ..reading.wording import did_you_mean, some_of
from ..values.names import Key, full_name
from ..values.shapes import Shape, shapes_of
from ..values.units import Unit
from ..values.variable import Variable
from ..values.written import Value, Written, parse_value
from .assigned import Assigned
from .duplicate_paths import DuplicatePaths
from .links import Port


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


@dataclass(kw_only=True)
class Assignments(Assigned):
    """Finds the targets of values by name."""

    fmus: Mapping[str, Fmu]
    before: Mapping[Key, Variable]
    """The variables that values in the system's description were written for, where others have taken their places."""
    duplicates: DuplicatePaths
    unreadable: Set[str] = frozenset()
    """Paths of the components whose FMU cannot be read: nobody knows their variables."""
    callers: dict[Key, Place] = field(default_factory=dict)
    """What the caller or a parameter file of the caller gives a value to."""
    unchecked: dict[str, None] = field(default_factory=dict)
    """Names of the caller's values for unreadable components."""

    def __post_init__(self) -> None:
        self._names: dict[str, list[tuple[Key, Variable | Port]]] = {}
        for path, fmu in self.fmus.items():
            for known in self.duplicates.names.get(path, (path,)):
                for variable in fmu.variables.values():
                    self._names.setdefault(f"{known}.{variable.name}", []).append(((path, variable.name), variable))
        for key, port in self.wiring.ports.items():
            if port.variable is None and not port.shared:
                for known in self.duplicates.names.get(key[0], (key[0],)):
                    self._names.setdefault(full_name((known, key[1])), []).append((key, port))

    def further(self, values: Mapping[str, Value]) -> "Assignments":
        """Return these with `values` by `component.variable` on top. Raises `TwipError` with one line per problem."""
        more = copy.copy(self)
        more.problems, more.callers = Problems(), {}
        more.variables, more.connectors = dict(self.variables), dict(self.connectors)
        more.apply_values(values)
        more.check()
        more.problems.raise_any()
        return more

    def check(self) -> None:
        """Report what is wrong with all values together."""
        self.check_connected()
        self.check_ranges()
        self.check_arrays()

    @cached_property
    def shapes(self) -> dict[str, Shape]:
        """Shapes by full name, of arrays and of what is none."""
        arrays = {name: shape for (name, _), shape in shapes_of(self._names).items()}
        return {**arrays, **dict.fromkeys(self._names, ())}

    def is_unreadable(self, scope: Scope, name: str) -> bool:
        """Tell whether a name may be that of a variable of an FMU that cannot be read."""
        whole = f"{scope.path}.{name}" if scope.path else name
        return any(whole.startswith(f"{path}.") for path in self.unreadable)

    def apply_values(self, values: Mapping[str, Value]) -> None:
        """Apply values by `component.variable`, in the variables' own units."""
        place = Place("start values")
        for name, value in values.items():
            for key, target in self.find(Scope("", "", {}, from_caller=True), name, place):
                self.callers[key] = place
                text = str(value).lower() if isinstance(value, bool) else str(value)
                self.assign(key, target, Written(text, None, None, place))

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
                self.set_variable(key, variable, value, place)
            else:
                moved = self.converted(link.conversion, value, variable, link.label, place)
                self.set_variable(key, variable, moved, place)

    def find(self, scope: Scope, name: str, place: Place) -> list[tuple[Key, Variable | Port]]:
        """Return what a name stands for; that the caller's is unknown is a problem."""
        path = scope.path
        matches = self._names.get(f"{path}.{name}" if path else name, [])
        if self.duplicates.around:
            matches = [match for match in matches if path in self.duplicates.around[match[0][0]]]
        if not matches and scope.from_caller and self.is_unreadable(scope, name):
            self.unchecked[name] = None
        elif not matches and scope.from_caller:
            self.problems.add(f"unknown parameter {name}{did_you_mean(name, self._names)}", place)
        return matches

    def check_arrays(self) -> None:
        """Report arrays that get a value for some elements while others have none: an FMU is given an array whole."""
        places = {(key[0], start.variable.array or ""): start.place for key, start in self.variables.items()}
        lacking: dict[Key, list[str]] = {}
        for path in {path for path, array in places if array}:
            for v in self.fmus[path].variables.values():
                key = (path, v.array or "")
                if v.array is None or key not in places or (path, v.name) in self.variables:
                    continue
                if v.start is None or parse_value(v.start, v.type, v.items) is None:
                    lacking.setdefault(key, []).append(v.name)
        for key, names in sorted(lacking.items()):
            text = (
                f"{key[1]} is set as a whole, but nothing gives {some_of(names)} a value: the FMU states no start value"
            )
            self.problems.add(text, places[key])

    def check_connected(self) -> None:
        """Report the caller's values for what a component or a given connector feeds: they would have no effect.

        Those of the system's description may stay: where an initial value is sought, they are where it begins.
        """
        for key, place in self.callers.items():
            link = self.wiring.links.get(key)
            if link is None:
                continue
            source = link.source.variable
            if link.edges[-1].target.kind in ("parameter", "structuralParameter") and (
                source is None or source.variability == "constant"
            ):
                continue  # what is given last counts
            if source is not None or link.source.key in self.connectors:
                self.problems.add(
                    f"{full_name(key)} is connected inside the system and cannot be given a start value", place
                )
