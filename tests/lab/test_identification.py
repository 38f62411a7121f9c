"""Friction and inertia are recovered blind from noisy, quantized data, inside the intervals that are stated."""

import numpy as np
import pytest
from identification_motor import KT, QUANTUM, Motor

from twip.errors import TwipError
from twip.lab.identification import Recording, given_samples, identify
from twip.lab.identification.experiments import run_up, staircase
from twip.lab.identification.stretches import constant_stretches

MOTOR = Motor()
PARAMETERS = ("coulomb_forward", "viscous_forward", "coulomb_reverse", "viscous_reverse", "bench_inertia")
SEEDS = 20


@pytest.fixture(scope="module")
def identified():
    steps = [experiment.steps for experiment in (staircase(), run_up())]
    return [identify([MOTOR.record(s, [seed, k]) for k, s in enumerate(steps)], KT) for seed in range(SEEDS)]


@pytest.mark.parametrize("name", PARAMETERS)
def test_each_parameter_is_within_one_percent_in_every_seed(identified, name):
    values = [found[name].found() for found in identified]
    assert np.max(np.abs(np.array(values) / getattr(MOTOR, name) - 1.0)) < 0.01


def test_intervals_cover_as_often_as_they_say(identified):
    """100 intervals of 95 %: fewer than 90 covering has a probability below 2 %, and the seeds are fixed."""
    covering = [found[name].covers(getattr(MOTOR, name)) for found in identified for name in PARAMETERS]
    assert sum(covering) >= 90


def test_intervals_are_no_wider_than_a_percent(identified):
    for found in identified:
        for name in PARAMETERS:
            estimate = found[name]
            assert estimate.high - estimate.low < 0.01 * estimate.value


def test_what_a_fast_shaft_cannot_tell_is_reported_and_not_returned(identified):
    for found in identified:
        for way in ("forward", "reverse"):
            for name in (f"static_{way}", f"stribeck_speed_{way}"):
                assert found[name].value is None
                assert "slower" in found[name].reason


def test_every_parameter_has_its_row_in_every_case():
    names = {estimate.name for estimate in identify([MOTOR.record(staircase().steps, 1)], KT).estimates}
    one_way = Motor().record([(4.0, 0.0), *((6.0, i) for i in (0.07, 0.09, 0.11))], 1)
    found = identify([one_way], KT)
    assert {estimate.name for estimate in found.estimates} == names
    assert found["coulomb_reverse"].value is None
    assert found["coulomb_forward"].covers(MOTOR.coulomb_forward)
    assert found["bench_inertia"].found() == pytest.approx(MOTOR.bench_inertia, rel=0.01)


def test_speeds_instead_of_counts_will_do():
    """The speed is the counts' difference over 1 ms: a quantum of 3 rad/s."""
    recordings = []
    for k, experiment in enumerate((staircase(), run_up())):
        counted = MOTOR.record(experiment.steps, [7, k])
        speed = np.diff(counted.angle, prepend=counted.angle[0]) / 1e-3
        recordings.append(Recording("speeds", counted.time, counted.current, speed=speed, offset_error=2e-5))
    found = identify(recordings, KT)
    for name in PARAMETERS:
        assert found[name].found() == pytest.approx(getattr(MOTOR, name), rel=0.01)


def test_the_offset_of_the_current_is_found_while_the_motor_is_off():
    steps = staircase().steps
    with_zero, without = (identify([MOTOR.record(steps, 3, offset=5e-3, zero=z)], KT) for z in (4.0, 0.0))
    assert with_zero["coulomb_forward"].found() == pytest.approx(MOTOR.coulomb_forward, rel=0.01)
    # 5 mA times the seed's normal number is a torque that counts as Coulomb friction
    assert abs(without["coulomb_forward"].found() / MOTOR.coulomb_forward - 1.0) > 0.01


def test_a_current_is_no_zero_while_the_shaft_turns():
    recording = MOTOR.record(staircase().steps, 1, zero=0.0)
    with pytest.raises(TwipError, match="the shaft turns in the first 6 s"):
        recording.zeroed(6.0)


def test_correlated_noise_widens_the_intervals():
    """Each reading held for 20 samples carries no more than one."""
    white = MOTOR.record(staircase().steps, 1)
    held = white.current.copy()
    for shift in range(20):
        held[shift : len(held) // 20 * 20 : 20] = white.current[: len(held) // 20 * 20 : 20]
    found = [
        identify([Recording("noise", white.time, c, white.angle, None, QUANTUM)], KT)["coulomb_forward"]
        for c in (white.current, held)
    ]
    widths = [f.high - f.low for f in found]
    assert widths[1] / widths[0] == pytest.approx(np.sqrt(20.0), rel=0.3)  # widths are estimates themselves


def test_stretches_begin_and_end_where_the_current_jumps():
    time = np.arange(0.0, 6.0, 1e-3)
    current = np.where(time < 2.0, 0.05, np.where(time < 4.0, 0.052, -0.05))
    recording = Recording("jumps", time, current + 1e-3 * np.random.default_rng(1).standard_normal(len(time)))
    found = [(s.begin, s.end) for s in constant_stretches(recording)]
    # a batch of 50 ms is given up on each side
    assert found == [(50, 1950), (2050, 3950), (4050, 5950)]


def test_data_without_a_steady_sample_are_refused():
    with pytest.raises(TwipError, match="no steady sample"):
        identify([MOTOR.record([(4.0, 0.0), (2.0, 0.03)], 1)], KT)


def test_samples_that_somebody_has_averaged():
    speed = np.array([50.0, 100.0, 150.0, 200.0, 300.0, 400.0])
    torque = 7.223e-4 + 1.886e-6 * speed
    scatter = 1.0 + 1e-3 * np.random.default_rng(1).standard_normal(6)
    found = identify([], KT, [given_samples(torque / KT * scatter, speed)])
    assert found["coulomb_forward"].covers(7.223e-4)
    assert found["viscous_forward"].covers(1.886e-6)
    assert found["bench_inertia"].value is None
    assert "run-up" in found["bench_inertia"].reason


def test_samples_at_one_speed_tell_no_viscous_friction():
    speed = 200.0 + np.linspace(-1.0, 1.0, 8)
    torque = 7.223e-4 + 1.886e-6 * speed
    scatter = 1.0 + 5e-3 * np.random.default_rng(1).standard_normal(8)
    found = identify([], KT, [given_samples(torque / KT * scatter, speed)])
    assert found["viscous_forward"].value is None
    assert "further apart" in found["viscous_forward"].reason


def test_samples_at_exactly_one_speed_determine_nothing():
    found = identify([], KT, [given_samples(np.array([0.08, 0.081, 0.079]), np.full(3, 200.0))])
    assert all(not estimate.identifiable for estimate in found.estimates)
