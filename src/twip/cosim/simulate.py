"""Runs a checked system from start to stop and hands what happens to the sinks."""

import contextlib
import os
import pathlib
import time
from collections.abc import Callable, Iterator, Sequence
from importlib import import_module
from importlib.util import find_spec
from typing import Any

import numpy as np

from ..errors import TwipError
from .component import Instance
from .execution import Execution, vector
from .experiment import Coupling, TimeGrid, time_grid
from .initialization import initialize
from .inputs import NO_INPUTS, InputSeries, read_inputs
from .interrupt import InterruptFlag
from .messages import Message
from .ports import Ports
from .record import Sink
from .results import Result
from .schedule import Schedule, make_schedule
from .system import System

CHUNK = 200
"""Most steps between two deliveries to the sinks."""
LOOPS = {"compiled": "compiled_loop.CompiledLoop", "python": "loop.PythonLoop"}
"""How a schedule can be executed; the first is the default where numba is installed, which takes its time to load."""


def simulate(
    system: System,
    *,
    start_time: float | None = None,
    stop_time: float | None = None,
    step_size: float | None = None,
    coupling: str | None = None,
    mid_step: Sequence[str] | None = None,
    input_file: str | os.PathLike[str] | None = None,
    sinks: Sequence[Sink] | Callable[[TimeGrid], Sequence[Sink]] = (),
    progress: Callable[[float], None] | None = None,
    loop: str | None = None,
) -> Result:
    """Run `system`; times and step in s, `coupling` `jacobi` or `gauss-seidel`.

    `mid_step` names inputs (`component.variable`) that are taken at the middle of each step, on the line through the
    source's last two values. What is not given comes from the system's description, then from the FMUs; a given
    `coupling` leaves the description's mid-step inputs aside. `input_file` is a CSV file that drives open inputs. The
    `sinks`, or what they return when they are a function of the time grid, called after all checks, get row 0 (the
    values at the start time), then the row of each finished step, and are closed in the end, however it comes.
    `progress` is called with the simulated time after each chunk. `loop` is `compiled` (the default where numba is
    installed) or `python`; the results are the same. Ctrl-C ends the run between two steps; the result says so. Raises
    `TwipError` for bad arguments and for the failure of a component.
    """
    with contextlib.ExitStack() as closing:
        given = () if callable(sinks) else sinks
        for sink in given:
            closing.callback(_close, sink)
        execute = _choose_loop(loop)
        grid = time_grid(system, start_time, stop_time, step_size)
        plan = Coupling.of(system, coupling, mid_step)
        inputs = NO_INPUTS if input_file is None else read_inputs(input_file, system)
        if callable(sinks):
            given = sinks(grid)
            for sink in given:
                closing.callback(_close, sink)
        with InterruptFlag() as interrupted:
            return _Run(system, grid, plan, inputs, given, interrupted, execute).execute(progress)


def _choose_loop(name: str | None) -> Any:
    """Return the class of a loop; None stands for the best that can run here."""
    compiles = find_spec("numba") is not None
    name = name or ("compiled" if compiles else "python")
    if name not in LOOPS:
        raise TwipError(f"loop {name!r} must be one of {', '.join(LOOPS)}")
    if name == "compiled" and not compiles:
        raise TwipError("loop 'compiled' needs numba, which is not installed (pip install numba)")
    module, _, loop = LOOPS[name].partition(".")
    return getattr(import_module(f".{module}", __package__), loop)


def _close(sink: Sink) -> None:
    with _writing():
        sink.close()


@contextlib.contextmanager
def _writing() -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise TwipError(f"{error.filename or 'the results'}: cannot be written ({error.strerror or error})") from None


class _Run:
    """One run: instances, values, and what has been delivered."""

    def __init__(
        self,
        system: System,
        grid: TimeGrid,
        coupling: Coupling,
        inputs: InputSeries,
        sinks: Sequence[Sink],
        interrupted: InterruptFlag,
        loop: Any,
    ):
        self.system = system
        self.grid = grid
        self.inputs = inputs
        self.sinks = sinks
        self.interrupted = interrupted
        self.loop = loop
        self.clock = np.array([grid.start])
        self.schedule: Schedule = make_schedule(system, coupling.name, inputs.columns.tolist(), coupling.mid_step)
        self.values = vector(self.schedule.columns)
        self.messages: list[Message] = []
        self.warnings: list[str] = list(system.warnings)
        for loop in self.schedule.loops:
            self.warnings.append(f"algebraic loop: {', '.join(f'{c}.{v}' for c, v in loop)}")
        self.instances: list[Instance] = []
        self.dead: set[pathlib.Path] = set()
        self.steps = 0
        self.delivered = False

    def execute(self, progress: Callable[[float], None] | None) -> Result:
        """Initialize, run, deliver, and free everything on the way out."""
        begin = time.perf_counter()
        for warning in self.warnings:
            self.messages.append(Message(self.grid.start, "warning", "", warning))
        try:
            try:
                ports = self._start()
                started = time.perf_counter()
                if ports is not None:
                    self._advance(ports, progress)
            except TwipError as failure:
                self.messages.append(Message(self._time, "error", "", str(failure)))
                raise
        finally:
            stopped = time.perf_counter()
            self._free()
        values = dict(zip(self.system.columns, list(self.values), strict=True)) if self.delivered else {}
        return Result(
            steps=self.steps,
            start_time=self.grid.start,
            time=self._time,
            step_size=self.grid.step_size,
            coupling=self.schedule.coupling,
            wall_time=stopped - started,
            setup_time=started - begin,
            interrupted=bool(self.interrupted) and self.steps < self.grid.steps,
            values=values,
            warnings=tuple(self.warnings),
        )

    @property
    def _time(self) -> float:
        return float(self.grid.times(self.steps, 0)[0])

    def _start(self) -> list[Ports] | None:
        """Instantiate and initialize all components and deliver row 0; None when interrupted before."""
        system = self.system
        for component in system.components:
            if self.interrupted:
                return None
            self.instances.append(
                Instance(component, system.unpacked(component.fmu), self.messages, self.dead, self.clock)
            )
        ports = [Ports(p, i, self.values) for p, i in zip(self.schedule.components, self.instances, strict=True)]
        start = self.grid.times(0, 0)
        driven = dict(
            zip(self.inputs.columns.tolist(), self.inputs.at(start, self.grid.step_size)[0].tolist(), strict=True)
        )
        order = make_schedule(system, "gauss-seidel", self.inputs.columns.tolist())
        self.warnings += (
            warnings := initialize(
                system, order, self.instances, ports, self.values, driven, (self.grid.start, self.grid.stop)
            )
        )
        self.messages += [Message(self.grid.start, "warning", "", warning) for warning in warnings]
        self._deliver(start, np.array([self.values[:]]))
        self.delivered = True
        return ports

    def _advance(self, ports: list[Ports], progress: Callable[[float], None] | None) -> None:
        loop = self.loop(Execution(self.schedule, ports, self.values, self.inputs.columns, self.clock))
        failure: TwipError | None = None
        while self.steps < self.grid.steps and failure is None and not self.interrupted:
            count = min(CHUNK, self.grid.steps - self.steps)
            times = self.grid.times(self.steps, count)
            inputs = self.inputs.at(times[:-1], self.grid.step_size)
            rows = np.empty((count, self.schedule.columns))  # anew for each chunk: a sink may keep it
            done, failure = loop.run(times, self.grid.step_size, inputs, rows, self.interrupted.array)
            self.steps += done
            self._deliver(times[1 : done + 1], rows[:done])
            if progress is not None:
                progress(float(times[done]))
        if failure is not None:
            raise failure

    def _deliver(self, times: np.ndarray, rows: np.ndarray) -> None:
        with _writing():
            for sink in self.sinks:
                if len(times):
                    sink.write(times, rows)
        self._tell()

    def _tell(self) -> None:
        messages, self.messages[:] = list(self.messages), []
        with _writing():
            for message in messages:
                for sink in self.sinks:
                    sink.event(message.time, message.level, message.source, message.text)

    def _free(self) -> None:
        """Free all instances, the last first, and deliver their last messages."""
        for instance in reversed(self.instances):
            instance.close()
        for folder in self.dead:
            self.system.forget(folder)
        self._tell()
