"""Reads the logs that a command is given, and says where one is cut off."""

import argparse
import sys
from pathlib import Path

from ...cosim import Playback
from ...cosim import read_log as read
from ...lab.remarks import cut_off


def declare_others(parser: argparse.ArgumentParser) -> None:
    """Declare the logs that one is compared with."""
    parser.add_argument(
        "--with",
        dest="others",
        nargs="+",
        action="extend",
        type=Path,
        default=[],
        metavar="LOG.mcap",
        help="logs to compare with",
    )


def declare_apart(parser: argparse.ArgumentParser, default: float) -> None:
    """Declare how far the robots of compared logs stand apart, in m."""
    parser.add_argument(
        "--apart",
        type=float,
        default=default,
        metavar="M",
        help=f"between the robots of compared logs, in m; 0 shows each where it is; default: {default:g}",
    )


def read_log(path: Path) -> Playback:
    """Return a log; that it is cut off is told on standard error. Raises TwipError when it cannot be read."""
    log = read(path)
    if text := cut_off(log):
        print(f"twip: warning: {path}: {text}", file=sys.stderr)
    return log


def extent(log: Playback) -> dict[str, object]:
    """Return for scripts how much of a run a log holds; times in s, None where there are no rows."""
    first, last = (float(log.times[i]) if len(log.times) else None for i in (0, -1))
    return {
        "start_time": log.start_time,
        "first_time": first,
        "last_time": last,
        "rows": len(log.times),
        "complete": log.complete,
        "cut_off_at": None if log.complete else last,
        "continued": log.continued,
    }
