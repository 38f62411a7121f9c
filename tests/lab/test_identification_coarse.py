"""A coarse and noisy current sensor: nothing is called identifiable that is not, and nothing ends in a traceback."""

import numpy as np
import pytest
from identification_motor import KT, Motor

from twip.lab.identification import identify
from twip.lab.identification.experiments import run_up, staircase
from twip.lab.identification.quantization import mean_error
from twip.lab.identification.stretches import constant_stretches

MOTOR = Motor()
STEP = 0.026
PARAMETERS = ("coulomb_forward", "viscous_forward", "coulomb_reverse", "viscous_reverse", "bench_inertia")
CAMPAIGNS = {"both": (staircase(), run_up()), "staircase": (staircase(),), "run-up": (run_up(),)}


def estimates(campaign, noise, seeds):
    """Return what is identified of each parameter in each seed."""
    for seed in range(seeds):
        recordings = [
            MOTOR.record(e.steps, [seed, k], noise=noise, resolution=STEP) for k, e in enumerate(CAMPAIGNS[campaign])
        ]
        found = identify(recordings, KT)
        yield [(found[name], getattr(MOTOR, name)) for name in PARAMETERS]


@pytest.mark.parametrize(
    ("campaign", "noise"),
    [("both", 0.02), ("staircase", 0.02), ("run-up", 0.02), ("both", 0.005), ("both", 0.001)],
)
def test_what_is_returned_is_covered_and_the_rest_has_a_reason(campaign, noise):
    """Of up to 40 intervals of 95 %, with fixed seeds, less than 85 % covering has a probability below 2 %."""
    pairs = [pair for seed in estimates(campaign, noise, 8) for pair in seed]
    assert all(estimate.reason for estimate, _ in pairs if not estimate.identifiable)
    told = [(estimate, truth) for estimate, truth in pairs if estimate.identifiable]
    assert sum(estimate.covers(truth) for estimate, truth in told) >= 0.85 * len(told)
    for estimate, truth in told:  # an interval that misses does so by little
        assert abs(estimate.value - truth) <= estimate.high - estimate.low


def test_the_sensor_of_26_milliamperes_and_its_noise_of_20_still_tell_every_parameter():
    """Its noise spans the steps of the staircase, 10 mA; averaged it does not."""
    for seed in estimates("both", 0.02, 8):
        for estimate, truth in seed:
            assert estimate.found() == pytest.approx(truth, rel=0.03)
            assert 0.5 * (estimate.high - estimate.low) < 0.03 * truth


def test_a_staircase_lower_than_a_batchs_noise_is_cut_into_its_steps():
    recording = MOTOR.record(staircase().steps, 1, noise=0.02, resolution=STEP)
    levels = 7
    edges = 4.0 + 6.0 * np.arange(levels + 1)
    begins = np.array([recording.time[stretch.begin] for stretch in constant_stretches(recording)])
    assert np.all(np.min(np.abs(begins[:, None] - edges[:-1]), axis=0) < 0.2)


@pytest.mark.parametrize("noise", [0.0, 0.1, 0.2, 0.3, 0.4])
def test_the_error_that_rounding_leaves_is_that_of_a_simulated_converter(noise):
    """In steps of 1: many levels anywhere between two steps, 10 000 readings each; the noise itself leaves 0.01."""
    random = np.random.default_rng(1)
    levels = random.random(200)
    readings = np.round(levels[:, None] + noise * random.standard_normal((200, 10_000)))
    actual = np.sqrt(np.mean((readings.mean(axis=1) - levels) ** 2))
    if noise == 0.0:
        assert actual == pytest.approx(1.0 / np.sqrt(12.0), rel=0.1)
        assert mean_error(np.tile([0.0, 0.0, 1.0], 100) * 1e-6 + 1.0) < 1e-6
        return
    assert 0.75 * actual - 0.01 < mean_error(readings.ravel()) < 1.5 * actual + 0.01  # too large where noise is small


def test_a_computed_current_has_no_converter():
    assert mean_error(np.repeat([0.0, 0.06, 0.07, 0.12], 5000)) == 0.0
    assert mean_error(1e-3 * np.random.default_rng(1).standard_normal(10_000)) < 1e-12
