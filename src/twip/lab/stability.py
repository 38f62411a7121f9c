"""Where the sliding-mode loops stand although the robot is another one than the controller's model.

The paper's conditions (58) and (63), corrected, ask for epsilon > c sup|Delta|, where Delta is what the real
accelerations differ by from those that the law means to give:

    s1' = -epsilon1 sat(s1/Phi1) + c2 Delta1        s2' = -epsilon2 sat(s2/Phi2) + c4 Delta2

Here the robot's body, friction or inertia is changed and the controller's model is not. Each run tells whether the loop
stands, and its Delta, which is then compared with epsilon. Source: paper section 5.2.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import pi
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..cosim import Result, load, simulate
from ..robot import value

RELEASE = 1.0
"""End of the rest in `ssp/twip.ssp`, s."""
FRICTION = tuple(
    f"{side}.{kind}_{way}"
    for side in ("left", "right")
    for kind in ("coulomb", "static", "viscous")
    for way in ("forward", "reverse")
)
"""All friction of both motors; the controller has parameters of its own for it."""


@dataclass(frozen=True)
class Mismatch:
    """A property of the robot that the controller's model has wrong: the robot's `names` are `factor` times nominal."""

    title: str
    names: tuple[str, ...]
    factors: tuple[float, ...]

    def start_values(self, factor: float) -> dict[str, float]:
        """Return the robot's start values, in SI units."""
        return {name: factor * value(name.removeprefix("plant.")) for name in self.names}


@dataclass(frozen=True)
class Loop:
    """One of the two sliding-mode loops and how it is tried.

    `surface` is its recorded variable; `angle` names the plant's angle in rad, of which `_rate` and `_acceleration`
    are recorded too; `weight`, `rate_weight` are c1, c2 or c3, c4. The `task` is start values, the `duration` counts
    from the release in s, `epsilons` are in rad/s2; the boundary layer stays at its nominal width.
    """

    name: str
    surface: str
    angle: str
    weight: str
    rate_weight: str
    epsilon: str
    boundary: str
    task: dict[str, float | bool]
    duration: float
    epsilons: tuple[float, ...]
    mismatches: tuple[Mismatch, ...]


BALANCE = Loop(
    "balance", "controller.s1", "plant.pitch", "c1", "c2", "epsilon1", "boundary1", {"controller.speed_loop": False},
    2.5, (5.0, 7.0, 10.0, 15.0, 20.0, 30.0, 50.0, 100.0, 200.0),
    (
        Mismatch("body mass", ("plant.body_mass",), (0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 3.0)),
        Mismatch("height of the centre of gravity", ("plant.cog_height",), (0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 3.0)),
        Mismatch("friction of both motors", FRICTION, (0.0, 0.5, 1.0, 2.0, 4.0, 6.0, 8.0)),
        Mismatch("pitch inertia of the body", ("plant.body_pitch_inertia",), (0.2, 0.5, 1.0, 2.0, 4.0, 8.0, 15.0)),
    ),
)  # fmt: skip
"""Stand-up from 27 degrees (paper, Fig 13) by the pitch law alone."""

YAW = Loop(
    "yaw", "controller.s2", "plant.yaw", "c3", "c4", "epsilon2", "boundary2",
    {"controller.yaw_reference": pi / 2, "plant.pitch_start": 0.0}, 5.0, (1.5, 3.0, 5.0, 7.0, 10.0, 15.0, 30.0),
    (
        Mismatch("friction of both motors", FRICTION, (0.0, 0.5, 1.0, 2.0, 3.0, 4.0)),
        Mismatch("yaw inertia of the body", ("plant.body_yaw_inertia",), (0.3, 1.0, 2.0, 4.0, 8.0, 16.0)),
    ),
)  # fmt: skip
"""Turn by 90 degrees (paper, Fig 19) while the velocity loop keeps the place."""

LOOPS = (BALANCE, YAW)


@dataclass(frozen=True)
class Trial:
    """One run: it `stands` if nothing falls and s ends within its layer; `disturbance` is c sup|Delta| in rad/s2."""

    epsilon: float
    factor: float
    stands: bool
    disturbance: float

    def meets(self) -> bool:
        """Tell whether the condition epsilon > c sup|Delta| was met all along the run."""
        return self.epsilon > self.disturbance


def run(ssp: Path, start_values: dict[str, float | bool], stop_time: float) -> Result:
    """Return what the robot at `ssp` does with other start values until `stop_time` s; raises KeyboardInterrupt."""
    with load(ssp, start_values=start_values) as system:
        result = simulate(system, stop_time=stop_time)
    if result.interrupted:
        raise KeyboardInterrupt
    return result


def disturbance(table: Result, loop: Loop, epsilon: float) -> NDArray[np.float64]:
    """Return c Delta = s' + epsilon sat(s/Phi) in rad/s2, (rows,), from the release to the end or the fall.

    s' comes from the robot's true rates and accelerations, s is the surface that the controller saw: sampling, the
    estimator's errors and the supply's limit count as uncertainty, as parameters do.
    """
    moving = (table.times > RELEASE) & (table["plant.fallen"] < 0.5)
    rate, acceleration = (table[f"{loop.angle}_{kind}"][moving] for kind in ("rate", "acceleration"))
    reached = np.clip(table[loop.surface][moving] / value(loop.boundary), -1.0, 1.0)
    return value(loop.weight) * rate + value(loop.rate_weight) * acceleration + epsilon * reached


def attempt(ssp: Path, loop: Loop, mismatch: Mismatch, factor: float, epsilon: float) -> Trial:
    """Try a loop with one epsilon on a robot whose property is `factor` times what the model says."""
    changed = {f"controller.{loop.epsilon}": epsilon, **mismatch.start_values(factor)}
    table = run(ssp, {**loop.task, **changed}, RELEASE + loop.duration)
    stands = table["plant.fallen"][-1] < 0.5 and abs(table[loop.surface][-1]) < value(loop.boundary)
    return Trial(epsilon, factor, bool(stands), float(np.max(np.abs(disturbance(table, loop, epsilon)))))


Study = dict[tuple[str, str], list[Trial]]
"""Trials by the names of loop and mismatch."""


def study(ssp: Path, progress: Callable[[float], None] = lambda _: None) -> Study:
    """Try all loops and mismatches; `progress` is called with the share that is done."""
    cells = [
        (loop, mismatch, factor, epsilon)
        for loop in LOOPS
        for mismatch in loop.mismatches
        for factor in mismatch.factors
        for epsilon in loop.epsilons
    ]
    found: Study = {}
    for done, (loop, mismatch, factor, epsilon) in enumerate(cells, 1):
        found.setdefault((loop.name, mismatch.title), []).append(attempt(ssp, loop, mismatch, factor, epsilon))
        progress(done / len(cells))
    return found


@dataclass(frozen=True)
class Drift:
    """A long run of the robot, to see what its wheels do."""

    title: str
    start_values: dict[str, float | bool]


PITCH_LAW: dict[str, float | bool] = {"controller.speed_loop": False}
VISCOUS = tuple(name for name in FRICTION if "viscous" in name)
IDEAL: dict[str, float | bool] = {
    **dict.fromkeys(FRICTION, 0.0),
    **dict.fromkeys(VISCOUS, sum(map(value, VISCOUS)) / len(VISCOUS)),
    **dict.fromkeys(("imu.accel_x_bias", "imu.accel_z_bias", "imu.gyro_bias", "plant.rolling_resistance"), 0.0),
    **{"imu.noise": False, "imu.quantization": False, "controller.compensation": 0.0},
}
"""No friction but the viscous one that the law knows, one mean for both motors and ways, and a perfect sensor."""
DRIFTS = (
    Drift("pitch law, friction not compensated", PITCH_LAW | {"controller.compensation": 0.0}),
    Drift("pitch law", PITCH_LAW),
    Drift("pitch law, no dry friction, perfect sensor", PITCH_LAW | IDEAL),
    Drift("with the velocity loop", {}),
)
DRIFT_TIME = 24.0
"""Duration of the long runs after the release, s."""
