"""Energy and momentum balances of the moving robot."""

from math import cos, sin
from typing import Any

import pytest
from plain import load, nominal_friction, started

from twip.robot.plant import constants
from twip.robot.terrain import bump

PLANT = load("plant").BLOCK
FRICTIONLESS = {"rolling_resistance": 0.0}


def energy(v: Any) -> float:
    """Kinetic and potential energy [J] by the parts' speeds; for a slope without bumps, or bumps without slope."""
    lean = v.pitch + v.ground_slope
    axle = v.wheel_radius * v.wheel_rate
    forward = axle + v.cog_height * v.pitch_rate * cos(lean)
    sideways = v.cog_height * v.yaw_rate * sin(lean)
    down = v.cog_height * v.pitch_rate * sin(lean)
    kinetic = v.body_mass * (forward * forward + sideways * sideways + down * down)
    kinetic += v.body_pitch_inertia * v.pitch_rate**2 + v.body_yaw_inertia * v.yaw_rate**2
    for rate in (v.left_wheel_rate, v.right_wheel_rate):
        kinetic += v.wheel_mass * (v.wheel_radius * rate) ** 2 + v.wheel_inertia * rate**2
        kinetic += (v.rotor_inertia + v.gear_inertia) * (v.gear_ratio * (rate - v.pitch_rate)) ** 2
    way = v.wheel_radius * v.wheel_angle
    rise = bump(way, v.bump_height, v.bump_length, v.bump_spacing, v.bump_start)[0] + way * sin(v.slope)
    potential = v.gravity * ((v.body_mass + 2 * v.wheel_mass) * rise + v.body_mass * v.cog_height * cos(v.pitch))
    return 0.5 * kinetic + potential


def run(v: Any, steps: int, step: float = 1e-3) -> None:
    for k in range(steps):
        PLANT.step(v, k * step, step)


MOTIONS = {
    "flat with a turn": {"pitch_start": 0.4, "wheel_rate_start": 8.0, "yaw_rate_start": 3.0},
    "slope with a turn": {"pitch_start": -0.3, "wheel_rate_start": 10.0, "yaw_rate_start": 2.0, "slope": 0.2},
    "bumps with a turn": {
        "pitch_start": 0.3,
        "wheel_rate_start": 12.0,
        "yaw_rate_start": 2.0,
        "bump_height": 0.02,
        "bump_length": 0.5,
        "bump_start": -0.1,
    },
}


@pytest.mark.parametrize("motion", MOTIONS.values(), ids=MOTIONS)
def test_energy_stays_without_friction_and_inputs(motion: dict[str, float]) -> None:
    errors = []
    for inner_step in (5e-4, 2.5e-4, 1.25e-4):
        v = started(PLANT, **FRICTIONLESS, **motion, inner_step=inner_step)
        before = energy(v)
        worst = 0.0
        for k in range(500):
            PLANT.step(v, k * 1e-3, 1e-3)
            worst = max(worst, abs(energy(v) - before))
        errors.append(worst)
    assert errors[1] < 3e-5  # J of 1.6 to 2.1 J: what the method loses on the way at the default inner step
    assert errors[0] / errors[1] == pytest.approx(4.0, abs=0.2)  # order 2, but for the next term of the error
    assert errors[1] / errors[2] == pytest.approx(4.0, abs=0.2)


def test_work_of_all_inputs_goes_into_energy() -> None:
    errors = []
    for inner_step in (5e-4, 2.5e-4):
        v = started(PLANT, **FRICTIONLESS, pitch_start=0.2, wheel_rate_start=5.0, inner_step=inner_step)
        v.left_drive_torque = v.right_drive_torque = 0.008
        v.push_force, v.body_torque = -1.5, 0.1
        before, pushed, pitch = energy(v), v.x + v.push_height * sin(v.pitch), v.pitch
        left, right = v.left_shaft_angle, v.right_shaft_angle
        run(v, 300)
        work = v.left_drive_torque * (v.left_shaft_angle - left) + v.right_drive_torque * (v.right_shaft_angle - right)
        work += v.push_force * (v.x + v.push_height * sin(v.pitch) - pushed) + v.body_torque * (v.pitch - pitch)
        errors.append(abs(energy(v) - before - work))
        assert abs(work) > 0.1
    assert errors[1] < 1e-6
    assert 3.5 < errors[0] / errors[1] < 4.5  # order 2


def test_friction_takes_its_share_while_everything_slides_one_way() -> None:
    v = started(PLANT, **nominal_friction(), pitch_start=0.1, wheel_rate_start=20.0, yaw_rate_start=1.0)
    before, pitch, yaw = energy(v), v.pitch, v.yaw
    left, right, wheel = v.left_shaft_angle, v.right_shaft_angle, v.wheel_angle
    for k in range(200):
        PLANT.step(v, k * 1e-3, 1e-3)
        assert min(v.left_shaft_speed, v.right_shaft_speed, v.left_wheel_rate, v.right_wheel_rate) > 0.0
    assert (v.pitch, v.yaw) != (pitch, yaw)
    lost = v.left_coulomb_forward_limit * (v.left_shaft_angle - left)
    lost += v.right_coulomb_forward_limit * (v.right_shaft_angle - right)
    rolling = 0.5 * v.rolling_resistance * v.gravity * (v.body_mass + 2 * v.wheel_mass) * v.wheel_radius
    lost += 2 * rolling * (v.wheel_angle - wheel)
    assert lost > 0.05
    assert energy(v) - before == pytest.approx(-lost, abs=2e-6)  # order 2 at the default inner step


@pytest.mark.parametrize("static", [1.0, 1.5])
def test_friction_never_drives(static: float) -> None:
    """Driven to and fro with a turn through many reversals and stops: friction power is never positive."""
    v = started(PLANT, **nominal_friction(static), pitch_start=0.02)
    stuck = moved = 0
    for k in range(4000):
        t = k * 1e-3
        v.left_drive_torque = 0.0011 * sin(9.0 * t) + 0.1 * v.pitch + 0.01 * v.pitch_rate
        v.right_drive_torque = 0.0011 * sin(7.0 * t + 1.0) + 0.1 * v.pitch + 0.01 * v.pitch_rate
        PLANT.step(v, t, 1e-3)
        contacts = (
            (v.left_friction_torque, v.left_shaft_speed), (v.right_friction_torque, v.right_shaft_speed),
            (v.left_rolling_torque, v.left_wheel_rate), (v.right_rolling_torque, v.right_wheel_rate),
        )  # fmt: skip
        for torque, speed in contacts:
            assert torque * speed <= 0.0
            stuck += speed == 0.0
            moved += speed != 0.0
    assert stuck > 500
    assert moved > 500


@pytest.mark.parametrize("static", [1.0, 1.5])
def test_energy_only_falls_with_friction_and_without_inputs(static: float) -> None:
    """The hanging robot swings out: its energy falls to that of a place of rest and stays exactly there."""
    v = started(PLANT, **nominal_friction(static), pitch_start=2.9, wheel_rate_start=3.0, yaw_rate_start=2.0)
    last = energy(v)
    for k in range(4000):
        PLANT.step(v, k * 1e-3, 1e-3)
        now = energy(v)
        assert now <= last + 1e-7  # the smooth motion's own error of a step, order 3
        last = now
    assert v.pitch_rate == v.left_wheel_rate == v.right_wheel_rate == 0.0


def test_push_and_drive_give_their_momentum() -> None:
    """Without yaw and slope theta is cyclic: M22 theta' + M24 psi' changes by the wheel torques' impulse."""

    def momentum() -> float:
        m22, _, reflected, first_moment, *_ = constants(v)
        return m22 * v.wheel_rate + (first_moment * cos(v.pitch) - reflected) * v.pitch_rate

    v = started(PLANT, **nominal_friction(), pitch_start=0.3, wheel_rate_start=10.0)
    v.push_force, v.left_drive_torque = 2.0, 0.004
    v.right_drive_torque = 0.004 + v.right_coulomb_forward_limit - v.left_coulomb_forward_limit  # straight on
    before = momentum()
    run(v, 200)
    assert min(v.left_shaft_speed, v.right_shaft_speed, v.left_wheel_rate, v.right_wheel_rate) > 0.0
    drive = v.left_drive_torque + v.right_drive_torque - v.left_coulomb_forward_limit - v.right_coulomb_forward_limit
    weight = v.gravity * (v.body_mass + 2 * v.wheel_mass)
    torque = v.gear_ratio * drive + v.push_force * v.wheel_radius - v.rolling_resistance * weight * v.wheel_radius
    assert momentum() - before == pytest.approx(0.2 * torque, rel=1e-4)  # order 2, over 0.2 s
