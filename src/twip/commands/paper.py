"""`twip paper`: run the paper's experiments and check its claims."""

import argparse
import os
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console
from rich.progress import Progress, SpinnerColumn, TaskID, TextColumn, TimeElapsedColumn

from ..errors import TwipError
from ..lab.paper.programme import FIGURES, GROUPS, TABLES, Report, chosen, run_paper
from ..lab.paper.reports import missed, terminal_table, write_reports
from .parts.terminal import print_rows

DESCRIPTION = f"""\
examples:
  twip paper
  twip paper fig14 fig15 --out /tmp/paper
  twip paper fig07 --seeds 3 --jobs 1

Run the experiments of the paper through the robot's FMUs, draw their pictures, and compare every claim
with what was measured. The exit status is 0 only when all values are as expected.

figures: {", ".join(FIGURES)}; tables: {", ".join(TABLES)} (with figures 2 and 3)"""


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.description = DESCRIPTION
    parser.add_argument("names", nargs="*", metavar="NAME", help="figures and tables to run; default: all")
    parser.add_argument(
        "--out",
        type=Path,
        default=Path("logs") / "paper",
        metavar="DIR",
        help="where pictures, inputs/, results.md and results.json are written; default: logs/paper",
    )
    parser.add_argument(
        "--seeds",
        type=int,
        default=20,
        metavar="N",
        help="runs with different sensor noise behind every statistic; default: 20",
    )
    parser.add_argument(
        "--jobs", type=int, default=None, metavar="N", help="processes at a time; default: one per processor"
    )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Run the experiments, print and write the table, and return the exit status."""
    for option in ("seeds", "jobs"):
        count = getattr(arguments, option)
        if count is not None and count < 1:
            raise TwipError(f"--{option} {count} must be at least 1")
    jobs = arguments.jobs or min(os.cpu_count() or 1, len(GROUPS))
    begin = time.perf_counter()
    with progress(chosen(arguments.names)) as report:
        results = run_paper(arguments.names, arguments.out, arguments.seeds, jobs, report)
    page, numbers = write_reports(results, arguments.out)
    terminal = Console()
    console = terminal if terminal.is_terminal else Console(width=200)
    console.print(terminal_table(results))
    checks, failed = sum(len(timed.result.checks) for timed in results), missed(results)
    print_rows(
        ("as expected", f"{checks - len(failed)} of {checks} values"),
        ("seeds", arguments.seeds),
        ("time", f"{time.perf_counter() - begin:.0f} s"),
        ("table", page),
        ("numbers", numbers),
        ("pictures", arguments.out / "fig*.png"),
    )
    return 1 if failed else 0


@contextmanager
def progress(figures: list[str]) -> Iterator[Report]:
    """Show what runs and what is done on standard error; where that is not a terminal, a line for each figure."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield _lines
        return
    columns = (SpinnerColumn(finished_text="✓"), TextColumn("{task.description}"), TimeElapsedColumn())
    with Progress(*columns, console=console, transient=True) as bars:
        tasks: dict[str, TaskID] = {name: bars.add_task(name, start=False, total=1) for name in ("robot", *figures)}

        def report(name: str, state: str, _: float) -> None:
            if state == "running":
                bars.start_task(tasks[name])
            else:
                bars.update(tasks[name], completed=1)

        yield report


def _lines(name: str, state: str, seconds: float) -> None:
    if state == "done":
        print(f"twip: {name} done in {seconds:.0f} s", file=sys.stderr, flush=True)
