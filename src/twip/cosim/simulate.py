"""Runs a checked system from start to stop and hands what happens to the sinks."""

import contextlib
import dataclasses
import math
import os
import pathlib
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from importlib.util import find_spec

from ..errors import TwipError
from ..interrupts import deferred_interrupt
from .coupling.coupling import Coupling
from .coupling.loop import PythonLoop
from .fmus.isolation import TIME_LIMIT
from .fmus.pool import InstancePool
from .model.algorithm import Algorithm
from .model.signals import Sink, TimedSink
from .model.system import System
from .model.time_grid import TimeGrid
from .reading.arguments import by_name, names
from .run.checkpoint import Checkpoint, Saving, cannot_be_saved, identify
from .run.delivery import Delivery, writing
from .run.execute import execute
from .run.interrupt_flag import InterruptFlag
from .run.pace import Pacer
from .run.preparation import Request, prepare
from .run.results import Result
from .run.run_state import LoopKind, RunState
from .scenario.live_inputs import LiveInputs
from .scenario.plan import Scenario
from .sinks.table_sink import Table

LOOPS = ("compiled", "python")
"""How a schedule can be executed; the first is the default where numba is installed."""


def simulate(
    system: System,
    *,
    start_time: float | None = None,
    stop_time: float | None = None,
    step_size: float | None = None,
    coupling: str | None = None,
    mid_step: str | Sequence[str] | None = None,
    order: str | Sequence[str] | None = None,
    own_steps: Mapping[str, float] | None = None,
    options: Mapping[str, float] | None = None,
    tolerance: float | None = None,
    minimum_step: float | None = None,
    maximum_step: float | None = None,
    input_file: str | os.PathLike[str] | None = None,
    scenario: str | os.PathLike[str] | None = None,
    sinks: Sink | Sequence[Sink] | Callable[[TimeGrid], Sequence[Sink]] | None = None,
    progress: Callable[[float], None] | None = None,
    notice: Callable[[str], None] | None = None,
    loop: str | None = None,
    isolate: bool = False,
    time_limit: float | None = None,
    checkpoint: str | os.PathLike[str] | None = None,
    checkpoint_every: float | None = None,
    resume: str | os.PathLike[str] | None = None,
    real_time: float | None = None,
    pool: InstancePool | None = None,
    live: LiveInputs | None = None,
) -> Result:
    """Run `system`; times and step in s, `coupling` `jacobi`, `gauss-seidel` or `iterated`.

    `mid_step` names inputs (`component.variable`) that are taken at the middle of each step, on the line through the
    source's last two values. `order` names all components in the order in which Gauss–Seidel is to run them, instead of
    that of their feed-through. `own_steps` gives components a step of their own in s, a whole multiple of `step_size`.
    `options` are those of the coupling alone, by name: iterated steps are repeated until coupling variables change by
    less than `iteration_tolerance`, relative to magnitude or nominal value (default 1e-8), at most `maximum_iterations`
    times (default 50).
    What is not given comes from the system's description, then from the FMUs; a given `coupling` leaves the
    description's mid-step inputs, order and iteration aside.

    With a `tolerance` above 0 the steps are variable, between `minimum_step` (default: a millionth of the first) and
    `maximum_step` in s, `step_size` the first: none has a local error above it, relative to magnitude or nominal value.
    Jumps of time series, parameter changes and the stop time are hit exactly.

    `input_file` is a CSV file that drives open inputs, `scenario` a TOML file with time series, parameter changes and
    faults (docs/scenarios.md). The `sinks`, or what they return when they are a function of the time grid, called after
    all checks, get row 0 (the values at the start time), then the row of each finished step, and are closed in the end,
    however it comes; without sinks the result keeps all rows in memory. `progress` is called with the simulated time
    after each chunk, `notice` with a sentence before something that takes a while. `loop` is `compiled`
    (the default where numba is installed) or `python`; the results are the same. Ctrl-C (as SIGTERM and SIGHUP) ends
    the run between two steps; the result says so.

    `isolate` runs each FMU in a process of its own, by the Python loop: one that crashes, or takes longer than
    `time_limit` (s, by default 10) for a call, ends the run like one that returns an error.

    `checkpoint` is a file that takes the state of the whole run every `checkpoint_every` simulated seconds, when Ctrl-C
    ends the run, and at its end; a failed run leaves the last one. `resume` is such a file: the run goes on from there
    as if it had never stopped. It must be the same in everything but the stop time and later values of the inputs; its
    first row is that of the checkpoint.

    `real_time` holds the run back to so many simulated seconds per second; the result tells of missed deadlines. A
    `pool` keeps the instances for the next run of the system or of a variation of its start values.

    `live` are inputs that are set while the run goes on, by another thread, but for those that a file drives; a
    checkpoint cannot hold them.

    Raises `TwipError` for bad arguments and for the failure of a component.
    """
    interrupted = InterruptFlag()
    with contextlib.ExitStack() as closing:
        closing.push(interrupted)  # entered below; left when all sinks are closed
        table = Table(system.channels, continued=resume is not None) if sinks is None else None
        given: Sequence[Sink] = () if sinks is None or callable(sinks) else _listed(sinks)
        given = given if table is None else [table]
        for sink in given:
            closing.callback(_close, sink)
        if isolate and loop == "compiled":
            raise TwipError("loop 'compiled' calls FMUs in this process: isolated ones need loop 'python'")
        limit = _time_limit(isolate, time_limit)
        asked = Algorithm(
            coupling=coupling,
            mid_step=None if mid_step is None else names("mid_step", mid_step),
            order=None if order is None else names("order", order),
            own_steps=None if own_steps is None else by_name("own_steps", own_steps),
            options={} if options is None else by_name("options", options),
            tolerance=tolerance,
            minimum_step=minimum_step,
            maximum_step=maximum_step,
        )
        request = Request(start_time, stop_time, step_size, asked, input_file, scenario, isolate)
        prepared = prepare(system, request)
        grid, plan, planned = prepared.grid, prepared.coupling, prepared.scenario
        kind = _choose_loop(loop, isolate, plan)
        if plan.control is not None:
            _refuse({"checkpoint": checkpoint, "resume": resume, "real_time": real_time})
        if live is not None:
            planned = _with_live(planned, live, checkpoint is not None or resume is not None)
        if checkpoint is None and checkpoint_every is not None:
            raise TwipError("a checkpoint interval needs a file for the checkpoint")
        resumed = None
        if resume is not None:
            if lines := cannot_be_saved(system):
                raise TwipError(lines)
            resumed = Checkpoint.read(pathlib.Path(resume))
            resumed.check(pathlib.Path(resume), identify(system, grid, plan, planned), grid, planned.inputs)
        saving = None if checkpoint is None else Saving.of(system, checkpoint, checkpoint_every, grid.step_size)
        pacer = None if real_time is None else Pacer(real_time)
        interrupted.__enter__()
        if callable(sinks):
            given = sinks(grid)
            for sink in given:
                closing.callback(_close, sink)
        for sink in given:
            if isinstance(sink, TimedSink):
                sink.check_times(grid.start, grid.stop, grid.step_size)
        state = RunState(
            system=system,
            grid=grid,
            coupling=plan,
            scenario=planned,
            delivery=Delivery(given),
            interrupted=interrupted,
            loop=kind,
            saving=saving,
            resumed=resumed,
            pacer=pacer,
            time_limit=limit,
            progress=progress or _ignore,
            notice=notice or _ignore,
            pool=pool or InstancePool(keeps=False),
            live=live,
        )
        result = execute(state)
    return dataclasses.replace(result, table=table)


def _with_live(planned: Scenario, live: LiveInputs, kept: bool) -> Scenario:
    """Return a scenario with live inputs besides, but those that its files drive; raises TwipError."""
    if kept:
        raise TwipError("a checkpoint cannot hold inputs that are set while the run goes on")
    live.leave(set(planned.inputs.columns.tolist()))
    return dataclasses.replace(planned, inputs=planned.inputs + live.series())


def _time_limit(isolate: bool, given: float | None) -> float | None:
    """Return the longest that a call may take in s; None where nothing could end it."""
    if not isolate:
        if given is not None:
            raise TwipError("a time limit needs isolated FMUs (--isolate): a call in this process cannot be stopped")
        return None
    limit = TIME_LIMIT if given is None else given
    if not (math.isfinite(limit) and limit > 0.0):
        raise TwipError(f"time limit {limit!r} s must be a positive number")
    return limit


def _choose_loop(name: str | None, isolate: bool, coupling: Coupling) -> LoopKind:
    """Return a loop by its name; None stands for the best that can run here."""
    compiles = find_spec("numba") is not None
    name = name or ("compiled" if compiles and not isolate and not coupling.repeats else "python")
    if name not in LOOPS:
        raise TwipError(f"loop {name!r} must be one of {', '.join(LOOPS)}")
    if coupling.repeats and name != "python":
        raise TwipError(f"loop {name!r} cannot repeat steps, as {coupling.repeats}: take loop 'python'")
    if name == "python":
        return LoopKind(PythonLoop, lambda: True)
    if not compiles:
        raise TwipError("loop 'compiled' needs numba, which is not installed (pip install numba)")
    with deferred_interrupt():
        module = import_module(".coupling.compiled_loop", __package__)  # numba takes its time to load
    return LoopKind(module.CompiledLoop, module.is_cached)


def _refuse(arguments: Mapping[str, object]) -> None:
    """Raise `TwipError` for what has been given and needs equal steps."""
    if given := [name.replace("_", " ") for name, value in arguments.items() if value is not None]:
        needs = "needs" if len(given) == 1 else "need"
        raise TwipError(f"{' and '.join(given)} {needs} equal steps, but with a tolerance they vary")


def _listed(sinks: Sink | Sequence[Sink]) -> Sequence[Sink]:
    return sinks if isinstance(sinks, Sequence) else [sinks]


def _ignore(_: object) -> None:
    pass


def _close(sink: Sink) -> None:
    with writing():
        sink.close()
