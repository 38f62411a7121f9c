"""`twip view`: look at a log in Rerun, laid out."""

import argparse
import subprocess
import tempfile
from pathlib import Path

from ..lab.rerun_view import FORMATS, recording, rerun
from .logs import read_log
from .paths import made_from
from .terminal import print_rows

DESCRIPTION = """\
examples:
  twip view logs/twip.mcap
  twip view logs/twip.mcap --out twip.rrd

Look at a log in Rerun: the robot in 3D beside plots. Needs pip install 'twip[view]'.
Rerun listens on 127.0.0.1 only."""


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.description = DESCRIPTION
    parser.add_argument("log", type=Path, metavar="LOG.mcap", help="a log of twip")
    parser.add_argument(
        "--out",
        type=Path,
        metavar="FILE.rrd",
        help="write the recording, laid out, instead of opening it; default: open it",
    )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Open or write the recording, and return the exit status."""
    out = None if arguments.out is None else made_from([arguments.log], arguments.out, FORMATS)
    log = read_log(arguments.log)
    if out is not None:
        print_rows(("recording", recording(log, out)))
        return 0
    with tempfile.TemporaryDirectory(prefix="twip-view-") as folder:
        path = recording(log, Path(folder) / f"{arguments.log.stem}.rrd")
        return subprocess.run([rerun(), "--bind", "127.0.0.1", str(path)], check=False).returncode
