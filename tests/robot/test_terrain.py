"""The bumps' profile: its derivatives, its ends, its repetition."""

from math import cos, sin

import pytest

from twip.robot.terrain import bump, bump_slope

SHAPE = {"height": 0.02, "length": 0.1, "spacing": 0.5, "start": 0.2}


@pytest.mark.parametrize("distance", [0.21, 0.25, 0.273, 0.299, 0.75, 5.231])
def test_derivatives_are_those_of_the_profile(distance: float) -> None:
    d = 1e-5
    below, here, above = (bump(distance + k * d, **SHAPE) for k in (-1, 0, 1))
    # central differences: third derivative of slope 0.63 (63 1/m)^2 times d^2/6, and of the curvature likewise
    assert here[1] == pytest.approx((above[0] - below[0]) / (2 * d), abs=1e-7)
    assert here[2] == pytest.approx((above[1] - below[1]) / (2 * d), abs=1e-5)


@pytest.mark.parametrize("distance", [0.215, 0.25, 0.29, 2.77])
def test_slope_angle_belongs_to_the_gradient(distance: float) -> None:
    _, gradient, derivative = bump(distance, **SHAPE)
    angle, per_metre = bump_slope(distance, **SHAPE)
    assert sin(angle) == pytest.approx(gradient, abs=1e-15)
    assert per_metre * cos(angle) == pytest.approx(derivative, rel=1e-12)


def test_height_and_places_of_the_bumps() -> None:
    assert bump(0.25, **SHAPE)[0] == pytest.approx(0.02, rel=1e-15)
    assert bump(0.7 + 0.05, **SHAPE)[0] == pytest.approx(0.02, rel=1e-12)
    for flat in (-1.0, 0.0, 0.199, 0.3001, 0.5, 0.69, 0.8001):
        assert bump(flat, **SHAPE) == (0.0, 0.0, 0.0)
    for end in (0.2, 0.3 - 1e-12):
        assert bump(end, **SHAPE)[:2] == pytest.approx((0.0, 0.0), abs=1e-9)


def test_a_negative_height_is_a_hollow() -> None:
    hollow = SHAPE | {"height": -0.02}
    assert bump(0.23, **hollow) == tuple(-x for x in bump(0.23, **SHAPE))


def test_no_height_is_flat() -> None:
    assert bump(0.25, **(SHAPE | {"height": 0.0})) == (0.0, 0.0, 0.0)
    assert bump_slope(0.25, **(SHAPE | {"height": 0.0})) == (0.0, 0.0)
