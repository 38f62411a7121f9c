"""Builds fmus/*.fmu and ssp/*.ssp in place: `python build_fmus.py`, or some: `python build_fmus.py plant imu`."""

import argparse
import sys
from pathlib import Path

from twip.errors import TwipError
from twip.fmi.build import build_all


def main() -> int:
    """Build what the command line names and print each finished file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("block", nargs="*", help="block to build (default: all), with the systems that contain it")
    arguments = parser.parse_args()
    try:
        build_all(Path(__file__).parent, arguments.block or None, print)
    except TwipError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
