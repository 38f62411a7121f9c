"""`twip identify`: friction and inertia of a motor from bench data."""

import argparse
import sys
from pathlib import Path

from ..errors import TwipError
from ..lab.identification.campaign import SIDES, run_campaign
from ..lab.identification.columns import UNITS, Columns
from ..lab.identification.identify import Identification, identify
from ..lab.identification.parameter_set import bench_parameters, robot_parameters, write
from ..lab.identification.reading import read_data
from ..lab.identification.recording import Recording
from ..lab.identification.report import notes, table
from ..lab.identification.steady import SteadySamples
from ..robot import value
from .parts.terminal import notice

DESCRIPTION = """\
examples:
  twip identify --bench DIR
  twip identify bench.csv --side left --zero 4 --out left.ssv
  twip identify stairs.mcap run_up.mcap slow.mcap --side right --zero 4 --out right.ssv
  twip identify mine.csv --side left --time t:ms --current I:mA --count enc --encoder-resolution 1024
  twip identify robot.mcap --side left --current /motor.current:mA --count /joints.ticks[0]
  twip identify samples.csv --side left --speed n:rpm
  twip run ssp/twip.ssp --parameters left.ssv right.ssv

Identify one motor's friction (per direction) and the inertia on its shaft from bench data, print a table
with 95 % intervals, and write a parameter set. Data: CSV, or MCAP (logs of twip, or of
any robot in JSON, protobuf or ROS 2's CDR, columns then named topic.field); time series of the motor's
current and encoder count (or speed), equally spaced rows; all files of one call are about one motor. A CSV
file without time column holds steady samples, one per row. A parameter that the data cannot tell is
reported as such and not written.

exit status: 0 identified; 1 a mistake, or data without any steady sample; with --bench also 1 if the result
reproduces a held-out run no better than the nominal parameters.
"""


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.description = DESCRIPTION
    parser.add_argument("data", nargs="*", type=Path, metavar="DATA", help="CSV or MCAP files about one motor")
    parser.add_argument("--side", choices=SIDES, help="which motor the data are about; needed with DATA")
    parser.add_argument(
        "--out", type=Path, metavar="FILE.ssv", help="parameter set for the robot, ssp/twip.ssp; default: none"
    )
    parser.add_argument(
        "--bench-out", type=Path, metavar="FILE.ssv", help="parameter set for the bench, ssp/bench.ssp; default: none"
    )
    for quantity, usual in (
        ("time", "time or t"),
        ("current", "current, sensor.current or motor.current"),
        ("speed", "speed, shaft_speed or bench.shaft_speed; of the motor's shaft; encoder counts are preferred to it"),
        ("count", "encoder_count, count, sensor.encoder_count or motor.encoder_count"),
    ):
        units = ", ".join(UNITS[quantity])
        parser.add_argument(
            f"--{quantity}", metavar="NAME[:UNIT]", help=f"column in {units}; default unit the first; default: {usual}"
        )
    parser.add_argument(
        "--zero",
        type=float,
        default=0.0,
        metavar="S",
        help="the motor is switched off for this time at the beginning of each file, in s; its mean current there is "
        "the sensor's zero and is subtracted; default: 0, no correction",
    )
    for name, unit, what in (
        ("torque_constant", "N.m/A", "torque constant of the motor"),
        ("encoder_resolution", "1", "counts per revolution of the motor's shaft"),
        ("gear_ratio", "1", "motor revolutions per wheel revolution"),
    ):
        parser.add_argument(
            f"--{name.replace('_', '-')}",
            type=float,
            default=value(name),
            metavar="NUMBER",
            help=f"{what} in {unit}; default: %(default)g",
        )
    parser.add_argument(
        "--rotor-inertia",
        type=float,
        default=value("rotor_inertia") + value("gear_inertia"),
        metavar="NUMBER",
        help="inertia of rotor and gear on the motor's shaft in kg.m2, which tells the wheel's from the rest; "
        "default: %(default)g",
    )
    parser.add_argument(
        "--bench",
        type=Path,
        metavar="DIR",
        help="simulate the bench experiments of both sides in DIR through the bench and motor FMUs, for a robot that "
        "differs from the nominal one, identify it from the logs, and compare on a held-out run",
    )
    parser.add_argument(
        "--seed", type=int, default=1, metavar="N", help="with --bench: which robot, and which noise; default: 1"
    )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Identify and return the exit status."""
    if arguments.bench is not None:
        if arguments.data:
            raise TwipError("--bench makes its own data: give either DATA or --bench DIR")
        return run_bench(arguments)
    if not arguments.data:
        raise TwipError("there are no data: name CSV or MCAP files, or --bench DIR")
    if arguments.side is None:
        raise TwipError("--side left or --side right must say which motor the data are about")
    for name in ("torque_constant", "encoder_resolution", "gear_ratio"):
        if not 0.0 < getattr(arguments, name) < float("inf"):
            raise TwipError(f"--{name.replace('_', '-')} {getattr(arguments, name):g} must be positive")
    found = _identify(arguments)
    print(table(arguments.side, found))
    print("\n".join(notes(found)))
    if arguments.out is not None:
        parameters = robot_parameters({arguments.side: found}, arguments.gear_ratio, arguments.rotor_inertia)
        write(arguments.out, f"identified_{arguments.side}", parameters)
        print(f"{len(parameters)} parameters of the robot in {arguments.out}")
        if found.inertia.identifiable and "plant.wheel_inertia" not in parameters:
            print(
                "twip: warning: the inertia is below that of rotor and gear, no wheel inertia is written",
                file=sys.stderr,
            )
    if arguments.bench_out is not None:
        parameters = bench_parameters(found)
        write(arguments.bench_out, f"identified_{arguments.side}_bench", parameters)
        print(f"{len(parameters)} parameters of the bench in {arguments.bench_out}")
    return 0


def _identify(arguments: argparse.Namespace) -> Identification:
    """Read the files and identify the motor."""
    given = {q: getattr(arguments, q) for q in UNITS if getattr(arguments, q) is not None}
    data = [read_data(path, Columns(given), arguments.encoder_resolution, arguments.zero) for path in arguments.data]
    recordings = [item for item in data if isinstance(item, Recording)]
    samples = [item for item in data if isinstance(item, SteadySamples)]
    return identify(recordings, arguments.torque_constant, samples)


def run_bench(arguments: argparse.Namespace) -> int:
    """Simulate the bench campaign and return the exit status."""
    reports, path = run_campaign(arguments.bench, arguments.seed, notice)
    for report in reports:
        print(report.text())
        print()
    print(f"robot's parameter set: {path}")
    return 0 if all(report.better for report in reports) else 1
