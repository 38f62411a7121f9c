"""A checked system, ready to run: components, their values before initialization, and the copies between them."""

import pathlib
from collections.abc import Callable
from collections.abc import Mapping as MappingType
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

from ..reading.archive import Workspace
from ..reading.arguments import by_name
from ..values.conversion import Conversion
from ..values.names import Key, full_name
from ..values.transformation import Items
from ..values.variable import Variable
from ..values.written import StartValue, Value
from .experiment import Experiment
from .fmu import Fmu
from .signals import Channel, columns


@dataclass(frozen=True)
class Component:
    """One instance of an FMU in the system."""

    name: str
    """Dotted for components of nested systems."""
    fmu: Fmu
    inputs: tuple[Variable, ...]
    outputs: tuple[Variable, ...]
    start_values: tuple[StartValue, ...]

    @cached_property
    def input_names(self) -> frozenset[str]:
        """Names of the inputs."""
        return frozenset(variable.name for variable in self.inputs)


@dataclass(frozen=True)
class Copy:
    """What a column of the recorded table takes from another one."""

    destination: int
    source: int
    conversion: Conversion
    used_by: tuple[str, ...] = ()
    """Components whose step needs the value; empty for an output of a system, which is copied after all steps."""
    label: str = ""
    """Both ends, for messages."""


@dataclass(frozen=True)
class ParameterLink:
    """A parameter that takes a value which another component calculates during initialization."""

    component: str
    variable: Variable
    source: int
    """Column of the recorded table."""
    conversion: Conversion
    label: str
    """Both ends, for messages."""


@dataclass(frozen=True)
class OpenConnector:
    """A connector through which a system takes a value from outside: the caller's inputs may drive it."""

    column: int
    start: float | None
    """Value the system's description or the caller gives it."""
    mirrored: Copy | None
    """A fed input (the destination) whose start value it shows while nobody drives it."""


class FmuFolders(Protocol):
    """Where the unpacked FMUs of a system are; all instances in the system share them."""

    def folder(self, fmu: Fmu, tell: Callable[[str], None]) -> pathlib.Path:
        """Return the folder that holds the unpacked FMU; `tell` is told what the user should know of it."""

    def forget(self, folder: pathlib.Path) -> None:
        """Unpack an FMU anew next time: its library in `folder` has failed beyond repair."""


class GivenValues(Protocol):
    """The values that the system's description, parameter sets and the caller give."""

    @property
    def connectors(self) -> MappingType[Key, float]:
        """Values given to connectors of systems, in the connector's unit."""

    def of(self, path: str) -> tuple[StartValue, ...]:
        """Return the start values of the component at a dotted path."""

    def further(self, values: MappingType[str, Value]) -> "GivenValues":
        """Return these with `values` by `component.variable` on top. Raises `TwipError` with one line per problem."""


@dataclass
class System:
    """A system that has passed every check. The recorded columns are those of `channels`, in order."""

    name: str
    file: str
    components: tuple[Component, ...]
    """In the order of the file."""
    channels: tuple[Channel, ...]
    """Of the components in the order of the file, then of the systems that have connectors."""
    copies: tuple[Copy, ...]
    """From component outputs and open connectors to component inputs and to the other connectors."""
    open_connectors: tuple[OpenConnector, ...]
    parameter_links: tuple[ParameterLink, ...]
    connector_types: MappingType[int, tuple[str, Items]]
    """Of the columns of systems' connectors: the type as it is declared, and the items of an enumeration."""
    experiment: Experiment
    warnings: tuple[str, ...]
    """What is odd, yet allowed by the standard."""
    sources: dict[str, dict[str, str]]
    workspace: Workspace
    unpacked: FmuFolders
    given: GivenValues
    """Where the start values come from; further ones go on top."""

    @cached_property
    def columns(self) -> list[str]:
        """Names of the recorded columns: `component.variable`, a connector of the outermost system by its bare name."""
        return columns(self.channels)

    @cached_property
    def first_column(self) -> dict[str, int]:
        """Index of each channel's first column."""
        first, result = 0, {}
        for channel in self.channels:
            result[channel.component] = first
            first += len(channel.signals)
        return result

    @cached_property
    def variables(self) -> dict[int, Variable]:
        """The variables of components by column."""
        return {
            self.first_column[c.name] + i: variable
            for c in self.components
            for i, variable in enumerate(c.inputs + c.outputs)
        }

    def with_start_values(self, start_values: MappingType[str, Value]) -> "System":
        """Return the system with further start values by `component.variable`, under the rules of `load`.

        It shares files and unpacked FMUs with this one and costs less than a millisecond. Raises `TwipError` with one
        line per problem.
        """
        given = self.given.further(by_name("start_values", start_values))
        names = self.columns
        shown = {full_name(key): value for key, value in given.connectors.items()}
        told = self.sources.get("start values", {}) | {name: str(value) for name, value in start_values.items()}
        return replace(
            self,
            components=tuple(replace(c, start_values=given.of(c.name)) for c in self.components),
            open_connectors=tuple(replace(o, start=shown.get(names[o.column])) for o in self.open_connectors),
            sources={**self.sources, "start values": told} if told else self.sources,
            given=given,
        )

    def provenance(self) -> dict[str, dict[str, str]]:
        """Return what a log needs to say where its numbers come from: a mapping of names to mappings of text."""
        result = {name: dict(entries) for name, entries in self.sources.items()}
        for component in self.components:
            fmu = component.fmu
            result[f"component {component.name}"] = {
                "fmu": fmu.name,
                "sha256": fmu.sha256,
                "guid": fmu.guid,
                "fmi_version": fmu.fmi_version,
                "generation_tool": fmu.generation_tool,
            }
            values = {start.variable.name: repr(start.value) for start in component.start_values}
            if values:
                result[f"start values {component.name}"] = values
        return result

    def close(self) -> None:
        """Remove the temporary folder now rather than with the last reference."""
        self.workspace.close()

    def __enter__(self) -> "System":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def cannot_share_a_process(system: System) -> list[str]:
    """Return a line for each FMU of several components that allows one instance per process only.

    An FMU is what its model description says it is, whatever its file is called: copies of a file are one FMU.
    """
    users: dict[tuple[str, str], list[Component]] = {}
    for component in system.components:
        if component.fmu.only_once:
            users.setdefault((component.fmu.model_identifier, component.fmu.guid), []).append(component)
    return [
        f"FMU {same[0].fmu.name} allows one instance per process, but {', '.join(c.name for c in same)} share it"
        " (isolated, with --isolate, each has its own)"
        for same in users.values()
        if len(same) > 1
    ]
