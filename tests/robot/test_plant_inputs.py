"""What the plant's inputs and parameters do: locked wheels, bumps, fall, place, inner steps, checks."""

from math import asin, cos, isnan, pi, sin, sqrt
from typing import Any

import pytest
from plain import instance, load, nominal_friction, started
from scipy.special import ellipk

from twip.robot.plant import constants
from twip.robot.terrain import bump

FACE = load("plant")
PLANT = FACE.BLOCK


def locked_pendulum(amplitude: float) -> Any:
    return started(PLANT, wheels_locked=1.0, pitch_start=pi - amplitude)


@pytest.mark.parametrize("amplitude", [0.01, 1.0, 2.5])
def test_locked_robot_without_shaft_friction_is_a_pendulum(amplitude: float) -> None:
    """Its period is 4 K(sin(amplitude/2)^2)/omega, omega^2 = M g L / M44, and it comes back to where it was."""
    v = locked_pendulum(amplitude)
    _, m44, *_ = constants(v)
    omega = sqrt(v.body_mass * v.gravity * v.cog_height / m44)
    period = 4.0 * ellipk(sin(amplitude / 2) ** 2) / omega
    step = period / 1000
    for k in range(1000):
        PLANT.step(v, k * step, step)
        assert v.wheel_rate == v.yaw_rate == v.wheel_angle == v.x == 0.0
        assert v.wheel_acceleration == v.yaw_acceleration == 0.0
    # the method's error over a period grows with the square of omega h = 0.006 or less
    assert v.pitch == pytest.approx(pi - amplitude, abs=2e-4 * amplitude)
    assert v.pitch_rate == pytest.approx(0.0, abs=2e-3 * omega * amplitude)


def test_pitch_acceleration_of_the_locked_robot() -> None:
    v = started(PLANT, **nominal_friction(), wheels_locked=1.0, pitch_start=0.5, body_torque=0.3)
    v.left_drive_torque, v.right_drive_torque = 0.002, 0.003
    PLANT.initialize(v, 0.0)
    torque = 1.5206 * sin(0.5) + 0.3 - 13.7 * 0.005 - 13.7 * (5.333e-4 + 4.561e-4)
    # the body begins to fall forward, which turns the shafts backward; 1.5206 is rounded to five digits
    friction = 13.7 * (v.left_friction_torque + v.right_friction_torque)
    assert friction == pytest.approx(13.7 * (5.333e-4 + 4.561e-4), rel=1e-12)
    assert v.pitch_acceleration == pytest.approx(torque / 1.8691e-2, rel=1e-4)
    assert v.wheel_acceleration == 0.0


def test_locking_stops_the_rolling_robot_at_once() -> None:
    v = started(PLANT, **nominal_friction(), wheel_rate_start=20.0, yaw_rate_start=2.0, pitch_start=0.1)
    PLANT.step(v, 0.0, 1e-3)
    v.wheels_locked = 1.0
    PLANT.step(v, 1e-3, 1e-3)
    assert v.wheel_rate == v.yaw_rate == v.left_wheel_rate == v.right_wheel_rate == 0.0
    assert v.wheel_acceleration == v.yaw_acceleration == 0.0
    assert v.pitch_rate > 1.0  # the body goes on


def test_accelerations_are_the_rates_derivatives() -> None:
    """At the start and after steps, against a difference over a step short enough for the tolerance."""
    v = started(
        PLANT, **nominal_friction(), pitch_start=0.3, pitch_rate_start=0.4, wheel_rate_start=5.0, yaw_rate_start=1.0,
        left_drive_torque=0.004, right_drive_torque=-0.003, push_force=1.0, slope=0.1,
        bump_height=0.01, bump_start=-0.02,
    )  # fmt: skip
    for k in range(5):
        before = [(getattr(v, f"{q}_rate"), getattr(v, f"{q}_acceleration")) for q in ("pitch", "wheel", "yaw")]
        PLANT.step(v, k * 1e-6, 1e-6)
        after = [getattr(v, f"{q}_rate") for q in ("pitch", "wheel", "yaw")]
        for (rate, acceleration), new in zip(before, after, strict=True):
            # half a step of jerk (some 1e3 rad/s3) and rounding of the rates over 1e-6 s
            assert (new - rate) / 1e-6 == pytest.approx(acceleration, abs=5e-3)


def test_ground_slope_follows_the_bumps() -> None:
    v = started(
        PLANT,
        rolling_resistance=0.0,
        wheel_rate_start=10.0,
        slope=0.05,
        bump_height=0.02,
        bump_start=0.0,
        pitch_start=pi,
    )
    inside = 0
    for k in range(300):
        before, slope = v.ground_slope_rate, v.ground_slope
        PLANT.step(v, k * 1e-3, 1e-3)
        gradient = bump(0.05 * v.wheel_angle, 0.02, 0.1, 0.5, 0.0)[1]
        assert v.ground_slope == pytest.approx(0.05 + asin(gradient), abs=1e-15)
        if 0.0 not in (before, v.ground_slope_rate):
            inside += 1
            # trapezium over 1 ms: h^2/12 of the second derivative of a rate of 20 rad/s that swings at 31 rad/s
            assert (v.ground_slope - slope) / 1e-3 == pytest.approx(0.5 * (before + v.ground_slope_rate), abs=0.02)
    assert inside > 100


def test_place_on_a_circle() -> None:
    """Hanging straight down and turning evenly: a circle of radius R theta'/phi'."""
    v = started(
        PLANT, rolling_resistance=0.0, gravity=0.0, pitch_start=pi, wheel_rate_start=8.0, yaw_rate_start=2.0,
        x_start=1.0, y_start=-2.0, yaw_start=0.5,
    )  # fmt: skip
    for k in range(1000):
        PLANT.step(v, k * 1e-3, 1e-3)
    assert (v.wheel_rate, v.yaw_rate) == pytest.approx((8.0, 2.0), abs=1e-9)
    radius = 0.05 * 8.0 / 2.0
    # the chord of a midpoint step is longer than the arc's by (phi' h)^2/24 = 1e-8 at h = 0.25 ms
    assert v.yaw == pytest.approx(2.5, abs=1e-12)
    assert v.x == pytest.approx(1.0 + radius * (sin(2.5) - sin(0.5)), abs=2e-8)
    assert v.y == pytest.approx(-2.0 - radius * (cos(2.5) - cos(0.5)), abs=2e-8)


def test_way_on_a_slope_is_shorter_on_the_map() -> None:
    v = started(PLANT, rolling_resistance=0.0, wheel_rate_start=10.0, slope=0.3, pitch_start=pi - 0.3)
    for k in range(100):
        PLANT.step(v, k * 1e-3, 1e-3)
    assert v.x == pytest.approx(0.05 * v.wheel_angle * cos(0.3), rel=1e-12)


def test_fall_is_remembered() -> None:
    v = started(PLANT, pitch_start=1.0)
    assert v.fallen == 0.0
    while abs(v.pitch) <= v.fallen_angle:
        assert v.fallen == 0.0
        PLANT.step(v, 0.0, 1e-3)
    assert v.fallen == 1.0
    v.body_torque = -20.0
    for _ in range(200):
        PLANT.step(v, 0.0, 1e-3)
        if abs(v.pitch) < 0.5:
            break
    assert abs(v.pitch) < 0.5
    assert v.fallen == 1.0


@pytest.mark.parametrize(("torque", "fallen"), [(0.0, 1.0), (10.0, 0.0)])
def test_a_start_beyond_the_fallen_angle_is_a_fall_only_if_the_released_robot_does_not_rise(torque, fallen) -> None:
    v = started(PLANT, pitch_start=-1.2, hold_time=0.01, body_torque=torque)
    for k in range(10):
        PLANT.step(v, k * 1e-3, 1e-3)
        assert (v.pitch, v.fallen) == (-1.2, 0.0)
    for k in range(10, 30):
        PLANT.step(v, k * 1e-3, 1e-3)
        assert v.fallen == fallen
    assert (v.pitch > -1.2) == (fallen == 0.0)


def test_inner_steps_divide_the_step_evenly() -> None:
    """1 ms in steps of at most 0.3 ms are four of 0.25 ms; 0.25 ms steps must not become five by rounding."""
    values = {"pitch_start": 0.3, "wheel_rate_start": 3.0}
    a = started(PLANT, **values, inner_step=3e-4)
    b = started(PLANT, **values, inner_step=2.5e-4)
    c = started(PLANT, **values, inner_step=2.5e-4)
    for k in range(100):
        PLANT.step(a, k * 1e-3, 1e-3)
        PLANT.step(b, k * 1e-3, 1e-3)
        for part in range(4):
            PLANT.step(c, k * 1e-3 + part * 2.5e-4, 2.5e-4)
    assert a.pitch == b.pitch == c.pitch


def test_tiny_last_steps_do_no_harm() -> None:
    v = started(PLANT, **nominal_friction(), pitch_start=0.3, wheel_rate_start=3.0)
    pitch = v.pitch
    for step in (1e-13, 1e-300, 0.0):
        PLANT.step(v, 0.0, step)
    assert v.pitch == pytest.approx(pitch, abs=1e-12)
    assert (
        v.pitch_acceleration
        == started(PLANT, **nominal_friction(), pitch_start=0.3, wheel_rate_start=3.0).pitch_acceleration
    )


def test_initialization_can_be_repeated() -> None:
    values = {
        "pitch_start": 0.3,
        "wheel_rate_start": 3.0,
        "yaw_rate_start": 1.0,
        "slope": 0.1,
        "left_drive_torque": 0.01,
    }
    once = started(PLANT, **nominal_friction(), **values)
    again = instance(PLANT, **nominal_friction(), **values)
    PLANT.initialize(again, 0.0)
    PLANT.step(again, 0.0, 1e-3)
    PLANT.initialize(again, 0.0)
    assert vars(again) == vars(once)


def test_not_a_number_is_never_taken_for_rest() -> None:
    v = started(PLANT, **nominal_friction())
    v.left_drive_torque = float("nan")
    PLANT.step(v, 0.0, 1e-3)
    assert isnan(v.pitch_rate)
    assert isnan(v.pitch_acceleration)


def test_parameters_that_contradict_each_other_are_named() -> None:
    assert FACE.check(instance(PLANT)) == []
    assert FACE.check(instance(PLANT, bump_length=0.6, bump_height=0.0)) == []
    (problem,) = FACE.check(instance(PLANT, bump_length=0.6, bump_height=0.01))
    assert problem == "bump_length = 0.6 m must not exceed bump_spacing = 0.5 m"
    (problem,) = FACE.check(instance(PLANT, bump_height=-0.04))
    assert problem == "bump_height = -0.04 m over bump_length = 0.1 m: slope 1.26 must be below 1"
    light = {
        "cog_height": 1e-3,
        "wheel_mass": 1e-4,
        "wheel_inertia": 1e-9,
        "body_pitch_inertia": 1e-6,
        "rotor_inertia": 1.0,
        "gear_inertia": 1.0,
    }
    (problem,) = FACE.check(instance(PLANT, **light, gear_ratio=1000.0, body_mass=1e-3, wheel_radius=1e-3))
    assert problem.startswith("masses, inertias and lengths: the mass matrix must be regular")
