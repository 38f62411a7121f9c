"""The plant's friction torques: what balances a robot at rest, the friction law while a shaft slides, 0 while held."""

from math import asin, cos, exp, sin
from typing import Any

import pytest
from plain import load, nominal_friction, started

PLANT = load("plant").BLOCK
GEAR = 13.7


def friction(v: Any) -> tuple[float, float]:
    """Friction torques of the left and the right shaft [N.m]."""
    return v.left_friction_torque, v.right_friction_torque


def stands(v: Any) -> bool:
    """Tell whether a robot rests through ten steps."""
    for k in range(10):
        PLANT.step(v, k * 1e-3, 1e-3)
    return bool(v.left_wheel_rate == v.right_wheel_rate == v.pitch_rate == v.wheel_acceleration == 0.0)


def weight(v: Any) -> float:
    """Weight of the whole robot times the wheels' radius [N.m]."""
    return float((v.body_mass + 2.0 * v.wheel_mass) * v.gravity * v.wheel_radius)


def rolling(v: Any) -> float:
    """Largest rolling resistance of one wheel [N.m]."""
    return 0.5 * float(v.rolling_resistance) * weight(v)


STANDING = {
    "lean": {"pitch_start": 0.004},
    "uphill, leaning against it": {"pitch_start": 0.005, "slope": 0.016},
    "downhill, drives": {
        "pitch_start": -0.004, "slope": -0.013, "left_drive_torque": 2e-4, "right_drive_torque": -3e-4,
    },
    "push, torque on the body": {"push_force": 0.05, "body_torque": -0.004, "slope": 0.01, "left_drive_torque": 1e-4},
}  # fmt: skip


@pytest.mark.parametrize("given", STANDING.values(), ids=STANDING)
def test_at_standstill_on_a_slope_the_friction_balances_gravity(given: dict[str, float]) -> None:
    """Both together hold the body; each, with its wheel's rolling resistance, holds half of the axle's load."""
    v = started(PLANT, **nominal_friction(), **given)
    at_start = friction(v)
    assert stands(v)
    assert friction(v) == at_start
    left, right = friction(v)
    body = v.body_mass * v.gravity * v.cog_height * sin(v.pitch)
    body += v.push_force * v.push_height * cos(v.pitch) + v.body_torque
    drives = v.left_drive_torque + v.right_drive_torque
    # rounding of torques of up to 0.3 N.m
    assert v.gear_ratio * (left + right) == pytest.approx(body - v.gear_ratio * drives, abs=1e-15)
    axle = weight(v) * sin(v.slope) - v.push_force * v.wheel_radius * cos(v.slope)
    for side, torque in (("left", left), ("right", right)):
        drive, resistance = getattr(v, f"{side}_drive_torque"), getattr(v, f"{side}_rolling_torque")
        assert v.gear_ratio * (drive + torque) + resistance == pytest.approx(0.5 * axle, abs=1e-15)
        assert -getattr(v, f"{side}_static_forward_limit") <= torque <= getattr(v, f"{side}_static_reverse_limit")
        assert abs(resistance) <= rolling(v)


def test_of_what_may_hold_the_robot_the_middle_is_taken() -> None:
    """Upright and undriven, left and right are opposite: from -4.561e-4 (right reverse) to 5.333e-4 (left reverse)."""
    v = started(PLANT, **nominal_friction(), rolling_resistance=0.1)
    middle = 0.5 * (5.333e-4 - 4.561e-4)
    assert friction(v) == pytest.approx((middle, -middle), abs=1e-18)
    assert stands(v)


@pytest.mark.parametrize("share", [0.5, 0.9, -0.9])
def test_rolling_resistance_leaves_less_to_choose(share: float) -> None:
    """A slope that spends the share s of it leaves both wheels (1 - |s|) of it: an interval about 0 for the shafts."""
    v = started(PLANT, **nominal_friction())
    most = rolling(v)
    assert (1.0 - abs(share)) * most < GEAR * 4.561e-4
    v = started(PLANT, **nominal_friction(), slope=asin(2.0 * share * most / weight(v)))
    assert stands(v)
    assert friction(v) == pytest.approx((0.0, 0.0), abs=1e-17)
    assert (v.left_rolling_torque, v.right_rolling_torque) == pytest.approx((share * most, share * most), rel=1e-13)


@pytest.mark.parametrize("static", [1.0, 1.3])
@pytest.mark.parametrize("rate", [8.0, 0.02, -0.02, -8.0])
def test_while_a_shaft_slides_it_is_the_friction_law(static: float, rate: float) -> None:
    """T = T_c + (T_s - T_c) e^-(omega / 0.4102)^2 of the direction, against the motion; turning too."""
    v = started(PLANT, **nominal_friction(static), wheel_rate_start=rate, yaw_rate_start=0.3 * rate)
    for _ in range(3):
        assert v.left_shaft_speed * v.right_shaft_speed > 0.0
        for side in ("left", "right"):
            speed, torque = getattr(v, f"{side}_shaft_speed"), getattr(v, f"{side}_friction_torque")
            assert speed * rate > 0.0
            way = "forward" if speed > 0.0 else "reverse"
            coulomb = getattr(v, f"{side}_coulomb_{way}_limit")
            law = coulomb * (1.0 + (static - 1.0) * exp(-((speed / 0.4102) ** 2)))
            assert torque == pytest.approx(-law if speed > 0.0 else law, rel=1e-14)
        PLANT.step(v, 0.0, 1e-4)


def test_it_is_within_the_static_limits_at_rest_and_breaks_away_at_them() -> None:
    """The lean that just holds: both shafts then carry their reverse limits, the only split there is."""
    v = started(PLANT, **nominal_friction(1.3))
    limits = v.left_static_reverse_limit, v.right_static_reverse_limit
    torque = GEAR * sum(limits)
    lean, slope = asin(torque / (v.body_mass * v.gravity * v.cog_height)), asin(torque / weight(v))
    held = started(PLANT, **nominal_friction(1.3), pitch_start=lean * (1.0 - 1e-9), slope=slope)
    assert stands(held)
    assert friction(held) == pytest.approx(limits, rel=1e-8)
    falls = started(PLANT, **nominal_friction(1.3), pitch_start=lean * (1.0 + 1e-6), slope=slope)
    assert not stands(falls)


def test_it_is_0_while_the_robot_is_held() -> None:
    v = started(PLANT, **nominal_friction(), hold_time=0.005, pitch_start=0.4, left_drive_torque=0.01)
    for k in range(5):
        assert friction(v) == (0.0, 0.0)
        PLANT.step(v, k * 1e-3, 1e-3)
    PLANT.step(v, 5e-3, 1e-3)
    assert v.left_friction_torque != 0.0
