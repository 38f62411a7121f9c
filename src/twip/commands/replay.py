"""`twip replay`: make an FMU that plays a log."""

import argparse
import sys
from pathlib import Path

from ..cosim import ForeignLogError
from ..errors import TwipError, clear
from ..lab.endings import check_ending
from ..lab.recordings import open_log
from ..lab.replay import replay
from ..lab.replay_signals import replay_signals
from .parts.paths import refuse_clashes
from .parts.terminal import print_rows

DESCRIPTION = """\
examples:
  twip replay logs/twip.mcap --as imu.fmu
  twip replay logs/twip.mcap --as recorded_imu.fmu --component imu
  twip replay robot.mcap --list
  twip replay robot.mcap --as imu.fmu --signals pitch_rate=/imu/data.angular_velocity.y:rad/s pitch_count=/enc.ticks[0]

Make an FMU (FMI 2.0) whose outputs play what a component gave in a log of twip, or chosen signals of any robot's MCAP
file (messages in JSON, protobuf or ROS 2's CDR), for any FMI tool: an estimator or a controller then runs on recorded
data. At the times of the log it gives the recorded bits. Time 0 is the earliest message of the file."""


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.description = DESCRIPTION
    parser.add_argument("log", type=Path, metavar="LOG.mcap", help="a log of twip or another MCAP file")
    parser.add_argument(
        "--as", dest="output", type=Path, metavar="FILE.fmu", help="FMU to write; needed without --list"
    )
    what = parser.add_mutually_exclusive_group()
    what.add_argument("--component", metavar="NAME", help="whose outputs are played; default: the FMU's name")
    what.add_argument(
        "--signals",
        nargs="+",
        action="extend",
        metavar="NAME=TOPIC.FIELD[:UNIT]",
        help="outputs and what they play, for any MCAP file; elements of arrays as x[0]; with a unit it is a Real; "
        "default: the outputs of a component",
    )
    what.add_argument(
        "--list", action="store_true", help="print the signals that --signals can name, and write nothing; default: off"
    )
    parser.add_argument(
        "--linear",
        action="store_true",
        help="Real signals are linear between two rows of the log; default: held, as Integers and Booleans are",
    )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Make the FMU or list the signals, and return the exit status."""
    if arguments.list:
        return _list(arguments.log)
    output = arguments.output
    if output is None:
        raise TwipError("--as FILE.fmu must say where the FMU goes")
    check_ending(output, [".fmu"])
    refuse_clashes([("log", arguments.log)], {"--as": output})
    if arguments.signals:
        replay_signals(arguments.log, arguments.signals, output, arguments.linear)
    else:
        try:
            left_out = replay(arguments.log, arguments.component or output.stem, output, arguments.linear)
        except ForeignLogError:
            raise TwipError(
                f"{arguments.log}: it is not a log of twip, so --signals NAME=TOPIC.FIELD … must say what to play;"
                f" {open_log(arguments.log).overview()}"
            ) from None
        for missing in left_out:
            print(f"twip: warning: left out: {missing}", file=sys.stderr)
    print_rows(("replay", output))
    return 0


def _list(path: Path) -> int:
    """Print the signals of a log by topic, what cannot be read on standard error."""
    log = open_log(path)
    for topic in log.topics:
        try:
            names = log.fields(topic)
        except TwipError as error:
            print(f"twip: warning: left out: {error}", file=sys.stderr)
            continue
        print(clear(f"{topic} ({log.count(topic)} messages{'' if names else ', no numbers'})"))
        for name in names:
            print(clear(f"  {name}"))
    return 0
