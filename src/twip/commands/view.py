"""`twip view`: look at a log in Rerun: the robot in 3D beside plots."""

import argparse
import subprocess
import tempfile
from pathlib import Path

from ..lab.rerun_view import APART, FORMATS, recording, rerun
from .parts.logs import declare_apart, declare_others, read_log
from .parts.paths import made_from
from .parts.terminal import print_rows

DESCRIPTION = """\
examples:
  twip view logs/twip.mcap
  twip view logs/twip.mcap --out twip.rrd
  twip view logs/twip.mcap --with logs/pid.mcap --apart 0.4

Look at a log in Rerun: the robot in 3D beside plots. Needs pip install -e '.[view]'.
Rerun listens on 127.0.0.1 only."""


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.description = DESCRIPTION
    parser.add_argument("log", type=Path, metavar="LOG.mcap", help="a log of twip")
    declare_others(parser)
    declare_apart(parser, APART)
    parser.add_argument(
        "--out",
        type=Path,
        metavar="FILE.rrd",
        help="write the recording, laid out, instead of opening it; default: open it",
    )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Open or write the recording, and return the exit status."""
    paths = [arguments.log, *arguments.others]
    out = None if arguments.out is None else made_from(paths, arguments.out, FORMATS)
    logs = [read_log(path) for path in paths]
    if out is not None:
        print_rows(("recording", recording(logs, out, arguments.apart)))
        return 0
    with tempfile.TemporaryDirectory(prefix="twip-view-") as folder:
        path = recording(logs, Path(folder) / f"{arguments.log.stem}.rrd", arguments.apart)
        return subprocess.run([rerun(), "--bind", "127.0.0.1", str(path)], check=False).returncode
