"""Plans the step of a system for a coupling: what each stage copies, and which components it steps."""

from collections.abc import Iterable
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from ...errors import TwipError
from ..model.schedule import ComponentPorts, Group, Schedule
from ..model.system import Component, Copy, System
from ..values.types import RECORDED_TYPES, family
from ..values.variable import Variable
from .coupling import Coupling
from .feedthrough import evaluation_order


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
    stages = coupling.algorithm.stages(coupling.order or order.components, sources, coupling.settings)
    in_order = [name for stage in stages.members for name in stage]
    index = {component.name: i for i, component in enumerate(system.components)}
    if sorted(in_order) != sorted(index):
        raise TwipError(f"coupling {coupling.name}: the stages {stages.members} must have every component once")
    stage_of = {name: s for s, stage in enumerate(stages.members) for name in stage}
    planned: list[list[Copy]] = [[] for _ in range(len(stages.members) + 1)]
    for copy in copies:
        planned[min((stage_of[name] for name in copy.used_by), default=len(stages.members))].append(copy)
    flat = [copy for stage in planned for copy in stage]
    columns, every = system.columns, dict(coupling.own_steps)
    return Schedule(
        coupling=coupling.name,
        columns=len(columns),
        names=tuple(columns),
        nominal=_nominal(system),
        components=tuple(
            ComponentPorts(
                name=c.name,
                inputs=_groups(c.inputs, system.first_column[c.name]),
                outputs=_groups(c.outputs, system.first_column[c.name] + len(c.inputs)),
            )
            for c in system.components
        ),
        order=np.array([index[name] for name in in_order], np.int32),
        stage_order=np.cumsum([0, *map(len, stages.members), 0], dtype=np.int32),
        stage_copies=np.cumsum([0, *map(len, planned)], dtype=np.int32),
        destination=np.array([c.destination for c in flat], np.int32),
        source=np.array([c.source for c in flat], np.int32),
        factor=np.array([c.conversion.affine.factor for c in flat], np.float64),
        offset=np.array([c.conversion.affine.offset for c in flat], np.float64),
        middle=np.array([columns[c.destination] in coupling.mid_step for c in flat], np.bool_),
        owner=np.array([index[owner[c.source][0]] if c.source in owner else len(index) for c in flat], np.int32),
        every=np.array([every.get(c.name, 1) for c in system.components], np.int64),
        copy_every=np.array(
            [every.get(owner[c.destination][0], 1) if c.destination in owner else 1 for c in flat], np.int64
        ),
        mappings={i: c.conversion.mapping for i, c in enumerate(flat) if c.conversion.mapping is not None},
        labels=tuple(c.label for c in flat),
        loops=order.paths,
        cycles=stages.cycles,
        iteration=coupling.iteration,
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
