"""`twip demo`: build the robot and stand it up from 27 degrees."""

import argparse
from pathlib import Path

from ..interrupts import INTERRUPTED
from ..lab.demo import demo
from .parts.progress import progress_bar
from .parts.terminal import notice, print_json, print_rows

DESCRIPTION = """\
examples:
  twip demo
  twip demo --out /tmp/robot

Build the robot, stand it up from 27 degrees, print a summary, and write log and picture.
The exit status is 0 only when the robot balances."""


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.description = DESCRIPTION
    parser.add_argument(
        "--out",
        type=Path,
        default=Path(),
        metavar="DIR",
        help="where fmus/, ssp/ and logs/ are written; default: the current folder",
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object instead of text, for scripts")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Run the demonstration, and return the exit status."""
    with progress_bar("standing up", 10.0, "s") as progress:
        report = demo(arguments.out, progress, notice)
    if arguments.json:
        print_json(
            {
                "verdict": dict(report.rows)["verdict"],
                "balanced": report.balanced,
                "interrupted": report.interrupted,
                "metrics": report.metrics,
                "log": report.log,
                "picture": report.picture,
            }
        )
    else:
        print_rows(*report.rows)
    if report.interrupted:
        return INTERRUPTED
    return 0 if report.balanced else 1
