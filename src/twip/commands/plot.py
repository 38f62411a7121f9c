"""`twip plot`: draw signals of a log, for papers."""

import argparse
from pathlib import Path

from ..lab.plot import FORMATS, plot
from .parts.logs import declare_others, read_log
from .parts.paths import made_from
from .parts.terminal import print_rows

DESCRIPTION = """\
examples:
  twip plot logs/twip.mcap
  twip plot logs/twip.mcap plant.pitch estimator.pitch --degrees --out pitch.pdf
  twip plot logs/twip.mcap 'imu.*' --out imu.svg
  twip plot logs/twip.mcap plant.pitch --with logs/pid.mcap --out compared.png

Draw signals of a log with matplotlib, those of one component and unit in one panel."""


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.description = DESCRIPTION
    parser.add_argument("log", type=Path, metavar="LOG.mcap", help="a log of twip")
    parser.add_argument(
        "signals",
        nargs="*",
        metavar="SIGNAL",
        help="component.variable, * and ? stand for any text and letter; default: the usual panels",
    )
    declare_others(parser)
    parser.add_argument("--degrees", action="store_true", help="draw the given signals in ° where the log has rad")
    parser.add_argument(
        "--out", type=Path, metavar="FILE", help="FILE.png, .svg or .pdf; default: beside the log, with the ending .png"
    )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Draw, and return the exit status."""
    logs = [arguments.log, *arguments.others]
    out = made_from(logs, arguments.out, FORMATS)
    plot([read_log(log) for log in logs], out, arguments.signals, arguments.degrees)
    print_rows(("plot", out))
    return 0
