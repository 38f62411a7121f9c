"""Start values and parameters: from bindings, parameter files and the caller to the variables of the FMUs.

A name stands for every variable and connector of that hierarchical name (SSP 1.0 section 5.2.3). What a binding of the
description names and nobody has is ignored, with a warning; what the caller names must be there.
"""

import copy
import dataclasses
import difflib
from collections.abc import Mapping, Set
from dataclasses import dataclass, field

from .arrays import shape_text, shapes_of
from .assigned import Assigned
from .fmu import Fmu, Variable
from .links import Key, Port, full_name
from .problems import Place, Problems
from .ssm import MappingEntry, ParameterMapping
from .ssv import Parameter, ParameterSet
from .units import Unit, lookup
from .values import Value, Written, parse_value

_NAMED = 10
"""Most names in one warning."""


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
    units: Mapping[Key, Unit]
    """Of values in the system's description that have none, where it is not that of the variable."""
    unreadable: Set[str] = frozenset()
    """Paths of the components whose FMU cannot be read: nobody knows their variables."""
    callers: dict[Key, Place] = field(default_factory=dict)
    """What the caller or a parameter file of the caller gives a value to."""
    unchecked: dict[str, None] = field(default_factory=dict)
    """Names of the caller's values for unreadable components."""

    def __post_init__(self) -> None:
        self._names: dict[str, list[tuple[Key, Variable | Port]]] = {}
        for path, fmu in self.fmus.items():
            for variable in fmu.variables.values():
                self._names.setdefault(f"{path}.{variable.name}", []).append(((path, variable.name), variable))
        for key, port in self.wiring.ports.items():
            if port.variable is None and not port.shared:
                self._names.setdefault(full_name(key), []).append((key, port))
        self._shapes = shapes_of(self._names)

    def continued(self, problems: Problems) -> "Assignments":
        """Return assignments that begin with these and may take more, with `problems` of their own."""
        more = copy.copy(self)
        more.problems, more.callers = problems, {}
        more.variables, more.connectors = dict(self.variables), dict(self.connectors)
        return more

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
                whole = name if entry is None else entry.target
                target = whole + parameter.index
                if self._differs(parameter, f"{scope.path}.{whole}" if scope.path else whole):
                    continue
                if not self._apply(parameter, parameters, scope, target, entry):
                    missing.append((target, parameter.place))
        if missing:
            self._warn_of_missing(missing, scope)

    def _differs(self, parameter: Parameter, name: str) -> bool:
        """Report a parameter that has not the sizes of the array called `name`."""
        shape = self._shapes.get(name)
        if shape is None or shape == parameter.shape or (name in self._names and not parameter.shape):
            return False
        self.problems.add(
            f"parameter {parameter.name} is {shape_text(parameter.shape)}, but {name} is {shape_text(shape)}",
            parameter.place,
        )
        return True

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
            if unit is not None and unit.exponents is None:
                self.problems.warn(f"unit {unit.name} has no definition in the file", place)
            if unit is None and not scope.from_caller:
                unit = self.units.get(key)
            if unit is not None and unit.exponents is None and key[0] in self.fmus:
                unit = lookup(unit.name, self.fmus[key[0]].units)
            written = Written(parameter.text, parameter.type, unit, place)
            if entry is not None:
                written = dataclasses.replace(
                    written,
                    transformation=entry.transformation,
                    suppress_unit_conversion=entry.suppress_unit_conversion,
                )
            self.assign(key, target, written)
        return bool(matches) or scope.from_caller or self._is_unreadable(scope, name)

    def _is_unreadable(self, scope: Scope, name: str) -> bool:
        """Tell whether a name may be that of a variable of an FMU that cannot be read."""
        whole = f"{scope.path}.{name}" if scope.path else name
        return any(whole.startswith(f"{path}.") for path in self.unreadable)

    def apply_values(self, values: Mapping[str, Value]) -> None:
        """Apply values by `component.variable`, in the variables' own units."""
        place = Place("start values")
        for name, value in values.items():
            for key, target in self._find(Scope("", "", {}, from_caller=True), name, place):
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

    def _find(self, scope: Scope, name: str, place: Place) -> list[tuple[Key, Variable | Port]]:
        path = scope.path
        matches = self._names.get(f"{path}.{name}" if path else name, [])
        if not matches and scope.from_caller and self._is_unreadable(scope, name):
            self.unchecked[name] = None
        elif not matches and scope.from_caller:
            close = difflib.get_close_matches(name, self._names, 1)
            self.problems.add(f"unknown parameter {name}" + (f", did you mean {close[0]}?" if close else ""), place)
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
            some = ", ".join(names[:_NAMED])
            text = f"{key[1]} is set as a whole, but nothing gives {some} a value: the FMU states no start value"
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
