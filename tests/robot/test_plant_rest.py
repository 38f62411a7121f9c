"""Rest is exact, and ends where it should."""

from math import asin, pi
from typing import Any

import pytest
from plain import load, nominal_friction, started

PLANT = load("plant").BLOCK
MOVING = ("pitch_rate", "wheel_rate", "yaw_rate", "left_shaft_speed", "right_shaft_speed")
STILL = ("pitch", "wheel_angle", "yaw", "left_shaft_angle", "right_shaft_angle", "x", "y")
ACCELERATIONS = ("pitch_acceleration", "wheel_acceleration", "yaw_acceleration")


def rests(v: Any, steps: int) -> bool:
    """Tell whether everything stays as it is, to the last bit."""
    before = [getattr(v, name) for name in STILL]
    for k in range(steps):
        PLANT.step(v, k * 1e-3, 1e-3)
        if any(getattr(v, name) != 0.0 for name in (*MOVING, *ACCELERATIONS)):
            return False
    return before == [getattr(v, name) for name in STILL]


def test_torques_below_friction_move_nothing_for_ten_thousand_steps() -> None:
    v = started(PLANT, **nominal_friction(), yaw_start=0.3, wheel_angle_start=2.0)
    v.left_drive_torque, v.right_drive_torque = 0.9 * 7.223e-4, -0.9 * 4.561e-4
    assert rests(v, 10_000)


def limits(v: Any) -> tuple[float, float]:
    """Torque of the rolling resistance of both wheels, and weight times wheel radius [N.m]."""
    weight = v.gravity * (v.body_mass + 2 * v.wheel_mass) * v.wheel_radius
    return v.rolling_resistance * weight, weight


@pytest.mark.parametrize(("share", "expected"), [(0.999999, True), (1.000001, False)])
def test_slope_is_held_by_rolling_resistance_alone_when_upright(share: float, expected: bool) -> None:
    v = started(PLANT, **nominal_friction())
    rolling, weight = limits(v)
    v.slope = share * asin(rolling / weight)
    assert rests(v, 100) is expected


@pytest.mark.parametrize(("share", "expected"), [(0.999999, True), (1.000001, False)])
def test_slope_is_held_by_rolling_resistance_and_a_body_that_leans_on_its_shafts(share: float, expected: bool) -> None:
    friction = nominal_friction()
    v = started(PLANT, **friction)
    shafts = 13.7 * (v.left_coulomb_reverse_limit + v.right_coulomb_reverse_limit)
    lean = asin(0.9 * shafts / (v.body_mass * v.gravity * v.cog_height))
    rolling, weight = limits(v)
    v = started(PLANT, **friction, pitch_start=lean, slope=share * asin((rolling + 0.9 * shafts) / weight))
    assert rests(v, 100) is expected


@pytest.mark.parametrize("static", [1.0, 1.3])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_both_motors_break_away_when_they_exceed_both_shafts_friction(static: float, sign: float) -> None:
    """Equal torques: the body turns when they exceed what both shafts hold; the floor holds the difference."""
    v = started(PLANT, **nominal_friction(static))
    way = "forward" if sign > 0.0 else "reverse"
    hold = 0.5 * (getattr(v, f"left_static_{way}_limit") + getattr(v, f"right_static_{way}_limit"))
    v.left_drive_torque = v.right_drive_torque = sign * hold * (1.0 - 1e-9)
    assert rests(v, 100)
    v.left_drive_torque = v.right_drive_torque = sign * hold * (1.0 + 1e-6)
    assert not rests(v, 1)
    assert sign * v.pitch_rate < 0.0


def test_static_friction_holds_more_than_sliding_friction() -> None:
    """Between both levels a locked robot's body hangs still or swings on, depending on whether it moves."""
    friction = nominal_friction(1.5)
    hold = 13.7 * (friction["left_coulomb_reverse_limit"] + friction["right_coulomb_reverse_limit"])
    still = started(PLANT, **friction, wheels_locked=1.0, pitch_start=pi - 0.01)
    gravity_torque = still.body_mass * still.gravity * still.cog_height
    still = started(PLANT, **friction, wheels_locked=1.0, pitch_start=pi - asin(1.4 * hold / gravity_torque))
    assert rests(still, 100)
    swinging = started(
        PLANT, **friction, wheels_locked=1.0, pitch_start=pi - asin(1.4 * hold / gravity_torque), pitch_rate_start=0.1
    )
    PLANT.step(swinging, 0.0, 1e-3)
    assert swinging.pitch_acceleration > 0.0


def test_a_robot_that_rolls_out_stops_for_ever() -> None:
    """Hanging at the pendulum's lower rest, rolling: it slows down, stops and keeps still."""
    v = started(PLANT, **nominal_friction(), pitch_start=pi, wheel_rate_start=2.0, yaw_rate_start=0.5)
    for k in range(8000):
        PLANT.step(v, k * 1e-3, 1e-3)
    assert rests(v, 2000)
    assert v.x != 0.0


def test_a_sticking_gear_turns_wheel_and_body_as_one() -> None:
    """A hanging robot pushed gently: the shafts stick, all rolls as one, the shaft angles stay to the last bit."""
    v = started(PLANT, **nominal_friction(), pitch_start=pi, rolling_resistance=0.0)
    v.left_coulomb_forward_limit = v.left_coulomb_reverse_limit = v.right_coulomb_forward_limit = 0.1
    v.right_coulomb_reverse_limit = 0.1
    v.left_static_forward_limit = v.left_static_reverse_limit = v.right_static_forward_limit = 0.1
    v.right_static_reverse_limit = 0.1
    left, right, wheel = v.left_shaft_angle, v.right_shaft_angle, v.wheel_angle
    v.push_force = 0.1
    for k in range(200):
        PLANT.step(v, k * 1e-3, 1e-3)
        assert v.left_wheel_rate == v.right_wheel_rate == v.pitch_rate
    assert v.wheel_angle != wheel
    assert (v.left_shaft_angle, v.right_shaft_angle) == (left, right)
    assert v.left_shaft_speed == v.right_shaft_speed == 0.0


def test_held_robot_does_nothing_until_released() -> None:
    friction = nominal_friction()
    v = started(PLANT, 5.0, **friction, pitch_start=0.4, hold_time=0.1, pitch_rate_start=1.0, wheel_rate_start=3.0)
    v.push_force = 10.0
    for k in range(100):
        PLANT.step(v, 5.0 + k * 1e-3, 1e-3)
        assert (v.pitch, v.wheel_angle, v.x) == (0.4, 0.0, 0.0)
        assert all(getattr(v, name) == 0.0 for name in (*MOVING, *ACCELERATIONS))
    PLANT.step(v, 5.0 + 100 * 1e-3, 1e-3)
    released = started(PLANT, 5.1, **friction, pitch_start=0.4, push_force=10.0)
    PLANT.step(released, 5.1, 1e-3)
    assert v.pitch == released.pitch != 0.4
    assert v.pitch_acceleration == released.pitch_acceleration != 0.0
