"""`twip stability`: where the controller stands although its model is wrong."""

import argparse
from pathlib import Path

from ..lab.stability_report import report
from .parts.progress import progress_bar
from .parts.terminal import print_rows

DESCRIPTION = """\
examples:
  twip stability
  twip stability --out docs

Try the sliding-mode loops over epsilon on robots whose mass, centre of gravity, friction or inertia is not the
controller's, compare with the paper's conditions (58) and (63), and write two pictures. Takes about two minutes."""


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.description = DESCRIPTION
    parser.add_argument(
        "--out",
        type=Path,
        default=Path("logs"),
        metavar="DIR",
        help="where stability.png and stability_drift.png are written; default: logs",
    )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Run the study, print its tables, and return the exit status."""
    with progress_bar("trying", 1.0, "of all") as progress:
        lines = report(arguments.out, progress)
    print("\n".join(lines))
    pictures = ("stability.png", "stability_drift.png")
    print_rows(*(("picture", arguments.out / name) for name in pictures))
    return 0
