"""The flat plan of a step: arrays only, no FMU and no Python object of the system, for the plain and the compiled loop
alike.

All values of the system live in one float64 vector, the recorded row. A step runs stages in order. A stage first does
its copies (`values[destination] = factor * values[source] + offset`, some of them looking ahead), then steps its
components: set inputs, doStep, get outputs. Jacobi has one stage for all components; Gauss–Seidel has one per
component, in feed-through order, so that a copy brings the value of the same step if the source has run, else of the
one before. A last stage without components updates the connectors of the systems.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import TwipError
from .feedthrough import evaluation_order
from .fmu import RECORDED_TYPES, Variable
from .ssd import COUPLINGS
from .system import Component, Copy, System
from .transformation import Mapping


@dataclass(frozen=True)
class Group:
    """Variables of one type of a component, in consecutive columns."""

    type: str
    """`Real`, `Integer` or `Boolean`."""
    first: int
    """Column of the first variable."""
    references: NDArray[np.uint32]
    """Value references, (n,)."""


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
    lead: NDArray[np.float64]
    """Share of a step by which a copy looks ahead, linearly from its last two values (copies); 0 for a plain copy."""
    mappings: dict[int, Mapping]
    """By copy: the tables that replace values in place of factor and offset."""
    labels: tuple[str, ...]
    """Both ends of each copy, for messages (copies)."""
    loops: tuple[tuple[tuple[str, str], ...], ...]
    """Algebraic loops: the outputs (component, variable) that depend on each other."""

    def refusal(self, copy: int, value: float, time: float) -> TwipError:
        """Return the failure of a copy whose table does not have `value`."""
        return TwipError(
            f"{self.labels[copy]} failed at t = {time:.12g} s: {value:g} is no item of the enumeration, and not mapped"
        )


def make_schedule(system: System, coupling: str, driven: Iterable[int] = (), mid_step: Iterable[str] = ()) -> Schedule:
    """Plan a step of `system`; `driven` are the columns that the caller's inputs write.

    `mid_step` names the inputs that are taken at the middle of a step: half a step ahead of a source that has not run
    yet in this step, half a step behind one that has. An open connector that is not driven does not copy, so that the
    inputs behind it keep their start values.
    Raises `TwipError` for an unknown `coupling`.
    """
    if coupling not in COUPLINGS:
        raise TwipError(f"coupling {coupling!r} must be one of {', '.join(COUPLINGS)}")
    idle = {connector.column for connector in system.open_connectors} - set(driven)
    copies = sorted((c for c in system.copies if c.source not in idle), key=lambda c: c.destination)
    owner = _owners(system)
    order = evaluation_order(
        {c.name: {v.name: _feedthrough(c, v.name) for v in c.outputs} for c in system.components},
        {owner[c.destination]: owner[c.source] for c in copies if c.destination in owner and c.source in owner},
    )
    index = {component.name: i for i, component in enumerate(system.components)}
    execution = [index[name] for name in order.components]
    stages = [execution] if coupling == "jacobi" else [[i] for i in execution]
    stage_of = {system.components[i].name: s for s, stage in enumerate(stages) for i in stage}
    planned: list[list[Copy]] = [[] for _ in range(len(stages) + 1)]
    for copy in copies:
        planned[min((stage_of[name] for name in copy.used_by), default=len(stages))].append(copy)
    flat = [copy for stage in planned for copy in stage]
    return Schedule(
        coupling,
        len(system.columns),
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
        np.array(_leads(system, planned, stage_of, owner, set(mid_step)), np.float64),
        {i: c.mapping for i, c in enumerate(flat) if c.mapping is not None},
        tuple(c.label for c in flat),
        order.loops,
    )


def _feedthrough(component: Component, name: str) -> frozenset[str]:
    """Return the inputs that a variable depends on; what is no output may depend on all of them."""
    known = component.fmu.feedthrough
    return known[name] if name in known else frozenset(v.name for v in component.inputs)


def _leads(
    system: System,
    planned: list[list[Copy]],
    stage_of: dict[str, int],
    owner: dict[int, tuple[str, str]],
    mid_step: set[str],
) -> list[float]:
    names = system.columns
    leads = []
    for stage, copies in enumerate(planned):
        for copy in copies:
            source = owner.get(copy.source)
            has_run = source is not None and stage_of[source[0]] < stage
            leads.append((-0.5 if has_run else 0.5) if names[copy.destination] in mid_step else 0.0)
    return leads


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
        references = [v.reference for v in variables if v.recorded_type == kind]
        if references:
            groups.append(Group(kind, first, np.array(references, np.uint32)))
            first += len(references)
    return tuple(groups)
