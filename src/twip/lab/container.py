"""A checked system as a container FMU."""

from pathlib import Path

from ..cosim import COUPLINGS, DEFAULT_COUPLING, Copy, System, time_grid
from ..errors import TwipError
from ..fmi import Connection, Connector, Container, Name, Nested, write_container

STOP_TIME = 10.0
"""Proposed end of a simulation in s where the system proposes none."""


def pack(system: System, fmi: str, output: Path, step_size: float | None = None) -> list[str]:
    """Write `system` as one FMU in version `fmi` (`2.0` or `3.0`); return what it does otherwise than the system.

    `step_size` is the step of the inside in s; default: the system's. Raises TwipError with a line per thing that a
    container cannot do.
    """
    grid = time_grid(system, 0.0, system.experiment.stop_time or STOP_TIME, step_size, 0.0)
    names = {
        system.first_column[c.name] + i: (c.name, v.name)
        for c in system.components
        for i, v in enumerate(c.inputs + c.outputs)
    }
    columns = system.columns
    problems, connections = [], []
    inputs: dict[int, list[Name]] = {c.column: [] for c in system.open_connectors}
    outputs: dict[int, Name] = {}
    for copy in system.copies:
        affine = copy.conversion.affine
        if copy.conversion.mapping is not None or affine.factor != 1.0 or affine.offset != 0.0:
            problems.append(f"{_arrow(copy, columns)}: a container does not convert values")
        elif copy.source in names and copy.destination in names:
            connections.append(Connection(names[copy.source], names[copy.destination]))
        elif copy.destination in names:
            inputs[copy.source].append(names[copy.destination])
        elif copy.source in names:
            outputs[copy.destination] = names[copy.source]
    if problems:
        raise TwipError(problems)
    start = {c.column: c.start for c in system.open_connectors}
    container = Container(
        system.name,
        f"{system.name}: {', '.join(c.name for c in system.components)} as one FMU",
        tuple(
            Nested(c.name, c.fmu.path, {v.variable.name: v.value for v in c.start_values}) for c in system.components
        ),
        tuple(connections),
        tuple(Connector(columns[i], tuple(behind), start[i]) for i, behind in inputs.items() if behind),
        tuple(Connector(columns[i], (name,)) for i, name in outputs.items()),
        grid.step_size,
        grid.stop,
    )
    return _otherwise(system) + write_container(container, fmi, output)


def _otherwise(system: System) -> list[str]:
    """Return what of the system's own way to run a container does not keep."""
    result, algorithm = [], system.experiment.algorithm
    coupling = DEFAULT_COUPLING if algorithm.coupling is None else COUPLINGS[algorithm.coupling]
    unlike = f"not by {coupling.name}" if coupling.unlike_jacobi is None else coupling.unlike_jacobi
    if unlike:
        result.append(f"components exchange values once per step (Jacobi), {unlike}")
    if algorithm.mid_step:
        result.append(f"inputs are not taken at the middle of a step: {', '.join(algorithm.mid_step)}")
    if algorithm.own_steps:
        result.append(f"components have no step of their own: {', '.join(algorithm.own_steps)}")
    if algorithm.tolerance:
        result.append("steps do not vary")
    if system.experiment.start_time:
        result.append(f"the proposed start time is 0 s, not {system.experiment.start_time:g} s")
    return result


def _arrow(copy: Copy, columns: list[str]) -> str:
    return f"{columns[copy.source]} → {columns[copy.destination]}"
