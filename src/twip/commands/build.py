"""`twip build`: the FMUs of the blocks and the SSPs of the wired systems."""

import argparse
from pathlib import Path

from ..fmi.build import build_all, build_fmi3
from ..fmi.interface import FMI_VERSIONS

DESCRIPTION = """\
examples:
  twip build
  twip build motor plant --out /tmp/robot
  twip build --fmi 3

Build the blocks' FMUs and the wired systems' SSPs, and print their paths; with --fmi 3 the blocks alone, in FMI 3.0, as
fmus/<block>_fmi3.fmu."""


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.description = DESCRIPTION
    parser.add_argument("blocks", nargs="*", help="names of blocks; default: all blocks and systems")
    parser.add_argument(
        "--out",
        type=Path,
        default=Path(),
        metavar="DIR",
        help="where fmus/ and ssp/ are written; default: the current folder",
    )
    parser.add_argument(
        "--fmi", choices=[v[0] for v in FMI_VERSIONS], default="2", help="major version of FMI; default: 2"
    )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Build, and return the exit status."""
    build = build_all if arguments.fmi == "2" else build_fmi3
    build(arguments.out, arguments.blocks or None, print)
    return 0
