"""Puts a checked system together: components, recorded channels, and the copies between their columns."""

from collections import Counter
from collections.abc import Mapping

from ..coupling.algorithm_problems import find_problems
from ..fmus.unpacked import UnpackedFmus
from ..model.fmu import Fmu
from ..model.signals import TIME, Channel, Signal, columns
from ..model.system import Component, Copy, OpenConnector, ParameterLink, System
from ..reading.archive import Workspace
from ..reading.problems import Place, Problems
from ..values.names import Key, full_name
from ..values.transformation import Items
from ..values.types import RECORDED_TYPES, family
from ..values.written import cannot_travel, parse_value
from .links import Link, Port
from .parameters import Assignments
from .ssd import Description
from .structure import systems_of
from .wiring import Wiring


def assemble(
    description: Description,
    fmus: Mapping[str, Fmu | None],
    wiring: Wiring,
    assignments: Assignments,
    sources: dict[str, dict[str, str]],
    problems: Problems,
    workspace: Workspace,
) -> System | None:
    """Build the system, whose structure must be sound; None when there are problems, with its values too."""
    usable = {path: fmu for path, fmu in fmus.items() if fmu is not None}
    return _Assembly(description, usable, wiring, assignments, problems).system(sources, workspace)


class _Assembly:
    def __init__(
        self,
        description: Description,
        fmus: Mapping[str, Fmu],
        wiring: Wiring,
        assignments: Assignments,
        problems: Problems,
    ):
        self.description = description
        self.fmus = fmus
        self.wiring = wiring
        self.assignments = assignments
        self.problems = problems
        self._sources = {link.source.key for link in wiring.links.values()}

    def system(self, sources: dict[str, dict[str, str]], workspace: Workspace) -> System | None:
        file = self.description.document.location.name
        components = [self._component(path, fmu) for path, fmu in self.fmus.items()]
        channels = [
            Channel(
                c.name,
                tuple(
                    Signal(
                        v.name, v.recorded_type, v.unit.name if v.unit else None,
                        "input" if v.causality == "input" else "output", v.description,
                    )
                    for v in c.inputs + c.outputs
                ),
            )
            for c in components
        ]  # fmt: skip
        connectors: dict[str, list[Port]] = {path: [] for path in systems_of(self.description.system)}
        for (path, _), port in self.wiring.ports.items():
            if port.variable is None and not port.shared and path in connectors:
                connectors[path].append(port)
        for path, own in connectors.items():
            signals = tuple(signal for port in own for signal in self._signal(port))
            if signals:
                channels.append(Channel(path, signals))
        names = columns(channels)
        for name, count in Counter(names).items():
            if count > 1:
                self.problems.add(f"{name} is the name of more than one variable or connector", Place(file))
        if TIME in names:
            place = self.wiring.ports["", TIME].place
            self.problems.add(f"connector {TIME}: {TIME} is the name of the independent variable", place)
        index = {(c.component, s.name): i for i, (c, s) in enumerate((c, s) for c in channels for s in c.signals)}
        copies = [
            Copy(index[key], index[link.source.key], link.conversion, self._used_by(key), link.label)
            for key, link in self.wiring.links.items()
            if key in index and link.source.key in index
        ]  # fmt: skip
        opened = [
            self._open(key, index)
            for key, port in self.wiring.ports.items()
            if self._is_open(key, port) and key in index
        ]
        algorithm = self.description.experiment.algorithm
        for problem, key in find_problems(algorithm, components, copies, names):
            self.problems.add(problem, algorithm.places.get(key))
        if self.problems:
            return None
        return System(
            name=self.description.name,
            file=file,
            components=tuple(components),
            channels=tuple(channels),
            copies=tuple(copies),
            open_connectors=tuple(opened),
            parameter_links=self._parameter_links(index),
            connector_types=self._connector_types(channels, index),
            experiment=self.description.experiment,
            warnings=tuple(self.problems.warnings),
            sources=sources,
            workspace=workspace,
            unpacked=UnpackedFmus(workspace),
            given=self.assignments,
        )

    def _component(self, path: str, fmu: Fmu) -> Component:
        """Return a component; what is connected and neither input nor output is recorded and read as an output."""
        outputs = fmu.ports("output")
        more = [
            v
            for v in fmu.variables.values()
            if (path, v.name) in self._sources and v.causality != "output" and v.recorded_type in RECORDED_TYPES
        ]
        outputs = tuple(sorted((*outputs, *more), key=lambda v: RECORDED_TYPES.index(v.recorded_type)))
        given = self.assignments.of(path)
        named = {start.variable.name for start in given}
        for variable in fmu.ports("input"):
            start = None if variable.start is None else parse_value(variable.start, variable.type, variable.items)
            if (
                variable.name not in named
                and start is not None
                and (why := cannot_travel(variable.recorded_type, start))
            ):
                self.problems.add(f"{path}.{variable.name} begins with {start} in {fmu.name}, {why}")
        unread = [
            v.name
            for v in fmu.variables.values()
            if v.causality in ("input", "output") and v.recorded_type not in RECORDED_TYPES
        ]
        if unread:
            self.problems.warn(f"{path}: variables of type Binary are not read or set: {', '.join(unread)}")
        return Component(path, fmu, fmu.ports("input"), outputs, given)

    def _parameter_links(self, index: dict[Key, int]) -> tuple[ParameterLink, ...]:
        """Return the connections that give a parameter a value that another component calculates."""
        found = []
        for key, link in self.wiring.links.items():
            source, target = link.source.variable, link.edges[-1].target.variable
            if source is None or target is None or target.causality == "input" or source.variability == "constant":
                continue
            found.append(ParameterLink(key[0], target, index[link.source.key], link.conversion, link.label))
        return tuple(found)

    def _connector_types(self, channels: list[Channel], index: dict[Key, int]) -> dict[int, tuple[str, Items]]:
        """Return, for the columns of connectors, the type as it is declared and the items of an enumeration."""
        recorded = [signal.type for channel in channels for signal in channel.signals]
        found = {}
        for key, port in self.wiring.ports.items():
            if port.variable is None and key in index:
                type_, items = self.wiring.type_of(port)
                found[index[key]] = (recorded[index[key]] if type_ is None else type_, items)
        return found

    def _used_by(self, key: Key) -> tuple[str, ...]:
        """Return the components that take the value of a component input or of an inner system's input."""
        if key[0] in self.fmus:
            return (key[0],)
        passing = (k[0] for k, _ in self.wiring.through(key) if k[0] in self.fmus)
        return tuple(sorted(set(passing))) if self.wiring.ports[key].kind == "input" else ()

    def _is_open(self, key: Key, port: Port) -> bool:
        return port.variable is None and not port.shared and port.kind == "input" and key not in self.wiring.links

    def _signal(self, port: Port) -> list[Signal]:
        """Return the recorded signal of a system connector (none if nothing is connected, or for a parameter), its type
        and unit deduced if not stated.
        """
        if port.kind not in ("input", "output", "local"):
            return []
        link = self.wiring.links.get(port.key)
        behind = [other for _, other in self.wiring.fed_by(port.key)]
        if link is None and not behind:
            self.problems.warn(f"connector {full_name(port.key)} of the system is not connected and not recorded")
            return []
        if link is not None and link.source.variable is None and link.source.kind != "input":
            self.problems.warn(f"connector {full_name(port.key)} of the system shows a parameter and is not recorded")
            return []
        near = self._near(port, link, behind)
        type_ = port.type or next((p.type for p in near if p.type), "Real")
        unit = port.unit
        if unit is None and family(type_) == "Real":
            candidates = {
                p.unit.name: p.unit for p in near if p.unit is not None and (link is None or p is link.source)
            }
            if len(candidates) > 1:
                self.problems.add(
                    f"the unit of connector {full_name(port.key)} could be any of {', '.join(candidates)}", port.place
                )
            unit = next(iter(candidates.values()), None)
        recorded = "Integer" if type_ == "Enumeration" else type_
        return [
            Signal(port.key[1], recorded, unit.name if unit else None, "input" if port.kind == "input" else "output")
        ]

    def _near(self, port: Port, link: Link | None, behind: list[Link]) -> list[Port]:
        """Return the other ports on the way to or from a connector."""
        chains = [link] if link is not None else behind
        return [p for c in chains for p in (c.source, *(edge.target for edge in c.edges)) if p.key != port.key]

    def _open(self, key: Key, index: dict[Key, int]) -> OpenConnector:
        mirrored = next(
            (
                Copy(index[k], index[key], link.conversion, (), link.label)
                for k, link in self.wiring.fed_by(key)
                if k[0] in self.fmus and k in index and link.conversion.affine.factor
            ),
            None,
        )
        return OpenConnector(index[key], self.assignments.connectors.get(key), mirrored)
