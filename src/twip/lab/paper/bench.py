"""The bench experiments behind Figs 2 to 4: simulated once per motor, measured and identified once per seed."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ...cosim import Table
from ...robot import value
from ..identification.experiments import ZERO_TIME, Bench, Experiment, low_speeds, motor_values, run_up, staircase
from ..identification.identify import Identification, identify
from ..identification.recording import Recording
from ..identification.sensor import Sensor
from .laboratory import Laboratory

WAYS = ("forward", "reverse")
COULOMB = {
    "left": {"coulomb": (7.223e-4, 5.333e-4), "viscous": (1.886e-6, 2.394e-6)},
    "right": {"coulomb": (5.600e-4, 4.561e-4), "viscous": (1.888e-6, 1.248e-6)},
}
"""Tables 1 (left) and 3 (right): magnitudes, forward and reverse, N.m and N.m.s/rad; the robot's nominal friction."""
STRIBECK = {
    "left": {"coulomb": (7.272e-4, 5.44e-4), "static": (6.301e-4, 4.832e-4), "viscous": (1.877e-6, 2.375e-6)},
    "right": {"coulomb": (5.668e-4, 4.556e-4), "static": (4.654e-4, 4.653e-4), "viscous": (1.876e-6, 1.252e-6)},
}
"""Tables 2 (left) and 4 (right)."""
STRIBECK_SPEED = 0.4102
"""The same in all of them, rad/s, magnitude."""
EVERY = 4
"""A measurement takes every fourth step of 1 ms; with low speeds, where counts are rare, every step."""
FEW = 2
"""Seeds with low speeds, which take long and vary little."""


def by_name(friction: Mapping[str, tuple[float, float]]) -> dict[str, float]:
    """Return a table of friction parameters by the motor's parameter names."""
    return {f"{kind}_{way}": number for kind, pair in friction.items() for way, number in zip(WAYS, pair, strict=True)}


@dataclass(frozen=True)
class Campaign:
    """What was found about one motor, per seed: from the staircase and the run-up, and with low speeds besides."""

    truth: Mapping[str, float]
    found: tuple[Identification, ...]
    found_slow: tuple[Identification, ...]
    first_run_up: Recording

    def errors(self, name: str, slow: bool = False) -> list[float]:
        """Return a parameter's relative error in percent, per seed; seeds that cannot tell it are left out."""
        estimates = [found[name].value for found in (self.found_slow if slow else self.found)]
        return [100.0 * (v / self.truth[name] - 1.0) for v in estimates if v is not None]

    def identified(self, name: str) -> int:
        """Return in how many seeds staircase and run-up told a parameter."""
        return sum(found[name].identifiable for found in self.found)


def recorded(table: Table, sensor: Sensor, name: str, every: int) -> Recording:
    """Return what a bench's instruments make of every so manieth row of a run."""
    current, count = sensor.read(table["motor.current"][::every], table["bench.shaft_angle"][::every])
    step = 2.0 * np.pi / value("encoder_resolution")
    return Recording(name, table.times[::every], current, angle=count * step, angle_step=step).zeroed(ZERO_TIME)


@lru_cache(maxsize=4)
def campaign(laboratory: Laboratory, side: str, stribeck: bool) -> Campaign:
    """Run the experiments with one side's motor, its friction that of the Stribeck tables or nominal, and identify it.

    Low speeds are run for the Stribeck friction alone, and all of that for a few seeds.
    """
    changes = by_name(STRIBECK[side]) if stribeck else {}
    bench = Bench(laboratory.built / "ssp" / "bench.ssp", motor_values(side, changes))
    plans: list[Experiment] = [staircase(), run_up()]
    if stribeck:
        plans.append(low_speeds(STRIBECK[side]["coulomb"], value("torque_constant"), value("resistance")))
    tables = [bench.run(plan, laboratory.out / "inputs") for plan in plans]
    found, found_slow, run_ups = [], [], []
    for seed in range(1, (min(FEW, laboratory.seeds) if stribeck else laboratory.seeds) + 1):
        sensor = Sensor(seed)
        every = 1 if stribeck else EVERY
        recordings = [recorded(table, sensor, plan.name, every) for table, plan in zip(tables, plans, strict=True)]
        run_ups.append(recordings[1])
        found.append(identify(recordings[:2], value("torque_constant")))
        if stribeck:
            found_slow.append(identify(recordings, value("torque_constant")))
    truth = {**by_name(STRIBECK[side] if stribeck else COULOMB[side]), "bench_inertia": value("bench_inertia")}
    truth |= {f"stribeck_speed_{way}": STRIBECK_SPEED for way in WAYS}
    return Campaign(truth, tuple(found), tuple(found_slow), run_ups[0])
