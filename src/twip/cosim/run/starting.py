"""Brings a run to its first row: instances, initialization, and what a checkpoint holds."""

import pathlib
from collections.abc import Sequence
from importlib.util import find_spec

import numpy as np

from ..coupling.execution import Execution
from ..coupling.initialization import initialize
from ..fmus.fmu_cache import awaits_compiling
from ..fmus.isolation import IsolatedInstance
from ..fmus.ports import Ports
from ..fmus.protocols import AnyPorts
from .checkpointing import restore
from .run_state import RunState


def start(run: RunState) -> Execution | None:
    """Bring all components to where the run begins and deliver the row there; None when interrupted before."""
    system, grid = run.system, run.grid
    folders = [system.unpacked.folder(c.fmu, lambda why: run.say("warning", why)) for c in system.components]
    _announce(run, folders)
    ports = _instantiate(run, folders)
    if ports is None:
        return None
    columns = run.inputs.columns.tolist()
    first = run.inputs.at(grid.times(0, 0), grid.step_size)[0].tolist()
    run.warnings += (
        warnings := initialize(
            system,
            run.first_pass,
            run.instances,
            ports,
            run.values,
            dict(zip(columns, first, strict=True)),
            (grid.start, grid.stop),
        )
    )
    for warning in warnings:
        run.say("warning", warning)
    run.faults.initialize(np.ctypeslib.as_array(run.values))
    if run.resumed is not None:
        restore(run, run.resumed, ports)
    driven = np.concatenate([run.inputs.columns, run.faults.driven])
    execution = Execution(
        run.schedule,
        ports,
        run.values,
        driven,
        run.clock,
        run.delivery.messages,
        side_by_side=run.isolation is not None,
    )
    if run.resumed is not None:
        execution.go_on(grid, run.steps, run.resumed.samples)
    run.delivery.write(grid.times(run.steps, 0), execution.row[None, : run.faults.recorded].copy())
    run.delivered = True
    return execution


def _instantiate(run: RunState, folders: Sequence[pathlib.Path]) -> list[AnyPorts] | None:
    """Make all instances, in this process or each in its own; None when interrupted before."""
    ports: list[AnyPorts] = []
    parts = list(zip(run.system.components, folders, strict=True))
    if run.isolation is not None:
        isolated: list[IsolatedInstance] = []
        for part in parts:  # the processes start side by side
            isolated.append(run.isolation.instance(*part, run.delivery.messages, run.clock))
            run.instances.append(isolated[-1])
        for each in isolated:
            if run.interrupted:
                return None
            each.load()
        return [*isolated]
    for folder in folders:
        users = [component for component, its in parts if its == folder]
        run.folders[folder] = f"{', '.join(c.name for c in users)} ({pathlib.PurePath(users[0].fmu.name).name})"
    for (component, folder), plan in zip(parts, run.schedule.components, strict=True):
        if run.interrupted:
            return None
        instance = run.pool.take(component, folder, run.delivery.messages, run.dead, run.clock)
        run.instances.append(instance)
        ports.append(Ports(plan, instance, run.values))
    return ports


def _announce(run: RunState, folders: Sequence[pathlib.Path]) -> None:
    """Tell the user when code is going to be compiled, which takes a while."""
    what = [] if run.loop.is_ready() else ["the loop"]
    if find_spec("numba") is not None:
        first = {folder: c.fmu.name for c, folder in zip(run.system.components, folders, strict=True)}
        what += [pathlib.PurePath(name).name for folder, name in first.items() if awaits_compiling(folder)]
    if what:
        run.notice(f"compiling {', '.join(what)}: needed once per build, takes a while")
