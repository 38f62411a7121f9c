"""A hundred noises on the bench's own runs: every parameter within 1 %, its interval covering in at least 90."""

from math import pi
from pathlib import Path

import numpy as np
import pytest

from twip.lab.identification import Recording, identify
from twip.lab.identification.experiments import ZERO_TIME, Bench, motor_values, run_up, staircase
from twip.lab.identification.sensor import Sensor
from twip.robot.parameters import value

DOCUMENT = Path(__file__).parents[2] / "docs" / "identification.md"
STEP = 2.0 * pi / value("encoder_resolution")
SEEDS = 100
NAMES = ("coulomb_forward", "viscous_forward", "coulomb_reverse", "viscous_reverse", "bench_inertia")


def measured(table, sensor):
    current, counts = sensor.read(table["motor.current"], table["bench.shaft_angle"])
    return Recording("bench", table.times, current, counts * STEP, None, STEP).zeroed(ZERO_TIME)


@pytest.mark.heavy
@pytest.mark.parametrize("side", ["left", "right"])
def test_a_hundred_seeds(built, tmp_path, side):
    values = motor_values(side)
    truth = {name.partition(".")[2]: number for name, number in values.items()}
    bench = Bench(built / "ssp" / "bench.ssp", values)
    tables = [bench.run(experiment, tmp_path) for experiment in (staircase(), run_up())]
    found = []
    for seed in range(SEEDS):
        sensor = Sensor(seed)
        found.append(identify([measured(table, sensor) for table in tables], value("torque_constant")))
    for name in NAMES:
        numbers = np.array([f[name].found() for f in found])
        assert np.max(np.abs(numbers / truth[name] - 1.0)) < 0.01, name
        covering = sum(f[name].covers(truth[name]) for f in found)
        assert covering >= 90, name
        row = f"| `{side}.{name}` | {100.0 * np.max(np.abs(numbers / truth[name] - 1.0)):.2f} % | {covering} |"
        assert row in DOCUMENT.read_text(encoding="utf-8")
    assert not any(f[name].identifiable for f in found for name in ("static_forward", "stribeck_speed_reverse"))
