"""Puts another FMU in the place of one that a system was made for, after its contract is checked.

The contract of a component is what the system uses of it: the connectors that something is connected to, by name,
causality, type and unit. The other FMU takes the system's names, so that connections, parameters, logs and scenarios
stay as they are; units are converted at its boundary. What it lacks and nobody uses is dropped; values that the
system's description gives to parameters it lacks are warned of, as for every FMU.
"""

import dataclasses
import difflib
import pathlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from .feedthrough import Output, evaluation_order
from .fmu import Fmu, Variable
from .fmus import read_fmus
from .links import Key
from .problems import Problems
from .structure import ComponentElement, Connector, SystemElement, systems_of
from .swap_map import SwapMap
from .units import Unit, UnitMismatchError, conversion, lookup
from .value_types import canonical, family
from .wiring import Wiring


@dataclass
class Swaps:
    """The swaps of a system."""

    top: SystemElement
    components: Mapping[str, ComponentElement]
    files: Mapping[str, pathlib.Path]
    """By component, what takes its place."""
    maps: Mapping[str, SwapMap]
    problems: Problems
    before: dict[str, Fmu] = field(default_factory=dict)
    """The FMUs that were there, as far as they can be read."""
    units: dict[Key, Unit] = field(default_factory=dict)
    """Units of the variables that were there: what values without a unit are in."""

    def __post_init__(self) -> None:
        for name in sorted(self.maps.keys() - self.files.keys()):
            self.problems.add(f"there is a map for {name}, which is not swapped")

    def fit(self, fmus: Mapping[str, Fmu | None], sources: dict[str, dict[str, str]]) -> dict[str, Fmu | None]:
        """Return the FMUs with the new ones fitted, None for what does not fit; `sources` gets an entry for each."""
        fitted = dict(fmus)
        for path in self.files:
            fmu, element = fmus.get(path), self.components.get(path)
            if fmu is None or element is None:
                continue
            old = read_fmus({path: element}, {}, Problems())[path]
            if old is None:
                self.problems.warn(
                    f"swap {path}: {element.source} cannot be read, only what the connectors say is checked"
                )
            else:
                self.before[path] = old
                self.units |= {(path, v.name): v.unit for v in old.variables.values() if v.unit is not None}
            swap_map = self.maps.get(path, SwapMap())
            fitted[path] = _Fitting(self, path, element, old, fmu, swap_map).fit()
            sources[f"swap {path}"] = {
                "fmu": fmu.name,
                "instead_of": element.source or "",
                **({} if old is None else {"instead_of_sha256": old.sha256}),
                **{f"name {name}": own for name, own in swap_map.names.items()},
                **{f"unit {name}": unit for name, unit in swap_map.units.items()},
                **({"ignored": ", ".join(swap_map.ignore)} if swap_map.ignore else {}),
            }
        return fitted

    def refuse_loops(self, wiring: Wiring, fmus: Mapping[str, Fmu | None]) -> None:
        """Report algebraic loops that were not there before."""
        now = {path: fmu.feedthrough for path, fmu in fmus.items() if fmu is not None}
        feeds = {key: link.source.key for key, link in wiring.links.items() if key[0] in now}
        was = {path: self.before[path].feedthrough if path in self.before else now[path] for path in now}
        known = {frozenset(loop) for loop in _loops(was, feeds)}
        for loop in _loops(now, feeds):
            inside = [
                p for p in self.files if any(p == c for c, _ in loop) and not self.maps.get(p, SwapMap()).allow_loop
            ]
            if inside and not any(set(loop) <= old for old in known):
                self.problems.add(
                    f"swap {', '.join(inside)}: feed-through closes an algebraic loop:"
                    f" {', '.join(f'{c}.{v}' for c, v in loop)} (allow_loop = true in its map accepts it)"
                )


def _loops(
    feedthrough: Mapping[str, Mapping[str, frozenset[str]]], feeds: Mapping[Key, Key]
) -> tuple[tuple[Output, ...], ...]:
    outputs = {(path, name) for path, own in feedthrough.items() for name in own}
    return evaluation_order(feedthrough, {key: source for key, source in feeds.items() if source in outputs}).loops


class _Fitting:
    """Fits one FMU."""

    def __init__(
        self, swaps: Swaps, path: str, element: ComponentElement, old: Fmu | None, new: Fmu, swap_map: SwapMap
    ):
        self.path = path
        self.element = element
        self.old = old
        self.new = new
        self.map = swap_map
        self.problems = swaps.problems
        above, _, self.name = path.rpartition(".")
        self.system = systems_of(swaps.top)[above]

    def fit(self) -> Fmu | None:
        """Return the FMU with the system's names, and leave the connectors that it has; None when it does not fit."""
        before = len(self.problems.lines)
        self._ignore()
        variables = self._renamed()
        kept = [c for connector in self.element.connectors if (c := self._fitted(connector, variables)) is not None]
        lacking = [c.name for c in self.element.connectors if c.name not in {k.name for k in kept}]
        if len(self.problems.lines) > before:
            return None
        if lacking:
            self._warn(f"{self.new.name} lacks what nothing is connected to: {', '.join(lacking)}")
        self._tell_new_inputs(variables, {c.name for c in kept})
        self.element.connectors[:] = kept
        back = {own: name for name, own in self.map.names.items()}
        feedthrough = {
            back.get(output, output): frozenset(back.get(name, name) for name in inputs)
            for output, inputs in self.new.feedthrough.items()
        }
        known = {} if self.old is None else self.old.units  # what the description says is in these
        document = self.element.document
        self.element.document = dataclasses.replace(document, units={**known, **document.units})
        units = {**self.new.units, **known}
        return dataclasses.replace(self.new, variables=variables, feedthrough=feedthrough, units=units)

    def _refuse(self, text: str, connector: Connector | None = None) -> None:
        self.problems.add(f"swap {self.path}: {text}", (connector or self.element).place)

    def _warn(self, text: str) -> None:
        self.problems.warn(f"swap {self.path}: {text}")

    def _known(self) -> set[str]:
        """Return the names that the system has for variables of the component."""
        return {c.name for c in self.element.connectors} | (set() if self.old is None else set(self.old.variables))

    def _renamed(self) -> dict[str, Variable]:
        """Return the FMU's variables by the system's names, with the units of the map."""
        for name, own in self.map.names.items():
            if own not in self.new.variables:
                self._refuse(
                    f"{self.new.name} has no variable {own}{_hint(own, self.new.variables)}, which the map names"
                )
            if name not in self._known():
                self._refuse(f"the system has no {self.path}.{name}{_hint(name, self._known())}, which the map names")
        units: dict[str, Unit | None] = {}
        for own, named in self.map.units.items():
            if own not in self.new.variables:
                self._refuse(
                    f"{self.new.name} has no variable {own}{_hint(own, self.new.variables)}, which the map names"
                )
            definitions = ({} if self.old is None else self.old.units, self.element.document.units)
            units[own] = lookup(named, self.new.units, *definitions)
            if units[own] == Unit(named):
                self._refuse(f"unit {named} of {own} in the map is not defined")
        back = {own: name for name, own in self.map.names.items()}
        variables: dict[str, Variable] = {}
        for variable in self.new.variables.values():
            name = back.get(variable.name, variable.name)
            if name in variables:
                self._refuse(f"{name} is the name of another variable of {self.new.name}: the map must name that too")
            unit = units.get(variable.name, variable.unit)
            variables[name] = dataclasses.replace(variable, name=name, unit=unit)
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
            end = (self.name, name)
            self.system.connections[:] = [c for c in self.system.connections if end not in (c.start, c.end)]

    def _partners(self, name: str) -> list[str]:
        """Return what is connected to a connector."""
        end = (self.name, name)
        others = [c.end if c.start == end else c.start for c in self.system.connections if end in (c.start, c.end)]
        return [f"{element}.{other}" if element else other for element, other in others]

    def _fitted(self, connector: Connector, variables: Mapping[str, Variable]) -> Connector | None:
        """Return the connector as the new FMU has it; None when it has none, a problem if that is used."""
        name, partners, variable = connector.name, self._partners(connector.name), variables.get(connector.name)
        used = f", which {', '.join(partners)} {'takes' if connector.kind == 'output' else 'feeds'}"
        if variable is None or variable.causality != connector.kind:
            if partners:
                other = _hint(name, variables) if variable is None else f" (it is {variable.causality} there)"
                self._refuse(f"{self.new.name} has no {connector.kind} {name}{other}{used}", connector)
            return None
        old = None if self.old is None else self.old.variables.get(name)
        type_ = connector.type.type or (None if old is None else canonical(old.type))
        if type_ is not None and canonical(variable.type) != type_:
            if partners:
                self._refuse(f"{name} is {variable.type} in {self.new.name}, not {type_}{used}", connector)
            return None
        if family(variable.type) != "Real":
            return connector
        unit = None if old is None else old.unit
        if connector.type.unit:
            definitions = {} if self.old is None else self.old.units
            unit = lookup(connector.type.unit, self.element.document.units, definitions)
        if partners and old is not None and old.relative != variable.relative:
            self._tell_difference(connector, unit, variable, used)
        try:
            conversion(unit, variable.unit)
        except UnitMismatchError as mismatch:
            if partners:
                have, want = (u.name if u else "no unit" for u in (variable.unit, unit))
                self._refuse(
                    f"{name} is in {have} in {self.new.name}, in {want} in the system: {mismatch}{used}", connector
                )
            return None
        if partners:
            if unit is not None and variable.unit is None:
                self._warn(f"{name} has no unit in {self.new.name}, it is taken to be in {unit.name}")
            if old is not None:
                self._tell_bounds(old, variable)
        if unit is None or connector.type.unit:
            return connector
        return dataclasses.replace(connector, type=dataclasses.replace(connector.type, unit=unit.name))

    def _tell_difference(self, connector: Connector, unit: Unit | None, new: Variable, used: str) -> None:
        """Tell that a variable is a difference (`relativeQuantity`) in one FMU only: a problem where offsets count."""
        names = ("in " + self.new.name, "in the system")
        one, other = names if new.relative else names[::-1]
        said = f"{connector.name} is a difference (relativeQuantity) {one}, not {other}"
        try:
            same = conversion(unit, new.unit) == conversion(unit, new.unit, relative=True)
        except UnitMismatchError:
            return
        if same:
            self._warn(said)
        else:
            self._refuse(f"{said}, and the units have offsets{used}", connector)

    def _tell_bounds(self, old: Variable, new: Variable) -> None:
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
                self._warn(f"{new.name} is at {word} {now:g}{unit} in {self.new.name}, {said} before")

    def _tell_new_inputs(self, variables: Mapping[str, Variable], connected: set[str]) -> None:
        before = connected if self.old is None else connected | {v.name for v in self.old.ports("input")}
        more = [
            f"{name} = {variable.start if variable.start is not None else 'unknown'}"
            for name, variable in variables.items()
            if variable.causality == "input" and name not in before
        ]
        if more:
            self._warn(f"nothing feeds the inputs that are new with {self.new.name}, they keep {', '.join(more)}")


def _hint(name: str, known: Iterable[str]) -> str:
    close = difflib.get_close_matches(name, sorted(known), 1)
    return f" (there is {close[0]})" if close else ""
