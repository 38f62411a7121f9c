"""Where the runs are done: in this process, in local processes, or on a Dask cluster, all through joblib.

A process that dies takes with it what it was doing. The runs that were under way then are done again one by one, each
alone, so that the one that kills its process is known.
"""

import contextlib
import re
import signal
from collections.abc import Iterator, Sequence
from concurrent.futures import BrokenExecutor
from importlib import import_module
from typing import Any

from ...errors import TwipError
from ...extras import optional
from ...platform import processors
from .measures import ERROR
from .worker import Batch, Job, Rehearsal, Row, SignalledError, Task, rehearse, run_tasks

RUNS_PER_WORKER = {True: 5000, False: 300}
"""Runs after which processes are replaced, by whether instances are reused: pythonfmu leaks about 0.4 kB at each reset
and 15 kB at each instantiation (measured, see docs/sweep.md).
"""
BATCH_TIME = 1.0
"""Wall time in s that the runs sent to a worker together should take."""
_CONNECT = 10
"""Time in s to reach a scheduler and its first worker."""


def workers(asked: int | None) -> int:
    """Return the number of local processes: as asked, else one per processor this process may use."""
    if asked is not None and asked < 1:
        raise TwipError(f"jobs = {asked} must be at least 1")
    return asked or processors()


class Engine:
    """Does the runs of one job; a context manager. Raises `TwipError` where it cannot begin."""

    def __init__(self, jobs: int, dask: str | None = None):
        """`jobs` local processes, this one if it is 1; or the workers of the Dask scheduler at an address."""
        self._joblib = optional("joblib", "a sweep")
        self._jobs = jobs
        self._client: Any = None
        if dask is not None:
            self._connect(dask)
        self._failures = _failures(self._client is not None)

    def _connect(self, address: str) -> None:
        distributed = optional("distributed", "a sweep on a cluster")
        try:
            self._client = distributed.Client(address, timeout=_CONNECT, set_as_default=True)
            self._client.wait_for_workers(1, timeout=_CONNECT)
        except (OSError, TimeoutError, ValueError) as error:
            if self._client is not None:
                self._client.close()
                raise TwipError(f"the Dask scheduler {address} has no workers after {_CONNECT} s") from None
            reason = " ".join(str(error).split()) or type(error).__name__
            raise TwipError(f"the Dask scheduler {address} cannot be reached: {reason}") from None
        self._jobs = max(2, sum(self._client.nthreads().values()))

    def rehearse(self, job: Job, tasks: Sequence[Task]) -> Rehearsal:
        """Try the first runs where all will be done; see `worker.rehearse`. A run that ends its process is left out."""
        few = [*tasks[:3], *tasks[len(tasks) // 2 :][:1], *tasks[-1:]]
        reason = ""
        for tried in (few, few[:1]):
            try:
                return next(iter(self._calls(rehearse, job, [tried])))  # type: ignore[no-any-return]
            except SignalledError:
                raise KeyboardInterrupt from None
            except self._failures as error:
                reason = f"its process ended: {_reason(error)}"
        return Rehearsal(BATCH_TIME, False, Row(few[0].number, ERROR, reason, {}))

    def rows(self, job: Job, tasks: Sequence[Task], seconds: float) -> Iterator[list[Row]]:
        """Do the runs, each of which takes about `seconds` s, and give their rows as they come."""
        size = int(max(1, min(BATCH_TIME / max(seconds, 1e-6), len(tasks) / (8 * self._jobs))))
        missing = {task.number: task for task in tasks}
        while missing:
            rest = list(missing.values())
            limit = len(rest) if self._local_limit(job) is None else self._local_limit(job)
            begun: dict[int, Task] = {}
            batches = _begin([rest[i : i + size] for i in range(0, len(rest[:limit]), size)], begun)
            try:
                for batch in self._calls(run_tasks, job, batches):
                    for row in batch.rows:
                        missing.pop(row.number)
                    yield batch.rows
                    self._heed(batch)
            except self._failures:
                for row in self._one_by_one(job, [t for t in begun.values() if t.number in missing]):
                    missing.pop(row.number)
                    yield [row]
            else:
                self._renew()

    def _one_by_one(self, job: Job, tasks: Sequence[Task]) -> Iterator[Row]:
        """Do runs of which one has ended its process."""
        for task in tasks:
            try:
                batch = next(iter(self._calls(run_tasks, job, [[task]])))
                self._heed(batch)
                yield from batch.rows
            except self._failures as error:
                yield Row(task.number, ERROR, f"its process ended: {_reason(error)}", {})

    def _heed(self, batch: Batch) -> None:
        """Stop as the user wants; what ended only a worker's runs (SIGTERM to it) leaves them to be done again."""
        if batch.signal == signal.SIGINT or (batch.signal is not None and self._client is None and self._jobs == 1):
            raise KeyboardInterrupt

    def _calls(self, function: Any, job: Job, batches: Any) -> Iterator[Any]:
        options = {"return_as": "generator_unordered", "batch_size": 1, "pre_dispatch": "2*n_jobs"}
        backend = "loky" if self._client is None else "dask"
        with self._joblib.parallel_config(backend=backend, n_jobs=self._jobs):
            results = self._joblib.Parallel(**options)(self._joblib.delayed(function)(job, b) for b in batches)
            with contextlib.closing(results):
                yield from results

    def _local_limit(self, job: Job) -> int | None:
        """Return after how many runs the processes are replaced; None where they are not ours."""
        return None if self._client is not None or self._jobs == 1 else self._jobs * RUNS_PER_WORKER[job.reuse]

    def _renew(self) -> None:
        """Let local processes go; the next runs begin in new ones."""
        if self._client is None and self._jobs > 1:
            import_module("joblib.externals.loky").get_reusable_executor().shutdown(wait=True)

    def __enter__(self) -> "Engine":
        return self

    def __exit__(self, *_: object) -> None:
        if self._client is not None:
            with contextlib.suppress(Exception):  # a scheduler that is gone cannot be told
                self._client.close()
        else:
            self._renew()


def _begin(batches: Sequence[list[Task]], begun: dict[int, Task]) -> Iterator[list[Task]]:
    """Give the batches one after the other and note what has been given."""
    for batch in batches:
        begun.update((task.number, task) for task in batch)
        yield batch


def _failures(cluster: bool) -> tuple[type[BaseException], ...]:
    """Return what is raised when a process ends."""
    return (BrokenExecutor, import_module("distributed").KilledWorker) if cluster else (BrokenExecutor,)


def _reason(error: BaseException) -> str:
    signals = re.findall(r"\bSIG[A-Z]+", str(error))
    return f"killed by {signals[0]}" if signals else "a crash, or killed for its memory"
