"""The metrics of the paper's experiments, on signals whose answers are known."""

import numpy as np
import pytest

from twip.lab.numbers import (
    excursions,
    fundamental,
    overshoot,
    phase_lag,
    reversals,
    rms,
    settling_time,
    slope,
    time_to_reach,
)

TIMES = np.arange(0.0, 10.0 + 5e-4, 1e-3)


def test_rms_of_a_sine_is_its_amplitude_over_root_two():
    whole = TIMES[:-1]  # whole periods, without the last sample that would count one instant twice
    assert rms(3.0 * np.sin(2.0 * np.pi * whole)) == pytest.approx(3.0 / np.sqrt(2.0), rel=1e-12)


def test_overshoot_of_a_damped_oscillation_is_its_first_negative_peak():
    # x = e^-at cos(wt) has its first minimum at tan(wt) = -a/w
    a, w = 1.0, 4.0
    signal = np.exp(-a * TIMES) * np.cos(w * TIMES)
    peak = (np.pi - np.arctan(a / w)) / w
    assert overshoot(signal, 0.0) == pytest.approx(-np.exp(-a * peak) * np.cos(w * peak), abs=1e-6)  # sampled at 1 ms


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_overshoot_is_seen_from_the_start_and_counts_from_the_final_value(sign):
    assert overshoot(sign * np.array([10.0, 4.0, 1.0, 1.5, 2.0]), sign * 2.0) == 1.0
    assert overshoot(sign * np.array([10.0, 4.0, 3.0, 2.0]), sign * 2.0) == 0.0


def test_settling_time_of_an_exponential_is_the_logarithm_of_its_band():
    signal = 5.0 * np.exp(-2.0 * TIMES) + 1.0
    assert settling_time(TIMES + 3.0, signal, 1.0, 0.05) == pytest.approx(np.log(100.0) / 2.0, abs=1.1e-3)  # one sample
    assert settling_time(TIMES, np.ones_like(TIMES), 1.0, 0.05) == 0.0
    assert settling_time(TIMES, np.sin(TIMES), 0.0, 0.05) == np.inf


def test_time_to_reach_counts_from_the_first_sample():
    assert time_to_reach(TIMES + 7.0, TIMES**2, 4.0) == pytest.approx(2.0, abs=1e-9)
    assert time_to_reach(TIMES, TIMES, 11.0) == np.inf


def test_slope_of_a_line_does_not_depend_on_where_it_begins():
    assert slope(TIMES + 1e3, 0.25 * TIMES - 40.0) == pytest.approx(0.25, rel=1e-9)


def test_reversals_take_noise_at_rest_for_rest():
    noise = 0.05 * np.sin(500.0 * TIMES)
    assert reversals(noise, 0.1) == 0
    assert reversals(np.array([0.0, 1.0, 0.05, -0.05, 1.0, 0.0]), 0.1) == 0
    assert reversals(np.array([1.0, 0.05, -1.0, -0.05, -1.0, 1.0]), 0.1) == 2
    assert reversals(np.sin(2.0 * np.pi * TIMES), 0.5) == 19  # ten periods: twenty half waves


def test_excursions_are_separate_stretches_of_either_sign():
    assert excursions(np.array([0.0, 3.0, 3.0, 0.0, -3.0, 0.0]), 2.0) == 2
    assert excursions(np.array([3.0, 0.0, 0.0]), 2.0) == 1
    assert excursions(np.zeros(5), 2.0) == 0


def test_the_fundamental_ignores_a_constant_and_the_harmonics():
    signal = 7.0 + 2.0 * np.cos(2.0 * np.pi * 3.0 * TIMES - 0.4) + 0.5 * np.sin(2.0 * np.pi * 6.0 * TIMES)
    found = fundamental(TIMES[:-1], signal[:-1], 3.0)
    assert abs(found) == pytest.approx(2.0, rel=1e-9)
    assert np.angle(found) == pytest.approx(-0.4, rel=1e-9)


@pytest.mark.parametrize("lag", [-100.0, -5.0, 0.0, 53.0, 170.0])
def test_the_phase_lag_is_positive_for_what_comes_later(lag):
    angle = 2.0 * np.pi * 3.0 * TIMES[:-1]
    late = 4.0 * np.sin(angle - np.radians(lag)) - 1.0
    assert phase_lag(TIMES[:-1], late, np.sin(angle), 3.0) == pytest.approx(lag, abs=1e-7)
