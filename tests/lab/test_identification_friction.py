"""The Stribeck effect: where samples show it and where they cannot, and the paper's printed forms."""

import numpy as np
import pytest
from identification_motor import KT, friction, weight
from printed_friction import corrected_stribeck, printed_parameters, printed_stribeck
from scipy.optimize import curve_fit

from twip.lab.identification.friction import balance
from twip.lab.identification.steady import SteadySamples
from twip.lab.identification.stribeck import fit_friction

TABLES = {  # tables 2 and 4, magnitudes: T_c, T_s, v_s, sigma_2
    "left forward": (7.272e-4, 6.301e-4, 0.4102, 1.877e-6),
    "left reverse": (5.44e-4, 4.832e-4, 0.4102, 2.375e-6),
    "right forward": (5.668e-4, 4.654e-4, 0.4102, 1.876e-6),
    "right reverse": (4.556e-4, 4.653e-4, 0.4102, 1.252e-6),
}
FAST = np.repeat(np.linspace(40.0, 400.0, 10), 3)
SLOW = np.geomspace(0.1, 3.0, 30)
CURRENT_ERROR, SPEED_ERROR = 3e-5, 5e-4


def samples(speed, parameters, seed, direction=1, current_error=CURRENT_ERROR):
    """Steady samples of a second each: 1 mA noise at 1 kHz, the encoder's rounding."""
    random = np.random.default_rng(seed)
    n = len(speed)
    current = friction(speed, *parameters) / KT + current_error * random.standard_normal(n)
    seen = speed + SPEED_ERROR * random.standard_normal(n)
    return SteadySamples(
        direction * current, direction * seen, np.full(n, current_error), np.full(n, SPEED_ERROR), np.zeros(n),
        np.zeros(n, np.int64), np.zeros(1),
    )  # fmt: skip


def fit(speed, parameters, seed, direction=1, **options):
    return fit_friction(balance(samples(speed, parameters, seed, direction, **options), direction, KT, 0.0), direction)


@pytest.mark.parametrize("table", TABLES)
def test_fast_samples_do_not_tell_the_stribeck_effect(table):
    for seed in range(20):
        found = fit(FAST, TABLES[table], seed)
        assert found.static.value is None
        assert found.stribeck_speed.value is None
        assert found.coulomb.found() == pytest.approx(TABLES[table][0], rel=0.01)


def test_how_little_the_fast_samples_feel():
    """At 10 rad/s the Stribeck term has fallen to 8e-259 of its value: no sensor sees it."""
    assert weight(10.0, 0.4102) == pytest.approx(8e-259, rel=0.1)


@pytest.mark.parametrize("start", [0.4102, 0.7])
def test_a_fit_of_fast_samples_returns_its_start_value(start):
    """As the paper's v_s = -0.4102 in all four columns: the value that such a fit was started with."""
    data = samples(FAST, TABLES["left forward"], 1)
    found, _ = curve_fit(
        friction,
        data.speed,
        KT * data.current,
        p0=(7e-4, 6e-4, start, 2e-6),
        x_scale=(1e-4, 1e-4, 1, 1e-6),
        method="trf",
    )
    assert found[2] == start


@pytest.mark.parametrize(("table", "direction"), [("left forward", 1), ("left reverse", -1), ("right forward", 1)])
def test_slow_samples_tell_it_within_the_stated_intervals(table, direction):
    truth = TABLES[table]
    covering = 0
    for seed in range(20):
        found = fit(np.concatenate([SLOW, FAST]), truth, seed, direction)
        for estimate, value in zip(
            (found.coulomb, found.static, found.stribeck_speed, found.viscous), truth, strict=True
        ):
            assert estimate.found() == pytest.approx(value, rel=0.05)
            covering += estimate.covers(value)
        assert found.static.found() == pytest.approx(truth[1], rel=0.01)
    assert covering >= 72  # 90 % of 80


def test_a_small_effect_has_a_wide_interval_or_none():
    """Table 4, reverse: T_s lies 2 % above T_c; v_s is known to tens of percent at best."""
    truth = TABLES["right reverse"]
    for seed in range(10):
        found = fit(np.concatenate([SLOW, FAST]), truth, seed)
        assert found.coulomb.found() == pytest.approx(truth[0], rel=0.01)
        if found.stribeck_speed.identifiable:
            assert found.stribeck_speed.high - found.stribeck_speed.low > 0.05 * truth[2]


def test_friction_without_stribeck_effect_gets_none():
    truth = (7.223e-4, 7.223e-4, 0.4102, 1.886e-6)
    found = [fit(np.concatenate([SLOW, FAST]), truth, seed) for seed in range(30)]
    assert sum(f.static.identifiable for f in found) <= 1  # one in a thousand by chance, a few for the search


def test_the_tail_of_an_effect_alone_is_not_enough():
    """From 0.85 rad/s on, where 1 % of it is left, many pairs of T_s and v_s give the same tail."""
    truth = TABLES["left forward"]
    found = fit(np.concatenate([np.linspace(0.85, 1.2, 12), FAST]), truth, 1)
    assert found.static.value is None
    assert found.stribeck_speed.value is None


def test_equation_3_as_printed_swaps_the_coefficients():
    """T_c = a, sigma = b of y = a x + b: friction at 100 rad/s comes out 80 times too large."""
    torque = friction(FAST, 7.223e-4, 7.223e-4, 1.0, 1.886e-6)
    a, b = np.polyfit(FAST, torque, 1)
    measured = 7.223e-4 + 1.886e-6 * 100.0
    coulomb, viscous = printed_parameters(a, b)
    assert (coulomb + viscous * 100.0) / measured > 50.0
    assert b + a * 100.0 == pytest.approx(measured, rel=1e-9)


@pytest.mark.parametrize("table", ["left reverse", "right reverse"])
def test_equation_4_as_printed_drives_a_shaft_that_turns_backwards(table):
    """With the sign on the exponential alone, friction does work on the shaft; corrected, it never does."""
    coulomb, static, speed, viscous = TABLES[table]
    speeds = np.concatenate([-FAST, -SLOW, SLOW, FAST])
    printed = [printed_stribeck(w, coulomb, static, speed, viscous) * w for w in speeds]
    corrected = [corrected_stribeck(w, coulomb, static, speed, viscous) * w for w in speeds]
    assert min(printed) < 0.0
    assert min(corrected) > 0.0
    assert all(p < 0.0 for p, w in zip(printed, speeds, strict=True) if -200.0 < w < -3.0)
    assert [corrected_stribeck(w, coulomb, static, speed, viscous) for w in SLOW] == pytest.approx(
        list(friction(SLOW, coulomb, static, speed, viscous))
    )
