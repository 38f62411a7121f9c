"""`twip build`: the FMUs of the blocks and the SSPs of the wired systems."""

import argparse
from pathlib import Path

from ..fmi.build import build_all

DESCRIPTION = """\
examples:
  twip build
  twip build motor plant --out /tmp/robot

Build the blocks' FMUs and the wired systems' SSPs, and print their paths."""


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
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Build, and return the exit status."""
    build_all(arguments.out, arguments.blocks or None, print)
    return 0
