"""Runs a sweep from its plan to its Parquet file."""

import contextlib
import os
import random
import signal
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from ...cosim import System
from ...platform import END_SIGNALS
from .engine import Engine, workers
from .journal import Journal
from .known import Known
from .measures import ERROR, FAIL, PASS, Judge
from .parquet import arrow, write
from .plan import Plan, Point
from .worker import Job, Row, Task


@dataclass(frozen=True)
class Outcome:
    """What a sweep came to."""

    path: Path
    runs: int
    finished: int
    """Runs with a row, those of before a resumption included."""
    passed: int
    failed: int
    errors: int
    done_now: int
    """Runs of this call."""
    seconds: float
    """Wall time of the runs of this call, in s."""
    reuse: bool
    interrupted: bool
    journal: Path
    rows: dict[int, Row]
    points: list[Point]
    job: Job


def run_sweep(
    plan: Plan,
    out: Path,
    *,
    jobs: int | None = None,
    dask: str | None = None,
    resume: bool = False,
    shuffle: bool = False,
    progress: Callable[[int, int], None] | None = None,
    notice: Callable[[str], None] | None = None,
    check: Callable[[Known], None] | None = None,
) -> Outcome:
    """Do all runs of a plan and write the Parquet file `out`.

    `jobs` is the number of local processes (default: one per processor; 1 is this process), `dask` the address of a
    Dask scheduler whose workers do the runs instead. Finished runs are kept beside `out` until all are done; after
    Ctrl-C or a crash, `resume` does the rest. `shuffle` does the runs in a random order. None of these changes a byte
    of the result. `progress` is called with the numbers of finished runs and of all, `notice` with a sentence for the
    user. `check` is called before the first run with what will be known of the sweep, once more when a run has told the
    names of all metrics; what it raises ends the sweep.

    Raises `TwipError` with a line per problem before anything runs; a run that fails is a row with its error.
    """
    arrow("pyarrow")
    told = notice or _ignore
    systems = plan.systems()
    points = plan.points(systems)
    known = Known.of_plan(plan, points, Judge(plan.metrics, plan.success, next(iter(systems.values())).columns))
    ask = check or _ignore
    ask(known)
    description = plan.describe(systems)
    job = _job(plan, next(iter(systems.values())), None if dask is not None else os.getpid())
    tasks = [Task(p.number, p.parameter_set, p.start_values) for p in points]
    if shuffle:
        random.Random(plan.seed).shuffle(tasks)
    with interruptible(), Engine(workers(jobs), dask) as engine:
        log = Journal(out.with_name(f"{out.name}.runs"), description, resume)
        completed = False
        started = time.perf_counter()
        before = len(log.rows)
        try:
            missing = [task for task in tasks if task.number not in log.rows]
            if missing:
                told(f"trying {'the first run' if len(missing) == len(tasks) else 'a run'}")
                rehearsal = engine.rehearse(job, missing)
                job = replace(job, reuse=rehearsal.reuse)
                if rehearsal.row.error is None:
                    ask(known.with_metrics(rehearsal.row.metrics))
                else:
                    told(f"run {rehearsal.row.number} fails: {rehearsal.row.error}")
                if rehearsal.row.error is None and not rehearsal.reuse:
                    told("an FMU is not as new after a reset: every run instantiates all")
                if progress is not None:
                    progress(before, len(points))
                started = time.perf_counter()
                for rows in engine.rows(job, missing, rehearsal.seconds):
                    log.add(rows)
                    if progress is not None:
                        progress(len(log.rows), len(points))
            completed = True
        except KeyboardInterrupt:
            completed = False  # what is finished is kept
        finally:
            seconds = time.perf_counter() - started
            if not completed:
                log.close(forget=not log.rows)
        written = False
        try:
            if log.rows:
                write(out, plan, points, log.rows, description)
            written = True
        finally:
            if completed:
                log.close(forget=written)
    verdicts = [row.verdict for row in log.rows.values()]
    return Outcome(
        path=out,
        runs=len(points),
        finished=len(verdicts),
        passed=verdicts.count(PASS),
        failed=verdicts.count(FAIL),
        errors=verdicts.count(ERROR),
        done_now=len(verdicts) - before,
        seconds=seconds,
        reuse=job.reuse,
        interrupted=not completed,
        journal=log.path,
        rows=log.rows,
        points=points,
        job=job,
    )


def _job(plan: Plan, system: System, parent: int | None) -> Job:
    """Return what the workers need to know, with absolute paths."""
    files = {s.label: tuple(f.absolute() for f in (*plan.parameters, *s.files)) for s in plan.sets()}
    return Job(
        system=plan.system.absolute(),
        parameter_files=files,
        start_values=dict(plan.start_values),
        fingerprints={c.name: c.fmu.sha256 for c in system.components},
        metrics=tuple(str(Path(m).absolute()) if ".py:" in m else m for m in plan.metrics),
        success=plan.success,
        input_file=None if plan.input_file is None else plan.input_file.absolute(),
        start_time=plan.start_time,
        stop_time=plan.stop_time,
        step_size=plan.step_size,
        coupling=plan.coupling,
        parent=parent,
    )


@contextlib.contextmanager
def interruptible() -> Iterator[None]:
    """Let SIGTERM and SIGHUP end the block as Ctrl-C does."""

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    if threading.current_thread() is not threading.main_thread():
        yield
        return
    heard = [s for s in END_SIGNALS if s != signal.SIGINT and signal.getsignal(s) == signal.SIG_DFL]
    for number in heard:
        signal.signal(number, interrupt)
    try:
        yield
    finally:
        for number in heard:
            signal.signal(number, signal.SIG_DFL)


def _ignore(_: object) -> None:
    pass
