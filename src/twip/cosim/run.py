"""One run of a checked system: instances, values, and what has been delivered."""

import contextlib
import pathlib
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from importlib.util import find_spec
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..errors import TwipError
from .checkpoint import Checkpoint, InputDigest, Saving, identify
from .component import EndRequestedError
from .coupling import Coupling
from .delivery import Delivery, writing
from .execution import Execution, vector
from .experiment import TimeGrid
from .face import InstanceFace, PortsFace
from .faults import Faults
from .initialization import initialize
from .interrupt import InterruptFlag
from .isolation import IsolatedInstance, Isolation
from .kept import awaits_compiling
from .live_inputs import LiveInputs
from .messages import Message
from .pace import Pacer
from .pool import InstancePool
from .ports import Ports
from .results import Result
from .scenario import ParameterChange, Scenario
from .schedule import Schedule, make_schedule
from .system import System
from .texts import text_of
from .variable_loop import VariableLoop
from .variable_steps import VariableSteps

CHUNK = 200
"""Most steps between two deliveries to the sinks."""


class Loop(Protocol):
    """Executes the steps of a schedule."""

    def run(
        self,
        times: NDArray[np.float64],
        step_size: float,
        inputs: NDArray[np.float64],
        rows: NDArray[np.float64],
        stop: NDArray[np.bool_],
    ) -> tuple[int, TwipError | None]:
        """Do one step per row; see `PythonLoop.run`."""


@dataclass(frozen=True)
class LoopKind:
    """A way to execute a schedule."""

    make: Callable[[Execution], Loop]
    is_ready: Callable[[], bool]
    """Tells whether it begins at once; otherwise it is compiled first."""


@dataclass
class Run:
    """One run, made of what has been checked; `execute` may be called once."""

    system: System
    grid: TimeGrid
    coupling: Coupling
    scenario: Scenario
    delivery: Delivery
    interrupted: InterruptFlag
    loop: LoopKind
    saving: Saving | None
    resumed: Checkpoint | None
    pacer: Pacer | None
    progress: Callable[[float], None]
    notice: Callable[[str], None]
    time_limit: float | None
    """Longest that a call of an FMU may take, in s, each in a process of its own; None keeps all in this process."""
    pool: InstancePool
    live: LiveInputs | None = None
    """Inputs that are set from outside; what they refuse is told in the log."""
    instances: list[InstanceFace] = field(default_factory=list)
    dead: set[pathlib.Path] = field(default_factory=set)

    def __post_init__(self) -> None:
        system, grid, self.inputs = self.system, self.grid, self.scenario.inputs
        self.first = self.steps = 0 if self.resumed is None else self.resumed.steps
        self.clock = np.array([grid.start])
        self.reached = self._time_of(self.steps)
        self.variable: VariableSteps | None = None
        driven = self.inputs.columns.tolist()
        plan = make_schedule(system, self.coupling, driven)
        in_order = self.coupling.name == "gauss-seidel" and not self.coupling.order
        self._first_pass = plan if in_order else make_schedule(system, Coupling("gauss-seidel"), driven)
        self.faults = Faults(self.scenario.faults, plan)
        self.schedule: Schedule = self.faults.schedule
        self._isolation = None if self.time_limit is None else Isolation(self.schedule, self.time_limit)
        self.values = vector(self.schedule.columns) if self._isolation is None else self._isolation.values
        self.warnings: list[str] = [*system.warnings, *self.scenario.warnings]
        if self.coupling.name != "iterated":
            for loop in self.schedule.loops:
                self.warnings.append(
                    f"algebraic loop: {loop}; under {self.coupling.name} a value in it is a step old"
                    " (iterated coupling solves it; an output that does not follow an input at once should say so by"
                    " its dependencies)"
                )
        types = [signal.type for channel in system.channels for signal in channel.signals]
        self._texts = [i for i, type_ in enumerate(types) if type_ == "String"]
        self._texts += self.faults.hidden(self._texts)
        self.delivered = self.completed = False
        self.ended = ""
        self.saved: int | None = None
        self._identity = identify(system, grid, self.coupling, self.scenario)
        self._digest = InputDigest(self.inputs, grid)

    def execute(self) -> Result:
        """Initialize, run, deliver, and free everything on the way out."""
        begin = time.perf_counter()
        for warning in self.warnings:
            self._say("warning", warning)
        try:
            try:
                execution = self._start()
                loop = None if execution is None else self._prepare(execution)
                started = time.perf_counter()
                if execution is not None and self.coupling.control is not None:
                    self._advance_freely(execution)
                elif execution is not None and loop is not None:
                    self._advance(loop, execution)
                self.completed = True
            except EndRequestedError as request:
                self.ended = str(request)
                self._say("info", self.ended)
            except TwipError as failure:
                self._say("error", str(failure))
                raise
        finally:
            stopped = time.perf_counter()
            self._free()
        interrupted = bool(self.interrupted) and self.reached < self.grid.stop
        row = [text_of(v) if i in self._texts else v for i, v in enumerate(self.values)]
        values = dict(zip(self.system.columns, row, strict=False)) if self.delivered else {}
        return Result(
            steps=self.steps - self.first,
            start_time=self._time_of(self.first),
            time=self.reached,
            step_size=self.grid.step_size,
            coupling=self.schedule.coupling,
            wall_time=stopped - started,
            setup_time=started - begin,
            interrupted=interrupted,
            ended=self.ended,
            values=values,
            warnings=tuple(self.warnings),
            checkpoint=self.saving.path if self.saving is not None and self.saved is not None else None,
            signal=self.interrupted.signal if interrupted else None,
            real_time=self.pacer.report if self.pacer is not None else None,
            iterations=0 if execution is None else execution.iterations,
            variable=self.variable,
        )

    def _time_of(self, steps: int) -> float:
        return float(self.grid.times(steps, 0)[0])

    def _say(self, level: str, text: str) -> None:
        self.delivery.messages.append(Message(self.reached, level, "", text))

    def _tell_refusals(self) -> None:
        for text in () if self.live is None else self.live.refusals():
            self._say("warning", text)

    def _start(self) -> Execution | None:
        """Bring all components to where the run begins and deliver the row there; None when interrupted before."""
        system, grid = self.system, self.grid
        folders = [system.unpacked(c.fmu, lambda why: self._say("warning", why)) for c in system.components]
        self._announce(folders)
        ports = self._instantiate(folders)
        if ports is None:
            return None
        columns = self.inputs.columns.tolist()
        first = self.inputs.at(grid.times(0, 0), grid.step_size)[0].tolist()
        self.warnings += (
            warnings := initialize(
                system,
                self._first_pass,
                self.instances,
                ports,
                self.values,
                dict(zip(columns, first, strict=True)),
                (grid.start, grid.stop),
            )
        )
        for warning in warnings:
            self._say("warning", warning)
        self.faults.initialize(np.ctypeslib.as_array(self.values))
        if self.resumed is not None:
            self._restore(self.resumed, ports)
        driven = np.concatenate([self.inputs.columns, self.faults.driven])
        execution = Execution(
            self.schedule,
            ports,
            self.values,
            driven,
            self.clock,
            self.delivery.messages,
            side_by_side=self._isolation is not None,
        )
        if self.resumed is not None:
            execution.go_on(grid, self.steps, self.resumed.samples)
        self.delivery.write(grid.times(self.steps, 0), execution.row[None, : self.faults.recorded].copy())
        self.delivered = True
        return execution

    def _instantiate(self, folders: Sequence[pathlib.Path]) -> list[PortsFace] | None:
        """Make all instances, in this process or each in its own; None when interrupted before."""
        ports: list[PortsFace] = []
        parts = list(zip(self.system.components, folders, strict=True))
        if self._isolation is not None:
            isolated: list[IsolatedInstance] = []
            for part in parts:  # the processes start side by side
                isolated.append(self._isolation.instance(*part, self.delivery.messages, self.clock))
                self.instances.append(isolated[-1])
            for each in isolated:
                if self.interrupted:
                    return None
                each.load()
            return [*isolated]
        for (component, folder), plan in zip(parts, self.schedule.components, strict=True):
            if self.interrupted:
                return None
            instance = self.pool.take(component, folder, self.delivery.messages, self.dead, self.clock)
            self.instances.append(instance)
            ports.append(Ports(plan, instance, self.values))
        return ports

    def _announce(self, folders: Sequence[pathlib.Path]) -> None:
        """Tell the user when code is going to be compiled, which takes a while."""
        what = [] if self.loop.is_ready() else ["the loop"]
        if find_spec("numba") is not None:
            first = {folder: c.fmu.name for c, folder in zip(self.system.components, folders, strict=True)}
            what += [pathlib.PurePath(name).name for folder, name in first.items() if awaits_compiling(folder)]
        if what:
            self.notice(f"compiling {', '.join(what)}: needed once per build, takes a while")

    def _restore(self, checkpoint: Checkpoint, ports: Sequence[PortsFace]) -> None:
        """Put the states of a checkpoint into the instances, and see whether they show its values again."""
        self.clock[0] = self._time_of(self.steps)
        names = self.system.columns
        saved_row = checkpoint.row.tolist()
        self.values[:] = saved_row
        self.faults.restore(checkpoint.delayed)
        for instance, port, state in zip(self.instances, ports, checkpoint.states, strict=True):
            instance.restore_state(state)
            port.read_inputs()
            port.get_outputs()
        for name, value, saved in zip(names, self.values, saved_row, strict=False):
            if value != saved:
                raise TwipError(
                    f"{name} = {value!r} after its component's state was restored from the checkpoint, where it was"
                    f" {saved!r}: the FMU does not save its whole state"
                )
        self.values[:] = saved_row
        self._say("info", f"resumed from a checkpoint at t = {self.clock[0]:.12g} s")

    def _prepare(self, execution: Execution) -> Loop:
        """Return the loop, compiled."""
        loop = self.loop.make(execution)
        times, none = self.grid.times(self.steps, 0), np.zeros((0, len(execution.driven)))
        loop.run(times, self.grid.step_size, none, np.empty((0, self.schedule.columns)), self.interrupted.array)
        return loop

    def _advance_freely(self, execution: Execution) -> None:
        """Go with variable steps from event to event: jumps and corners of the inputs, and parameter changes."""
        loop = VariableLoop(execution, self.grid, self.coupling, self.system, self.inputs)
        self.variable = loop.steps
        changes = list(self.scenario.changes)
        for until in self.grid.events(self.inputs.events() | {change.time for change in changes}):
            self.clock[0] = loop.time
            while changes and changes[0].time < loop.time + self.grid.resolution:
                self._set(changes.pop(0))
            while loop.time < until and not self.interrupted:
                times, rows, failure = loop.run(until, CHUNK, self.interrupted.array)
                self.steps += len(times)
                self.reached = loop.time
                self._tell_refusals()
                self.delivery.write(np.array(times), np.array(rows).reshape(-1, self.schedule.columns))
                self.progress(loop.time)
                if failure is not None:
                    raise failure

    def _advance(self, loop: Loop, execution: Execution) -> None:
        grid, last = self.grid, self.grid.steps
        longest = CHUNK if self.pacer is None else min(CHUNK, self.pacer.chunk(grid.step_size))
        if self.pacer is not None:
            self.pacer.start(self._time_of(self.steps))
        while self.steps < last and not self.interrupted:
            due = last if self.saving is None else self.saving.next(self.steps, last)
            self._change(execution)
            count = min(longest, self._undisturbed(due) - self.steps)
            times = grid.times(self.steps, count)
            inputs = np.hstack([self.inputs.at(times[:-1], grid.step_size), self.faults.past(count)])
            rows = np.empty((count, self.schedule.columns))  # anew for each chunk: a sink may keep it
            done, failure = loop.run(times, grid.step_size, inputs, rows, self.interrupted.array)
            self.steps += done
            self.reached = float(times[done])
            self.faults.record(rows[:done])
            if self.pacer is not None:
                self.pacer.wait(float(times[done]), self.interrupted)
            self._tell_refusals()
            self.delivery.write(times[1 : done + 1], rows[:done, : self.faults.recorded])
            self.progress(float(times[done]))
            if failure is not None:
                raise failure
            if self.steps == due:
                self._save(execution)
        if self.pacer is not None:
            self._say("info", f"real time: {self.pacer.report}")
        self._save(execution)

    def _change(self, execution: Execution) -> None:
        """Do what the scenario wants done between the last step and the next."""
        self.clock[0] = self._time_of(self.steps)
        for change in self.scenario.changes:
            if change.step == self.steps:
                self._set(change)
        for text in self.faults.begin(self.steps, execution.row):
            self._say("info", text)

    def _set(self, change: ParameterChange) -> None:
        self._say("info", str(change))
        self.instances[change.component].set_value(change.value)

    def _undisturbed(self, last: int) -> int:
        """Return after how many steps, at most `last`, the scenario wants something done again."""
        changes = (change.step for change in self.scenario.changes if change.step > self.steps)
        return self.faults.until(self.steps, min(last, *changes, last))

    def _save(self, execution: Execution) -> None:
        """Write a checkpoint, unless it is there already."""
        if self.saving is None or self.saved == self.steps:
            return
        row, samples = execution.row.copy(), execution.samples.copy()
        texts = {column: text_of(row[column]) for column in self._texts}
        row[self._texts] = 0.0
        samples[:, np.isin(self.schedule.source, self._texts)] = 0.0
        checkpoint = Checkpoint(
            self._identity,
            self.steps,
            self._digest.until(self.steps),
            row,
            samples,
            self.faults.memory,
            tuple(instance.save_state() for instance in self.instances),
            texts,
        )
        with writing():
            checkpoint.write(self.saving.path)
        self.saved = self.steps

    def _free(self) -> None:
        """Free all instances, the last first, also when interrupted once more, and deliver their last messages."""
        with contextlib.ExitStack() as closing:
            if self._isolation is not None:
                closing.callback(self._isolation.close)
            for instance in self.instances:
                closing.callback(self.pool.give_back, instance, self.completed)
        for folder in self.dead:
            self.system.forget(folder)
        self._tell_refusals()
        self.delivery.tell()
