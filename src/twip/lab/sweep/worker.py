"""What a worker process does: it keeps the loaded systems and their FMU instances, and turns start values into rows.

Everything here can be sent to another process or machine; the files that a `Job` names must be there too.
"""

import contextlib
import os
import signal
import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ...cosim import Algorithm, Inputs, InstancePool, McapLog, Runtime, System, Table, Value, load, simulate
from ...errors import TwipError
from ...platform import end_now
from .measures import ERROR, Judge, MetricError

COMPARED_STEPS = 2000
"""Steps of a run after a reset that are compared with those before it."""
_WATCH_INTERVAL = 1.0
"""Time in s between two looks at whether the sweep's process still lives."""
_TRIED = 3
"""Runs that are tried, one after the other, until one succeeds and can be compared."""


@dataclass(frozen=True)
class Job:
    """What all runs of a sweep share; paths are absolute, times in s."""

    system: Path
    parameter_files: Mapping[str, tuple[Path, ...]]
    """Parameter files by parameter set."""
    start_values: Mapping[str, Value]
    fingerprints: Mapping[str, str]
    """SHA-256 of each component's FMU as the sweep began."""
    metrics: tuple[str, ...]
    success: tuple[str, ...]
    input_file: Path | None
    start_time: float | None
    stop_time: float | None
    step_size: float | None
    coupling: str | None
    parent: int | None = None
    """The sweep's process, with which local workers end; None on a cluster."""
    reuse: bool = False
    """Whether instances are reset for the next run."""


@dataclass(frozen=True)
class Task:
    """One run."""

    number: int
    parameter_set: str
    start_values: dict[str, Value]


@dataclass(frozen=True)
class Row:
    """What came out of a run."""

    number: int
    verdict: str
    error: str | None
    metrics: dict[str, float | None]


@dataclass(frozen=True)
class Batch:
    """Rows of finished runs, fewer than asked for if a signal ended them."""

    rows: list[Row]
    signal: int | None = None


class SignalledError(Exception):
    """A signal, by its number, has ended a run."""

    def __init__(self, number: int):
        super().__init__(number)
        self.number = number


@dataclass(frozen=True)
class Rehearsal:
    """What is known before the sweep begins."""

    seconds: float
    """Wall time of one run once everything is compiled, in s."""
    reuse: bool
    """Whether a run is the same, bit for bit, on new instances and on ones that were reset after another run."""
    row: Row
    """The run that was tried last."""


class Session:
    """The loaded systems and instances of a job in one process."""

    def __init__(self, job: Job):
        self.job = job
        self._systems: dict[str, System] = {}
        self._pool = InstancePool(job.reuse)
        first = self._base(next(iter(job.parameter_files)))
        self.judge = Judge(job.metrics, job.success, first.columns)

    def _base(self, label: str) -> System:
        if label not in self._systems:
            job = self.job
            system = load(job.system, parameters=job.parameter_files[label], start_values=job.start_values)
            for component in system.components:
                if component.fmu.sha256 != job.fingerprints[component.name]:
                    raise TwipError(f"{component.name}: {component.fmu.name} is another one than when the sweep began")
            self._systems[label] = system
        return self._systems[label]

    def varied(self, task: Task) -> System:
        """Return the system of a run."""
        return self._base(task.parameter_set).with_start_values(task.start_values)

    def table(self, task: Task, stop_time: float | None = None) -> Table:
        """Do a run. Raises `TwipError` for its failure and `SignalledError` if a signal ended it."""
        system, job = self.varied(task), self.job
        table = Table(system.channels)
        result = simulate(
            system,
            start_time=job.start_time,
            stop_time=job.stop_time if stop_time is None else stop_time,
            step_size=job.step_size,
            algorithm=Algorithm(coupling=job.coupling),
            inputs=Inputs(file=job.input_file),
            sinks=[table],
            runtime=Runtime(pool=self._pool),
        )
        if result.interrupted:
            raise SignalledError(result.signal or signal.SIGINT)
        return table

    def row(self, task: Task) -> Row:
        """Do a run and judge it; whatever fails is told by the row. Raises `SignalledError`."""
        try:
            metrics = self.judge.metrics(self.table(task))
            return Row(task.number, self.judge.verdict(metrics), None, metrics)
        except TwipError as error:
            return Row(task.number, ERROR, _line(error), {})

    def close(self) -> None:
        """Free the instances."""
        self._pool.close()


_session: Session | None = None
_watched = False
_turn = threading.Lock()  # a cluster's worker may have several threads, and FMUs are loaded in one working directory


def _session_of(job: Job) -> Session:
    """Return the session of the job in this process; that of another job is closed."""
    global _session
    if job.parent is not None:
        end_with(job.parent)
    if _session is None or _session.job != job:
        if _session is not None:
            _session.close()
        _session = None
        _session = Session(job)
    return _session


def end_with(parent: int) -> None:
    """Let this process end soon after the process `parent` that started it: joblib's would wait for minutes."""
    global _watched
    if _watched or os.getpid() == parent:
        return
    _watched = True

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(_WATCH_INTERVAL)
        end_now()

    threading.Thread(target=watch, daemon=True).start()


def run_tasks(job: Job, tasks: Sequence[Task]) -> Batch:
    """Do some runs, until a signal comes."""
    rows: list[Row] = []
    with _turn:
        session = _session_of(job)
        try:
            for task in tasks:
                rows.append(session.row(task))
        except SignalledError as error:
            return Batch(rows, error.number)
    return Batch(rows)


def rehearse(job: Job, tasks: Sequence[Task]) -> Rehearsal:
    """Try the first runs: they compile what has to be, show what the metrics give, and whether reset instances do.

    Raises `TwipError` when the metrics cannot be computed, and `SignalledError`.
    """
    with _turn, contextlib.closing(Session(replace(job, reuse=True))) as session:
        row = Row(0, ERROR, "no run", {})
        for task in tasks[:_TRIED]:
            try:
                table = session.table(task)
                metrics = session.judge.metrics(table)
                row = Row(task.number, session.judge.verdict(metrics), None, metrics)
            except MetricError as error:
                raise TwipError(f"{error} (run {task.number})") from None
            except TwipError as error:
                row = Row(task.number, ERROR, _line(error), {})
                continue
            begin = time.perf_counter()
            same = _same_after_reset(session, task, (tasks[-1], tasks[len(tasks) // 2], task), table)
            return Rehearsal(_seconds(table, time.perf_counter() - begin), same, row)
        return Rehearsal(1.0, False, row)


def _same_after_reset(session: Session, task: Task, others: Sequence[Task], before: Table) -> bool:
    """Tell whether a run that follows the first of the others that succeeds, on reset instances, equals `before`."""
    times = before.times
    stop = float(times[min(len(times) - 1, COMPARED_STEPS)])
    for other in others:
        with contextlib.suppress(TwipError):
            session.table(other, stop)
            break
    try:
        after = session.table(task, stop)
    except TwipError:
        return False
    return np.array_equal(after.values, before.values[: len(after.times)])


def _seconds(table: Table, measured: float) -> float:
    """Return the wall time of a whole run from that of the two shorter ones."""
    steps = max(1, len(table.times) - 1)
    return measured * steps / (2 * min(steps, COMPARED_STEPS))


def record(job: Job, task: Task, log: Path, metadata: Mapping[str, Mapping[str, str]], failure: str | None) -> None:
    """Do a run again and write its full log; that of a run with a `failure` ends with it.

    Raises `TwipError` for a log that cannot be written, and for a run that fails in another way than it did.
    """
    with _turn, contextlib.closing(Session(job)) as session:
        system = session.varied(task)
        told = {**system.provenance(), **{name: dict(entries) for name, entries in metadata.items()}}
        try:
            simulate(
                system,
                start_time=job.start_time,
                stop_time=job.stop_time,
                step_size=job.step_size,
                algorithm=Algorithm(coupling=job.coupling),
                inputs=Inputs(file=job.input_file),
                sinks=lambda grid: [McapLog(log, system.channels, told, start_time=grid.start)],
            )
        except TwipError as error:
            if _line(error) != failure:
                raise TwipError(f"run {task.number}: its log is not kept: {_line(error)}") from None


def _line(error: TwipError) -> str:
    return "; ".join(map(str, error.problems))
