"""`twip replay`: recorded signals as an FMU."""

import argparse
import sys
from pathlib import Path

from ..lab.replay import replay
from .paths import refuse_clashes
from .terminal import print_rows

DESCRIPTION = """\
examples:
  twip replay logs/twip.mcap --as imu.fmu
  twip replay logs/twip.mcap --as recorded_imu.fmu --component imu

Make an FMU (FMI 2.0) whose outputs play what a component gave in a log, for any FMI tool: an estimator or a controller
then runs on recorded data. At the steps of the log it gives the recorded bits."""


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.description = DESCRIPTION
    parser.add_argument("log", type=Path, metavar="LOG.mcap", help="a log of twip")
    parser.add_argument("--as", dest="output", type=Path, required=True, metavar="FILE.fmu", help="FMU to write")
    parser.add_argument("--component", metavar="NAME", help="whose outputs are played; default: the FMU's name")
    parser.add_argument(
        "--linear",
        action="store_true",
        help="Real signals are linear between two rows of the log; default: held, as Integers and Booleans are",
    )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Make the FMU, and return the exit status."""
    refuse_clashes([("log", arguments.log)], {"--as": arguments.output})
    component = arguments.component or arguments.output.stem
    for missing in replay(arguments.log, component, arguments.output, arguments.linear):
        print(f"twip: left out: {missing}", file=sys.stderr)
    print_rows(("replay", arguments.output))
    return 0
