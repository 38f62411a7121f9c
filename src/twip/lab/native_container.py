"""A checked system of native FMUs as one native FMU, coupled as the system is."""

from collections.abc import Sequence
from pathlib import Path

from ..cosim import INITIAL_COUPLING, Coupling, Schedule, System, couplings_that, make_schedule, time_grid
from ..errors import TwipError
from ..fmi import Connection, Connector, Container, Link, Name, Nested, Stage, Wiring, write_native_container
from ..platform import PLATFORMS, Platform
from .container import STOP_TIME


def pack_native(
    system: System,
    fmi: str,
    output: Path,
    step_size: float | None = None,
    platforms: Sequence[Platform] = PLATFORMS,
) -> list[str]:
    """Write `system` as one native FMU in version `fmi` (`2.0` or `3.0`).

    Returns what it does otherwise than the system. `step_size` is the step of the inside in s; default: the system's.
    Raises TwipError with a line per thing that a native container cannot do.
    """
    grid = time_grid(system, 0.0, system.experiment.stop_time or STOP_TIME, step_size, 0.0)
    coupling = Coupling.of(system, grid, system.experiment.algorithm)
    _refuse(system, coupling)
    driven = [c.column for c in system.open_connectors]
    schedule = make_schedule(system, coupling, driven)
    names = _names(system)
    wiring = Wiring(
        _stages(make_schedule(system, INITIAL_COUPLING, driven), names, mid_step=False),
        _stages(schedule, names, mid_step=True),
        _words(coupling),
    )
    links = [link for stage in wiring.stages for link in stage.links]
    behind: dict[Name, list[Name]] = {}
    for link in links:
        if not link.source[0] and link.destination[0]:
            behind.setdefault(link.source, []).append(link.destination)
    start = {names[c.column]: c.start for c in system.open_connectors}
    container = Container(
        system.name,
        f"{system.name}: {', '.join(c.name for c in system.components)} as one FMU",
        tuple(
            Nested(c.name, c.fmu.path, {v.variable.name: v.value for v in c.start_values}) for c in system.components
        ),
        tuple(Connection(k.source, k.destination) for k in links if k.source[0] and k.destination[0]),
        tuple(Connector(name[1], tuple(behind[name]), value) for name, value in start.items() if name in behind),
        tuple(Connector(k.destination[1], (k.source,)) for k in links if k.source[0] and not k.destination[0]),
        grid.step_size,
        grid.stop,
    )
    otherwise = []
    if system.experiment.start_time:
        otherwise.append(f"the proposed start time is 0 s, not {system.experiment.start_time:g} s")
    return otherwise + write_native_container(container, wiring, fmi, output, platforms)


def _refuse(system: System, coupling: Coupling) -> None:
    problems = []
    if coupling.algorithm.repeats:
        able = couplings_that(lambda a: not a.repeats)
        problems.append(f"{coupling.name} coupling: a native container steps by {able}")
    if coupling.control is not None:
        problems.append("variable steps: a native container has equal steps")
    problems += [f"{name} has a step of its own: a native container steps all alike" for name, _ in coupling.own_steps]
    problems += [f"{link.label}: a native container passes no parameters on" for link in system.parameter_links]
    problems += [
        f"{copy.label}: a native container has no tables of values"
        for copy in system.copies
        if copy.conversion.mapping is not None
    ]
    if problems:
        raise TwipError(problems)


def _names(system: System) -> dict[int, Name]:
    """Return component and variable by column, a connector as one of component ""."""
    names = {column: ("", name) for column, name in enumerate(system.columns)}
    for c in system.components:
        first = system.first_column[c.name]
        names |= {column: (c.name, v.name) for column, v in enumerate(c.inputs + c.outputs, first)}
    return names


def _stages(schedule: Schedule, names: dict[int, Name], mid_step: bool) -> tuple[Stage, ...]:
    links = [
        Link(names[source], names[destination], factor, offset, mid_step and middle)
        for source, destination, factor, offset, middle in zip(
            schedule.source.tolist(), schedule.destination.tolist(), schedule.factor.tolist(),
            schedule.offset.tolist(), schedule.middle.tolist(), strict=True,
        )
    ]  # fmt: skip
    copies, order = schedule.stage_copies.tolist(), schedule.stage_order.tolist()
    return tuple(
        Stage(
            tuple(links[copies[s] : copies[s + 1]]),
            tuple(schedule.components[i].name for i in schedule.order[order[s] : order[s + 1]]),
        )
        for s in range(len(order) - 1)
    )


def _words(coupling: Coupling) -> str:
    middle = f"; {', '.join(coupling.mid_step)} at the middle of the step" if coupling.mid_step else ""
    return f"{coupling.algorithm.summary}{middle}"
