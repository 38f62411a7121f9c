"""Runs the figures' modules, some at a time, each group of figures that share runs in one process."""

import signal
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory

from ...errors import TwipError
from ...fmi import build_all
from ...interrupts import deferred_interrupt
from ...outputs import make_writable
from ...platform import unblock
from . import fig02, fig03, fig04, fig07, fig08, fig10, fig11, fig12, fig13, fig14, fig15, fig16, fig18, fig19
from .checks import Result
from .laboratory import Experiment, Laboratory

FIGURES: Mapping[str, Callable[[Laboratory], Result]] = {
    "fig02": fig02.run,
    "fig03": fig03.run,
    "fig04": fig04.run,
    "fig07": fig07.run,
    "fig08": fig08.run,
    "fig10": fig10.run,
    "fig11": fig11.run,
    "fig12": fig12.run,
    "fig13": fig13.run,
    "fig14": fig14.run,
    "fig15": fig15.run,
    "fig16": fig16.run,
    "fig18": fig18.run,
    "fig19": fig19.run,
}
"""What runs each figure of the paper; the others show no experiment."""
TABLES: Mapping[str, str] = {"table1": "fig02", "table2": "fig02", "table3": "fig03", "table4": "fig03"}
"""The figure whose module fills a table of the paper."""
GROUPS = (
    ("fig14", "fig15"),
    ("fig02", "fig03", "fig04"),
    ("fig08",),
    ("fig18",),
    ("fig16",),
    ("fig07", "fig10", "fig11", "fig12"),
    ("fig13",),
    ("fig19",),
)
"""Figures that share runs, the longest first, so that the processes end at about the same time."""
Report = Callable[[str, str, float], None]
"""Is told a figure's name, `running` or `done`, and the time in s that it took."""


@dataclass(frozen=True)
class Timed:
    """The result of a figure and the time that it took, in s."""

    result: Result
    seconds: float


def chosen(names: Sequence[str]) -> list[str]:
    """Return the figures that `names` stand for, in order; all without names. Raises TwipError for an unknown name."""
    figures = [TABLES.get(name, name) for name in names]
    unknown = [name for name in figures if name not in FIGURES]
    if unknown:
        raise TwipError(f"no experiment {', '.join(unknown)}; there are {', '.join((*FIGURES, *TABLES))}")
    return [name for name in FIGURES if name in figures or not figures]


def run_paper(names: Sequence[str], out: Path, seeds: int, jobs: int, report: Report) -> list[Timed]:
    """Build the robot, run figures in `jobs` processes at a time and return their results in the paper's order.

    Pictures and input series are written to `out`; `seeds` runs stand behind every statistic. Raises TwipError, before
    anything runs, for an unknown name and when nothing can be written to `out`.
    """
    figures = chosen(names)
    make_writable(out)
    groups = [[name for name in group if name in figures] for group in GROUPS]
    with TemporaryDirectory(prefix="twip-paper-") as folder:
        report("robot", "running", 0.0)
        begin = time.perf_counter()
        build_all(Path(folder))
        laboratory = Laboratory(Path(folder), out, seeds)
        laboratory.run(Experiment(0.01))  # the blocks are compiled once, not by every process
        report("robot", "done", time.perf_counter() - begin)
        work = _in_turn if jobs == 1 else _side_by_side
        done = {timed.result.name: timed for timed in work(laboratory, [g for g in groups if g], jobs, report)}
    return [done[name] for name in figures]


def run_figure(laboratory: Laboratory, name: str) -> Timed:
    """Run one figure."""
    begin = time.perf_counter()
    result = FIGURES[name](laboratory)
    return Timed(result, time.perf_counter() - begin)


def _run_group(laboratory: Laboratory, group: Sequence[str]) -> list[Timed]:
    """Run figures in a process of the pool; only while it does does Ctrl-C mean it."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        return [run_figure(laboratory, name) for name in group]
    finally:
        signal.signal(signal.SIGINT, signal.SIG_IGN)


def _wait_for_work() -> None:
    """Leave Ctrl-C to the process that waits for this one, which ends it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    unblock(signal.SIGINT)


def _in_turn(laboratory: Laboratory, groups: Sequence[Sequence[str]], _: int, report: Report) -> Iterator[Timed]:
    for name in (name for group in groups for name in group):
        report(name, "running", 0.0)
        timed = run_figure(laboratory, name)
        report(name, "done", timed.seconds)
        yield timed


def _side_by_side(
    laboratory: Laboratory, groups: Sequence[Sequence[str]], jobs: int, report: Report
) -> Iterator[Timed]:
    """Run each group in a process; new interpreters, for embedded Python and compiled code do not survive a fork."""
    pool = ProcessPoolExecutor(jobs, mp_context=get_context("spawn"), initializer=_wait_for_work)
    waiting, running = list(groups), set[Future[list[Timed]]]()
    try:
        while waiting or running:
            while waiting and len(running) < jobs:
                group = waiting.pop(0)
                with deferred_interrupt():  # a process that begins here inherits this until it is ready
                    running.add(pool.submit(_run_group, laboratory, group))
                for name in group:
                    report(name, "running", 0.0)
            finished, running = wait(running, return_when=FIRST_COMPLETED)
            for timed in (timed for future in finished for timed in future.result()):
                report(timed.result.name, "done", timed.seconds)
                yield timed
    finally:
        pool.shutdown(wait=True, cancel_futures=True)
