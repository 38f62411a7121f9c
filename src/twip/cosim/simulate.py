"""Runs a checked system from start to stop and hands what happens to the sinks."""

import contextlib
import dataclasses
import pathlib
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from importlib.util import find_spec

from ..errors import TwipError
from ..interrupts import deferred_interrupt
from .coupling.coupling import Coupling
from .coupling.loop import PythonLoop
from .fmus.pool import InstancePool
from .model.algorithm import Algorithm
from .model.signals import Sink, TimedSink
from .model.system import System
from .model.time_grid import TimeGrid
from .run.checkpoint import Checkpoint, Saving, cannot_be_saved, identify
from .run.delivery import Delivery, writing
from .run.execute import execute
from .run.interrupt_flag import InterruptFlag
from .run.options import Checkpoints, Inputs, Observer, Runtime
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
    algorithm: Algorithm | None = None,
    inputs: Inputs | None = None,
    sinks: Sink | Sequence[Sink] | Callable[[TimeGrid], Sequence[Sink]] | None = None,
    runtime: Runtime | None = None,
    checkpoints: Checkpoints | None = None,
    observer: Observer | None = None,
) -> Result:
    """Run `system`; times and step in s. What is not given comes from the system's description, then from the FMUs.

    `algorithm` says how the components are coupled and whether steps vary, `inputs` what drives open inputs and
    disturbs the run, `runtime` how the steps are executed, `checkpoints` where the state of the run is saved or comes
    from, `observer` what is called on the way.

    The `sinks`, or what they return when they are a function of the time grid, called after all checks, get row 0 (the
    values at the start time), then the row of each finished step, and are closed in the end, however it comes; without
    sinks the result keeps all rows in memory. Ctrl-C (as SIGTERM and SIGHUP) ends the run between two steps; the result
    says so.

    Raises `TwipError` for bad arguments and for the failure of a component.
    """
    algorithm, inputs, runtime = algorithm or Algorithm(), inputs or Inputs(), runtime or Runtime()
    checkpoints, observer = checkpoints or Checkpoints(), observer or Observer()
    resume = checkpoints.resume
    interrupted = InterruptFlag()
    with contextlib.ExitStack() as closing:
        closing.push(interrupted)  # entered below; left when all sinks are closed
        table = Table(system.channels, continued=resume is not None) if sinks is None else None
        given: Sequence[Sink] = () if sinks is None or callable(sinks) else _listed(sinks)
        given = given if table is None else [table]
        for sink in given:
            closing.callback(_close, sink)
        if runtime.isolate and runtime.loop == "compiled":
            raise TwipError("loop 'compiled' calls FMUs in this process: isolated ones need loop 'python'")
        limit = runtime.call_limit()
        request = Request(start_time, stop_time, step_size, algorithm, inputs, runtime.isolate)
        prepared = prepare(system, request)
        grid, plan, planned = prepared.grid, prepared.coupling, prepared.scenario
        kind = _choose_loop(runtime.loop, runtime.isolate, plan)
        if plan.control is not None:
            _refuse({"checkpoint": checkpoints.file, "resume": resume, "real_time": runtime.real_time})
        if inputs.live is not None:
            planned = _with_live(planned, inputs.live, checkpoints.file is not None or resume is not None)
        if checkpoints.file is None and checkpoints.every is not None:
            raise TwipError("a checkpoint interval needs a file for the checkpoint")
        resumed = None
        if resume is not None:
            if lines := cannot_be_saved(system):
                raise TwipError(lines)
            resumed = Checkpoint.read(pathlib.Path(resume))
            resumed.check(pathlib.Path(resume), identify(system, grid, plan, planned), grid, planned.inputs)
        saving = None
        if checkpoints.file is not None:
            saving = Saving.of(system, checkpoints.file, checkpoints.every, grid.step_size)
        pacer = None if runtime.real_time is None else Pacer(runtime.real_time)
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
            progress=observer.progress or _ignore,
            notice=observer.notice or _ignore,
            pool=runtime.pool or InstancePool(keeps=False),
            live=inputs.live,
        )
        result = execute(state)
    return dataclasses.replace(result, table=table)


def _with_live(planned: Scenario, live: LiveInputs, kept: bool) -> Scenario:
    """Return a scenario with live inputs besides, but those that its files drive; raises TwipError."""
    if kept:
        raise TwipError("a checkpoint cannot hold inputs that are set while the run goes on")
    live.leave(set(planned.inputs.columns.tolist()))
    return dataclasses.replace(planned, inputs=planned.inputs + live.series())


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
