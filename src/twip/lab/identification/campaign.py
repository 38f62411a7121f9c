"""A whole bench campaign in simulation: build, run, log, identify both sides, and try the result on a held-out run."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...fmi import build_all
from ...robot import value
from .columns import Columns
from .experiments import (
    FRICTION_NAMES,
    ZERO_TIME,
    Bench,
    held_out,
    low_speeds,
    motor_values,
    run_up,
    speed_error,
    staircase,
)
from .identify import Identification, identify
from .parameter_set import bench_parameters, robot_parameters, write
from .reading import read_data
from .recording import Recording
from .report import notes, table
from .sensor import Sensor

SIDES = ("left", "right")
LARGEST_CHANGE = 0.2
"""Largest relative difference between the simulated robot and the nominal one."""
STRIBECK_CHANGE = (0.75, 0.95)
"""Range of static over Coulomb friction of the simulated robot: below 1, as in most of the paper's tables 2 and 4."""


@dataclass(frozen=True)
class SideReport:
    """How the identification of one side went; `errors` are rms speed differences on the held-out run [rad/s]."""

    side: str
    truth: dict[str, float]
    found: Identification
    nominal_error: float
    identified_error: float

    @property
    def better(self) -> bool:
        """The identified set reproduces the held-out run better than the nominal one."""
        return self.identified_error < self.nominal_error

    def text(self) -> str:
        """Return table and verdict."""
        verdict = "better" if self.better else "NOT better"
        held = (
            f"held-out run: speed off by {self.identified_error:.3g} rad/s rms as identified,"
            f" {self.nominal_error:.3g} rad/s as nominal: {verdict}"
        )
        return "\n".join([table(self.side, self.found, self.truth), *notes(self.found), held])


def different_motor(side: str, seed: int) -> dict[str, float]:
    """Return friction and inertia of a motor that differs from one side's nominal values by up to 20 %, by name."""
    generator = np.random.default_rng([seed, SIDES.index(side)])

    def near(name: str) -> float:
        return float(value(name) * (1.0 + LARGEST_CHANGE * (2.0 * generator.random() - 1.0)))

    found = {name: near(f"{side}.{name}") for name in FRICTION_NAMES if not name.startswith("static")}
    for way in ("forward", "reverse"):
        found[f"static_{way}"] = found[f"coulomb_{way}"] * float(generator.uniform(*STRIBECK_CHANGE))
    return found | {"stribeck_speed": near("stribeck_speed"), "bench_inertia": near("bench_inertia")}


def with_both_ways(parameters: dict[str, float]) -> dict[str, float]:
    """Return a motor's parameters by the names that the identification uses: one Stribeck speed per direction."""
    found = {name: number for name, number in parameters.items() if name != "stribeck_speed"}
    return found | {f"stribeck_speed_{way}": parameters["stribeck_speed"] for way in ("forward", "reverse")}


def run_campaign(out: Path, seed: int, notice: Callable[[str], None]) -> tuple[list[SideReport], Path]:
    """Run everything below `out`: `fmus/`, `ssp/`, `logs/<side>_<experiment>.mcap`, `<side>_bench.ssv`,
    `identified.ssv`; return what came out of each side and the path of the robot's parameter set.
    """
    build_all(out, ["motor", "bench"])
    ssp = out / "ssp" / "bench.ssp"
    reports = []
    for number, side in enumerate(SIDES):
        truth = different_motor(side, seed)
        bench, sensor = Bench(ssp, motor_values(side, truth)), Sensor(seed + 1000 * number)
        logs = []
        for experiment in (staircase(), run_up()):
            logs.append(out / "logs" / f"{side}_{experiment.name}.mcap")
            bench.run(experiment, out / "logs", logs[-1], sensor, notice)
        first = identify([_recording(log) for log in logs], value("torque_constant"))
        limits = [first[f"coulomb_{way}"].value or value(f"{side}.coulomb_{way}") for way in ("forward", "reverse")]
        slow = low_speeds(limits, value("torque_constant"), value("resistance"))
        logs.append(out / "logs" / f"{side}_{slow.name}.mcap")
        bench.run(slow, out / "logs", logs[-1], sensor, notice)
        found = identify([_recording(log) for log in logs], value("torque_constant"))
        write(out / f"{side}_bench.ssv", f"{side}_bench", bench_parameters(found))
        changes = {name.partition(".")[2]: number for name, (number, _) in bench_parameters(found).items()}
        runs = [Bench(ssp, motor_values(side, values)).run(held_out(), out / "logs") for values in (truth, {}, changes)]
        errors = [speed_error(runs[0], run) for run in runs[1:]]
        reports.append(SideReport(side, with_both_ways(truth), found, *errors))
    path = out / "identified.ssv"
    write(path, "identified", robot_parameters({report.side: report.found for report in reports}))
    return reports, path


def _recording(log: Path) -> Recording:
    """Return what the sensors have recorded in a log."""
    data = read_data(log, Columns({}), value("encoder_resolution"), ZERO_TIME)
    if not isinstance(data, Recording):
        raise ValueError(f"{log} is no time series")
    return data
