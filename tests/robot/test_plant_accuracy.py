"""The order of the plant's integration and its error at the default inner step."""

from math import degrees, log, radians, sin

import pytest
from plain import load, nominal_friction, started

from twip.robot.parameters import value

PLANT = load("plant").BLOCK
MOTOR = load("motor").BLOCK
FINE = 5e-6
"""Inner step [s] of the references; halving it once more moves them by less than 3e-5 deg."""


SIGNALS = ("pitch", "pitch_rate", "wheel_angle", "wheel_rate", "yaw", "yaw_rate", "x", "y", "pitch_acceleration")


def fall(inner_step: float) -> list[tuple[float, ...]]:
    """Return the signals of a fall from 27 deg with constant torques, every contact sliding forward all the time."""
    v = started(
        PLANT, **nominal_friction(), pitch_start=radians(27), wheel_rate_start=20.0, yaw_rate_start=1.0,
        left_drive_torque=0.006, right_drive_torque=0.007, inner_step=inner_step,
    )  # fmt: skip
    rows = []
    for k in range(30):
        PLANT.step(v, k * 4e-3, 4e-3)
        assert min(v.left_shaft_speed, v.right_shaft_speed, v.left_wheel_rate, v.right_wheel_rate) > 0.0
        rows.append(tuple(getattr(v, name) for name in SIGNALS))
    return rows


def test_second_order_while_everything_slides() -> None:
    reference = fall(2e-5)
    errors = []
    for inner_step in (2e-3, 1e-3, 5e-4):
        pairs = [zip(row, exact, strict=True) for row, exact in zip(fall(inner_step), reference, strict=True)]
        errors.append([max(column) for column in zip(*([abs(a - b) for a, b in pair] for pair in pairs), strict=True)])
    for name, coarse, middle, fine in zip(SIGNALS, *errors, strict=True):
        # 2, but for the next term of the error and the reference's own, 1/600 of the finest
        assert log(coarse / middle, 2) == pytest.approx(2.0, abs=0.1), name
        assert log(middle / fine, 2) == pytest.approx(2.0, abs=0.05), name


def closed_loop(inner_step: float, duration: float, start: float, static: float, ripple: float) -> list[float]:
    """Return the pitch [rad] of a robot balanced by a PID law every 5 ms, motors and plant every 1 ms, Jacobi."""
    sides = ("left", "right")
    plant = started(PLANT, **nominal_friction(static), pitch_start=start, inner_step=inner_step)
    kinds = ("coulomb_forward", "coulomb_reverse", "viscous_forward", "viscous_reverse")
    motors = {s: started(MOTOR, **{k: value(f"{s}.{k}") for k in kinds}) for s in sides}
    integral = 0.0
    pitches = []
    for k in range(round(duration * 1000)):
        t = k * 1e-3
        if k % 5 == 0:
            error = plant.pitch - ripple * sin(3.0 * t)
            integral += 0.005 * error
            balance = 25.0 * error + 40.0 * integral + 1.0 * plant.pitch_rate
            turn = 0.3 * sin(2.0 * t)
            volts = {"left": balance - turn, "right": balance + turn}
        for s in sides:
            motors[s].voltage = max(-12.0, min(12.0, volts[s]))
            motors[s].shaft_speed = getattr(plant, f"{s}_shaft_speed")
            MOTOR.step(motors[s], t, 1e-3)
        for s in sides:
            setattr(plant, f"{s}_drive_torque", motors[s].drive_torque)
        PLANT.step(plant, t, 1e-3)
        pitches.append(plant.pitch)
    return pitches


def error(inner_step: float, reference: list[float], **case: float) -> float:
    """Return the largest error of the pitch [deg]."""
    return degrees(max(abs(a - b) for a, b in zip(closed_loop(inner_step, **case), reference, strict=True)))


def test_error_of_the_stand_up_at_the_default_step() -> None:
    case = {"duration": 0.8, "start": radians(27), "static": 1.0, "ripple": 0.0}
    reference = closed_loop(FINE, **case)
    assert error(value("inner_step"), reference, **case) < 5e-4
    assert error(1e-3, reference, **case) < 2e-3


@pytest.mark.parametrize("static", [1.0, 1.3])
def test_error_and_order_through_stick_and_slip(static: float) -> None:
    """Standing on its friction with a slow ripple: the shafts stick and break away several times."""
    case = {"duration": 1.0, "start": radians(0.5), "static": static, "ripple": 0.01}
    reference = closed_loop(FINE, **case)
    assert error(value("inner_step"), reference, **case) < 2e-3
    errors = [error(h, reference, **case) for h in (1e-3, 5e-4, 2.5e-4, 1.25e-4, 6.25e-5)]
    # events fall anywhere within a step, so single ratios jump; from first to last step (1/16) order 1 gains 16
    assert errors[-1] < errors[0] / 16.0
