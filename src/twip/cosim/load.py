"""Reads a system structure, checks all of it, and returns a `System` or every problem at once."""

import os
import pathlib
import urllib.parse
from collections import Counter
from collections.abc import Mapping, Sequence

from ..errors import TwipError
from .archive import Workspace, unpack
from .document import read_file
from .fmu import RECORDED_TYPES, Fmu, file_fingerprint, read_fmu
from .parameters import Assignments, StartValue, Value
from .problems import Place, Problems
from .record import Channel, Signal, columns
from .ssd import Binding, ComponentElement, Description, SystemElement, read_description
from .ssv import read_parameter_file, read_parameter_set
from .system import Component, Copy, OpenConnector, System, mid_step_problem
from .wiring import Key, Port, Wiring, components_of, full_name, report_shared_names, systems_of, wire

DEFAULT_SSD = "SystemStructure.ssd"
PathLike = str | os.PathLike[str]


def load(
    path: PathLike,
    *,
    parameters: Sequence[PathLike] = (),
    start_values: Mapping[str, Value] | None = None,
    swap: Mapping[str, PathLike] | None = None,
) -> System:
    """Read and check a system, without running code of any FMU.

    `path` is a `.ssp` archive, an unpacked folder or a bare `.ssd`. `parameters` are further parameter sets (`.ssv`)
    that address `component.variable`; `start_values` do so too and win over them. `swap` replaces the FMU of a
    component by another file. Raises `TwipError` with one line per problem.
    """
    system, problems = _load(pathlib.Path(path), parameters, start_values or {}, swap or {})
    problems.raise_any()
    if system is None:
        raise TwipError(f"{path}: cannot be loaded")
    return system


def check(
    path: PathLike,
    *,
    parameters: Sequence[PathLike] = (),
    start_values: Mapping[str, Value] | None = None,
    swap: Mapping[str, PathLike] | None = None,
) -> list[str]:
    """Return the problems that `load` would raise, one line each; an empty list when the system would run."""
    return _load(pathlib.Path(path), parameters, start_values or {}, swap or {})[1].lines


def _load(
    path: pathlib.Path, parameters: Sequence[PathLike], start_values: Mapping[str, Value], swap: Mapping[str, PathLike]
) -> tuple[System | None, Problems]:
    problems = Problems()
    workspace = Workspace()
    try:
        ssd, enclosed = _locate(path, workspace)
    except TwipError as error:
        problems.add(str(error))
        return None, problems
    root = read_file(ssd, ssd.name, problems)
    description = None if root is None else read_description(root, ssd.name, problems)
    if description is None:
        return None, problems
    sources = {"system": {"file": path.name, "name": description.name}}
    if path.is_file():
        sources["system"]["sha256"] = file_fingerprint(path)
    builder = _Builder(description, ssd, enclosed, problems, sources)
    builder.read_fmus(swap)
    builder.assign(parameters, start_values)
    return builder.system(ssd.name, workspace), problems


def _locate(path: pathlib.Path, workspace: Workspace) -> tuple[pathlib.Path, bool]:
    """Return the SSD, and whether it may only refer to files in its own folder."""
    if path.is_dir():
        if not (path / DEFAULT_SSD).is_file():
            raise TwipError(f"{path}: the folder holds no {DEFAULT_SSD}")
        return path / DEFAULT_SSD, False
    if not path.exists():
        raise TwipError(f"{path}: no such file")
    if path.suffix == ".ssd":
        return path, False
    folder = workspace.folder("ssp")
    unpack(path, folder, str(path))
    if not (folder / DEFAULT_SSD).is_file():
        raise TwipError(f"{path}: the archive holds no {DEFAULT_SSD}")
    return folder / DEFAULT_SSD, True


class _Builder:
    """Brings the description, the FMUs and the parameters together."""

    def __init__(
        self,
        description: Description,
        ssd: pathlib.Path,
        enclosed: bool,
        problems: Problems,
        sources: dict[str, dict[str, str]],
    ):
        self.description = description
        self.ssd = ssd
        self.enclosed = enclosed
        self.problems = problems
        self.sources = sources
        self.elements = components_of(description.system)
        report_shared_names(description.system, problems)
        self.warnings: list[str] = []
        self.fmus: dict[str, Fmu] = {}
        self.wiring = Wiring()

    def _resolve(self, source: str, place: Place) -> pathlib.Path | None:
        """Return the file that a URI of the SSD points to."""
        folder = self.ssd.parent.resolve()
        try:
            uri = urllib.parse.urlsplit(source)
            path = (folder / urllib.parse.unquote(uri.path)).resolve()
        except (ValueError, OSError, RuntimeError) as error:
            self.problems.add(f"source {source!r} is not a usable path: {error}", place)
            return None
        if uri.scheme or uri.netloc or uri.fragment or uri.query or uri.path.startswith("/"):
            self.problems.add(f"source {source}: only relative paths are supported", place)
            return None
        if self.enclosed and not path.is_relative_to(folder):
            self.problems.add(f"source {source} leads out of the archive", place)
            return None
        return path

    def read_fmus(self, swap: Mapping[str, PathLike]) -> None:
        """Read every FMU once and wire the system."""
        for name in swap.keys() - self.elements.keys():
            self.problems.add(f"there is no component {name} to swap")
        known: dict[pathlib.Path, Fmu | None] = {}
        found: dict[str, Fmu | None] = {}
        for path, element in self.elements.items():
            if path in swap:
                file, name = pathlib.Path(swap[path]).resolve(), str(swap[path])
            else:
                resolved, name = (
                    self._resolve(element.source, element.place) if element.source else None,
                    element.source,
                )
                if resolved is None:
                    found[path] = None
                    continue
                file = resolved
            if file not in known:
                known[file] = read_fmu(file, name, self.problems, element.place)
            found[path] = known[file]
        for path, element in self.elements.items():
            fmu = found[path]
            if fmu is not None and fmu.only_once and sum(other is fmu for other in found.values()) > 1:
                self.problems.add(f"FMU {fmu.name} allows one instance per process, {path} shares it", element.place)
        if not found:
            self.problems.add(f"system {self.description.system.name} has no components", self.description.system.place)
        self.wiring = wire(self.description.system, found, self.description.units, self.elements, self.problems)
        self.fmus = {path: fmu for path, fmu in found.items() if fmu is not None}

    def assign(self, files: Sequence[PathLike], start_values: Mapping[str, Value]) -> None:
        """Apply all parameters and start values in their order of precedence."""
        self.assignments = Assignments(self.fmus, self.wiring, self.description.units, self.problems)
        scopes: list[tuple[str, ComponentElement | SystemElement]] = [
            (path, e) for path, e in self.elements.items() if path in self.fmus
        ]
        scopes += sorted(
            systems_of(self.description.system).items(), key=lambda item: -item[0].count(".") - bool(item[0])
        )
        for scope, element in scopes:
            for binding in element.bindings:
                self._bind(scope, binding)
        if len(self.fmus) < len(self.elements) and (files or start_values):
            self.problems.add("parameter files and start values were not checked against the FMUs that cannot be read")
        for file in files:
            path = pathlib.Path(file)
            parameters = read_parameter_file(path, path.name if path.is_file() else str(file), self.problems)
            if parameters is not None:
                self.sources[f"parameters {path.name}"] = {"file": str(file), "sha256": file_fingerprint(path)}
                if len(self.fmus) == len(self.elements):
                    self.assignments.apply_set(parameters, "", from_caller=True)
        if len(self.fmus) == len(self.elements):
            self.assignments.apply_values(start_values)
        if start_values:
            self.sources["start values"] = {name: str(value) for name, value in start_values.items()}
        self.assignments.check_connected()
        self.assignments.check_ranges()

    def _bind(self, scope: str, binding: Binding) -> None:
        if binding.inline is not None:
            parameters = read_parameter_set(binding.inline, self.ssd.name, self.problems)
        else:
            source = binding.source or ""
            path = self._resolve(source, binding.place)
            parameters = (
                None
                if path is None
                else read_parameter_file(path, pathlib.PurePosixPath(source).name, self.problems, binding.place)
            )
            if path is not None and parameters is not None:
                self.sources[f"parameters {source}"] = {"file": source, "sha256": file_fingerprint(path)}
        if parameters is not None and len(self.fmus) == len(self.elements):
            self.assignments.apply_set(parameters, scope, binding.prefix)

    def system(self, file: str, workspace: Workspace) -> System | None:
        """Build the system; None when there are problems."""
        if self.problems:
            return None
        channels: list[Channel] = []
        components: list[Component] = []
        for path, fmu in self.fmus.items():
            inputs, outputs = fmu.ports("input"), fmu.ports("output")
            values: list[StartValue] = [value for key, value in self.assignments.variables.items() if key[0] == path]
            components.append(Component(path, fmu, inputs, outputs, tuple(values)))
            signals = tuple(
                Signal(v.name, v.recorded_type, v.unit.name if v.unit else None, v.causality, v.description)
                for v in inputs + outputs
            )
            channels.append(Channel(path, signals))
            strings = [
                v.name
                for v in fmu.variables.values()
                if v.causality in ("input", "output") and v.recorded_type not in RECORDED_TYPES
            ]
            if strings:
                self.warnings.append(f"{path}: variables of type String are not recorded: {', '.join(strings)}")
        for path in systems_of(self.description.system):
            signals = tuple(
                s
                for key, port in self.wiring.ports.items()
                if key[0] == path and port.variable is None
                for s in self._signal(port)
            )
            if signals:
                channels.append(Channel(path, signals))
        names = columns(channels)
        for name, count in Counter(names).items():
            if count > 1:
                self.problems.add(f"{name} is the name of more than one variable or connector", Place(file))
        index = {(c.component, s.name): i for i, (c, s) in enumerate((c, s) for c in channels for s in c.signals)}
        copies = [
            Copy(index[key], index[link.source.key], link.conversion, self._used_by(key))
            for key, link in self.wiring.links.items()
            if key in index and link.source.key in index
        ]
        opened = [
            self._open(key, index)
            for key, port in self.wiring.ports.items()
            if self._is_open(key, port) and key in index
        ]
        mid_step = self._mid_step(components, copies, names)
        return None if self.problems else System(
            self.description.name, file, tuple(components), tuple(channels), tuple(copies), tuple(opened),
            self.description.experiment, mid_step, tuple(self.warnings), self.sources, workspace,
        )  # fmt: skip

    def _mid_step(self, components: list[Component], copies: list[Copy], names: list[str]) -> tuple[str, ...]:
        """Return the inputs that the file wants taken at the middle of a step, checked."""
        for name, place in self.description.experiment.mid_step:
            problem = mid_step_problem(name, components, copies, names)
            if problem:
                self.problems.add(problem, place)
        return tuple(name for name, _ in self.description.experiment.mid_step)

    def _used_by(self, key: Key) -> tuple[str, ...]:
        """Return the components that take the value of a component input or of an inner system's input."""
        if key[0] in self.fmus:
            return (key[0],)
        passing = (
            k[0]
            for k, link in self.wiring.links.items()
            if k[0] in self.fmus and any(e.source.key == key for e in link.edges)
        )
        return tuple(sorted(set(passing))) if self.wiring.ports[key].kind == "input" else ()

    def _is_open(self, key: Key, port: Port) -> bool:
        return port.variable is None and port.kind == "input" and key not in self.wiring.links

    def _signal(self, port: Port) -> list[Signal]:
        """Return the recorded signal of a system connector (none if nothing is connected), its type and unit deduced if
        not stated.
        """
        if port.kind == "parameter":
            return []
        link = self.wiring.links.get(port.key)
        behind = [other for _, other in self.wiring.fed_by(port.key)]
        if link is None and not behind:
            self.warnings.append(f"connector {full_name(port.key)} of the system is not connected and not recorded")
            return []
        chains = [link] if link is not None else behind
        near = [
            p for chain in chains for p in (chain.source, *(edge.target for edge in chain.edges)) if p.key != port.key
        ]
        type_ = port.type or next((p.type for p in near if p.type), "Real")
        unit = port.unit
        if unit is None and type_ == "Real":
            candidates = {
                p.unit.name: p.unit for p in near if p.unit is not None and (link is None or p is link.source)
            }
            if len(candidates) > 1:
                self.problems.add(
                    f"the unit of connector {full_name(port.key)} could be any of {', '.join(candidates)}", port.place
                )
            unit = next(iter(candidates.values()), None)
        return [Signal(port.key[1], type_, unit.name if unit else None, port.kind)]

    def _open(self, key: Key, index: dict[Key, int]) -> OpenConnector:
        mirrored = next(
            (Copy(index[k], index[key], link.conversion) for k, link in self.wiring.fed_by(key) if k[0] in self.fmus),
            None,
        )
        return OpenConnector(index[key], self.assignments.connectors.get(key), mirrored)
