"""The flat plan of a step: arrays only, no FMU and no Python object of the system, for the plain and the compiled loop
alike.

All values of the system live in one float64 vector, the recorded row. A step runs stages in order. A stage first does
its copies (`values[destination] = factor * values[source] + offset`, some of them looking ahead), then steps its
components: set inputs, doStep, get outputs. Jacobi has one stage for all components; Gauss–Seidel has one per
component, in feed-through order or one given by hand, so that a copy brings the value of the same step if the source
has run, else of the one before. A last stage without components updates the connectors of the systems.

A component with a step of its own, m communication steps, takes part in every m-th step, the one in which its own step
ends: then it gets its inputs and goes from where it is to the end of that step. Between, its outputs hold.

Iterated coupling has stages like Gauss–Seidel, components of a cycle one after the other; these stages are repeated.
"""

import math
from collections.abc import Container, Iterable, Iterator
from dataclasses import dataclass
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from ...errors import TwipError
from ..fmus.description import RECORDED_TYPES, Variable
from ..model.iteration import Iteration
from ..model.system import Component, Copy, System
from ..values.ssp_types import family
from ..values.transformation import Mapping
from .coupling import Coupling
from .cycles import split
from .feedthrough import evaluation_order


@dataclass(frozen=True)
class Group:
    """Variables of one type of a component, in consecutive columns."""

    type: str
    """One of `RECORDED_TYPES`."""
    first: int
    """Column of the first variable."""
    references: NDArray[np.uint32]
    """Value references of the variables, (n,)."""
    sizes: NDArray[np.int64]
    """Columns of each variable, (n,): more than 1 for an array."""
    names: tuple[str, ...]
    """By column."""

    def parts(self, wanted: Container[int]) -> "Iterator[Group]":
        """Return the variables that begin at one of the `wanted` columns, those side by side together."""
        begins = np.cumsum([0, *self.sizes])[:-1]
        chosen = [i for i, begin in enumerate(begins.tolist()) if self.first + begin in wanted]
        for _, run in groupby(enumerate(chosen), lambda item: item[1] - item[0]):
            which = [i for _, i in run]
            begin, size = int(begins[which[0]]), int(self.sizes[which].sum())
            names = self.names[begin : begin + size]
            yield Group(self.type, self.first + begin, self.references[which], self.sizes[which], names)


@dataclass(frozen=True)
class ComponentPorts:
    """What is set on and read from one component."""

    name: str
    inputs: tuple[Group, ...]
    outputs: tuple[Group, ...]


@dataclass(frozen=True)
class Schedule:
    """The plan of a step; array lengths in brackets."""

    coupling: str
    columns: int
    names: tuple[str, ...]
    """Of the columns: `component.variable` (columns)."""
    nominal: NDArray[np.float64]
    """Nominal value of a continuous Real; 0 for what does not take any value (columns)."""
    components: tuple[ComponentPorts, ...]
    """In the order of the file."""
    order: NDArray[np.int32]
    """Indices into `components` in the order of execution (components)."""
    stage_order: NDArray[np.int32]
    """Stage s steps `order[stage_order[s]:stage_order[s + 1]]` (stages + 1)."""
    stage_copies: NDArray[np.int32]
    """Stage s does the copies `stage_copies[s]` to `stage_copies[s + 1]` (stages + 1)."""
    destination: NDArray[np.int32]
    """Columns, by copy (copies)."""
    source: NDArray[np.int32]
    factor: NDArray[np.float64]
    offset: NDArray[np.float64]
    """An offset of -0.0 keeps the sign of zero."""
    middle: NDArray[np.bool_]
    """Whether a copy brings the value at the middle of its component's step, on the line through the source's last two
    values (copies).
    """
    owner: NDArray[np.int32]
    """Index of the component whose output a copy takes; that after the last component for a connector (copies)."""
    every: NDArray[np.int64]
    """Communication steps in a step of the component (components)."""
    copy_every: NDArray[np.int64]
    """The same for the component that takes a copy; 1 for a connector (copies)."""
    mappings: dict[int, Mapping]
    """By copy: the tables that replace values in place of factor and offset."""
    labels: tuple[str, ...]
    """Both ends of each copy, for messages (copies)."""
    loops: tuple[str, ...]
    """Algebraic loops, each as the way around it."""
    cycles: tuple[tuple[int, int], ...]
    """Stages that are repeated together, first and after the last; only under iterated coupling."""
    iteration: Iteration

    def members(self, cycle: tuple[int, int]) -> list[int]:
        """Return the components of a cycle in the order of execution."""
        return [int(i) for i in self.order[self.stage_order[cycle[0]] : self.stage_order[cycle[1]]]]

    def refusal(self, copy: int, value: float, time: float) -> TwipError:
        """Return the failure of a copy that gives a `value` which is not finite, or whose table does not have it."""
        why = f"{value:g} is no item of the enumeration, and not mapped"
        if not math.isfinite(value):
            why = f"gave {value:g}, which is not finite"
        return TwipError(f"{self.labels[copy]} failed at t = {time:.12g} s: {why}")


def make_schedule(system: System, coupling: Coupling, driven: Iterable[int] = ()) -> Schedule:
    """Plan a step of `system`; `driven` are the columns that the caller's inputs write.

    An open connector that is not driven does not copy, so that the inputs behind it keep their start values.
    """
    idle = {connector.column for connector in system.open_connectors} - set(driven)
    owner = _owners(system)
    copies = sorted(
        (c for c in system.copies if c.source not in idle or c.destination not in owner), key=lambda c: c.destination
    )
    sources = {owner[c.destination]: owner[c.source] for c in copies if c.destination in owner and c.source in owner}
    order = evaluation_order(
        {c.name: {v.name: feedthrough_of(c, v.name) for v in c.outputs} for c in system.components}, sources
    )
    cycles: list[tuple[int, int]] = []
    in_order = list(coupling.order or order.components)
    if coupling.name == "iterated":
        blocks, in_order = split(order.components, sources), []
        for names, is_cycle in blocks:
            if is_cycle:
                cycles.append((len(in_order), len(in_order) + len(names)))
            in_order += names
    index = {component.name: i for i, component in enumerate(system.components)}
    execution = [index[name] for name in in_order]
    stages = [execution] if coupling.name == "jacobi" else [[i] for i in execution]
    stage_of = {system.components[i].name: s for s, stage in enumerate(stages) for i in stage}
    planned: list[list[Copy]] = [[] for _ in range(len(stages) + 1)]
    for copy in copies:
        planned[min((stage_of[name] for name in copy.used_by), default=len(stages))].append(copy)
    flat = [copy for stage in planned for copy in stage]
    columns, every = system.columns, dict(coupling.own_steps)
    return Schedule(
        coupling.name,
        len(columns),
        tuple(columns),
        _nominal(system),
        tuple(
            ComponentPorts(
                c.name,
                _groups(c.inputs, system.first_column[c.name]),
                _groups(c.outputs, system.first_column[c.name] + len(c.inputs)),
            )
            for c in system.components
        ),
        np.array(execution, np.int32),
        np.cumsum([0, *map(len, stages), 0], dtype=np.int32),
        np.cumsum([0, *map(len, planned)], dtype=np.int32),
        np.array([c.destination for c in flat], np.int32),
        np.array([c.source for c in flat], np.int32),
        np.array([c.conversion.factor for c in flat], np.float64),
        np.array([c.conversion.offset for c in flat], np.float64),
        np.array([columns[c.destination] in coupling.mid_step for c in flat], np.bool_),
        np.array([index[owner[c.source][0]] if c.source in owner else len(index) for c in flat], np.int32),
        np.array([every.get(c.name, 1) for c in system.components], np.int64),
        np.array([every.get(owner[c.destination][0], 1) if c.destination in owner else 1 for c in flat], np.int64),
        {i: c.mapping for i, c in enumerate(flat) if c.mapping is not None},
        tuple(c.label for c in flat),
        order.paths,
        tuple(cycles),
        coupling.iteration,
    )


def feedthrough_of(component: Component, name: str) -> frozenset[str]:
    """Return the inputs that a variable depends on; what is no output may depend on all of them."""
    return component.fmu.feedthrough.get(name, component.input_names)


def _nominal(system: System) -> NDArray[np.float64]:
    nominal = np.zeros(len(system.columns))
    for component in system.components:
        for i, variable in enumerate(component.inputs + component.outputs):
            if family(variable.recorded_type) == "Real" and variable.variability == "continuous":
                nominal[system.first_column[component.name] + i] = variable.nominal or 1.0
    return nominal


def _owners(system: System) -> dict[int, tuple[str, str]]:
    """Map the columns of components to (component, variable)."""
    return {
        system.first_column[c.name] + i: (c.name, variable.name)
        for c in system.components
        for i, variable in enumerate(c.inputs + c.outputs)
    }


def _groups(variables: tuple[Variable, ...], first: int) -> tuple[Group, ...]:
    groups = []
    for kind in RECORDED_TYPES:
        chosen = [v for v in variables if v.recorded_type == kind]
        if chosen:
            whole = [list(v) for _, v in groupby(enumerate(chosen), lambda item: item[1].array or item[0])]
            references, sizes = [v[0][1].reference for v in whole], [len(v) for v in whole]
            groups.append(
                Group(
                    kind,
                    first,
                    np.array(references, np.uint32),
                    np.array(sizes, np.int64),
                    tuple(v.name for v in chosen),
                )
            )
            first += len(chosen)
    return tuple(groups)
