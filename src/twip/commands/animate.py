"""`twip animate`: draw the robot of a log as an animated picture."""

import argparse
from pathlib import Path

from ..lab.animation import APART, FORMATS, animate
from .parts.logs import declare_apart, declare_others, read_log
from .parts.paths import made_from
from .parts.terminal import print_rows

DESCRIPTION = """\
examples:
  twip animate logs/demo.mcap --from 0.8 --to 5 --out docs/stand_up.gif
  twip animate logs/twip.mcap --speed 0.25 --to 2
  twip animate logs/twip.mcap --with logs/pid.mcap --apart 0.3

Draw the moving robot and its pitch as GIF, WebP or PNG (APNG), for pages that show pictures only."""


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.description = DESCRIPTION
    parser.add_argument("log", type=Path, metavar="LOG.mcap", help="a log of the robot")
    declare_others(parser)
    declare_apart(parser, APART)
    parser.add_argument("--from", dest="start", type=float, metavar="S", help="first time in s; default: the log's")
    parser.add_argument("--to", dest="stop", type=float, metavar="S", help="last time in s; default: the log's")
    parser.add_argument("--rate", type=float, default=20.0, metavar="HZ", help="frames per second; default: 20")
    parser.add_argument("--speed", type=float, default=1.0, metavar="FACTOR", help="of the motion; default: 1")
    parser.add_argument(
        "--out",
        type=Path,
        metavar="FILE",
        help="FILE.gif, .webp or .png; default: beside the log, as .gif",
    )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Draw, and return the exit status."""
    paths = [arguments.log, *arguments.others]
    out = made_from(paths, arguments.out, FORMATS)
    logs = [read_log(path) for path in paths]
    animate(logs, out, arguments.start, arguments.stop, arguments.rate, arguments.speed, arguments.apart)
    print_rows(("picture", out), ("size", f"{out.stat().st_size / 1e3:.0f} kB"))
    return 0
