"""What the nominal robot should come to: coefficients, poles, and torques that hold it against falling."""

from math import cos, radians, sin

import numpy as np
import pytest
from plain import load, nominal_friction, started

from twip.robot.parameters import value
from twip.robot.plant import constants

PLANT = load("plant").BLOCK
N = value("gear_ratio")
RESISTANCE, TORQUE_CONSTANT = value("resistance"), value("torque_constant")
VISCOUS = sum(value(f"{s}.viscous_{w}") for s in ("left", "right") for w in ("forward", "reverse")) / 4
DAMPING = TORQUE_CONSTANT * value("back_emf_constant") / RESISTANCE + VISCOUS

# the expected numbers are rounded to as many digits as are written here: half a unit of the last one
LAST_DIGIT = 5e-4


def test_coefficients_of_the_equations() -> None:
    m22, m44, reflected, first_moment, _, m66, a, gravity_torque, _ = constants(started(PLANT))
    m24 = first_moment - reflected
    m21 = 2 * N * N * DAMPING
    assert m22 == pytest.approx(6.080e-3, rel=LAST_DIGIT)
    assert m24 == pytest.approx(7.511e-3, rel=LAST_DIGIT)
    assert m44 == pytest.approx(1.869e-2, rel=LAST_DIGIT)
    assert m22 * m44 - m24 * m24 == pytest.approx(5.723e-5, rel=LAST_DIGIT)
    assert m66 == pytest.approx(8.750e-3, rel=LAST_DIGIT)
    assert m21 == pytest.approx(3.617e-2, rel=LAST_DIGIT)
    assert a * a * m21 == pytest.approx(0.1447, rel=LAST_DIGIT)
    assert gravity_torque == pytest.approx(1.5206, rel=LAST_DIGIT)


def test_poles_of_the_voltage_driven_robot() -> None:
    """Linearized by differences of the plant's own accelerations, the motors' damping put in as torque."""

    def accelerations(pitch: float, wheel_rate: float, pitch_rate: float) -> tuple[float, float]:
        rates = {"wheel_rate_start": wheel_rate, "pitch_rate_start": pitch_rate}
        v = started(PLANT, rolling_resistance=0.0, pitch_start=pitch, **rates)
        v.left_drive_torque, v.right_drive_torque = -DAMPING * v.left_shaft_speed, -DAMPING * v.right_shaft_speed
        PLANT.initialize(v, 0.0)
        return v.wheel_acceleration, v.pitch_acceleration

    d = 1e-4
    columns = []
    for state in ((d, 0.0, 0.0), (0.0, d, 0.0), (0.0, 0.0, d)):
        plus, minus = accelerations(*state), accelerations(*(-x for x in state))
        columns.append([(p - m) / (2 * d) for p, m in zip(plus, minus, strict=True)])
    (wheel, pitch) = np.array(columns).T
    poles = sorted(np.linalg.eigvals([[0.0, 0.0, 1.0], wheel, pitch]).real)
    assert poles == pytest.approx([-29.5, -3.9, 8.3], abs=0.05)


def holding_torque(angle: float, **values: float) -> float:
    """Return both motors' torque at the wheels [N.m] that gives a leaning robot no pitch acceleration."""

    def acceleration(torque: float) -> float:
        v = started(PLANT, **values, pitch_start=radians(angle), wheel_rate_start=1e-9)
        v.left_drive_torque = v.right_drive_torque = torque / (2 * N)
        PLANT.initialize(v, 0.0)
        return float(v.pitch_acceleration)

    low, high = 0.0, 2.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if acceleration(middle) > 0.0 else (low, middle)
    return low


def current(torque: float) -> float:
    return torque / (2 * N * TORQUE_CONSTANT)


def test_torque_that_keeps_a_leaning_robot_from_falling_while_it_rolls() -> None:
    shafts = N * (value("left.coulomb_forward") + value("right.coulomb_forward"))
    assert holding_torque(27.0, rolling_resistance=0.0) == pytest.approx(0.329, abs=1e-3)
    torque = holding_torque(27.0, rolling_resistance=0.0, **nominal_friction())
    assert torque == pytest.approx(holding_torque(27.0, rolling_resistance=0.0) + shafts, abs=1e-9)
    assert torque == pytest.approx(0.347, abs=1e-3)
    assert current(torque) == pytest.approx(0.94, abs=0.01)
    assert RESISTANCE * current(torque) == pytest.approx(1.8, abs=0.05)
    at_30 = holding_torque(30.0, rolling_resistance=0.0, **nominal_friction())
    assert RESISTANCE * current(at_30) == pytest.approx(2.0, abs=0.05)


@pytest.mark.parametrize(("angle", "torque", "amps", "volts"), [(27.0, 0.690, 1.88, 3.57), (30.0, 0.760, 2.07, 3.93)])
def test_torque_that_keeps_a_leaning_robot_from_falling_on_blocked_wheels(
    angle: float, torque: float, amps: float, volts: float
) -> None:
    held = holding_torque(angle, wheels_locked=1.0)
    assert held == pytest.approx(torque, abs=6e-4)
    assert current(held) == pytest.approx(amps, abs=6e-3)
    assert RESISTANCE * current(held) == pytest.approx(volts, abs=6e-3)


@pytest.mark.parametrize(("yaw_rate", "left", "right"), [(1.0, "reverse", "forward"), (-1.0, "forward", "reverse")])
def test_friction_of_turning_on_the_spot(yaw_rate: float, left: str, right: str) -> None:
    """About the vertical, rolling resistance makes 0.0216 N.m in all; the shafts run in opposite directions."""
    v = started(PLANT, **nominal_friction(), yaw_rate_start=yaw_rate)
    a = v.track_width / (2 * v.wheel_radius)
    assert a * (v.right_rolling_torque - v.left_rolling_torque) == pytest.approx(-yaw_rate * 0.0216, abs=5e-5)
    shafts = a * N * (v.right_friction_torque - v.left_friction_torque)
    expected = a * N * (value(f"left.coulomb_{left}") + value(f"right.coulomb_{right}"))
    assert shafts == pytest.approx(-yaw_rate * expected, rel=1e-12)


def test_push_on_a_slope_acts_along_the_horizontal() -> None:
    """The push's torques are its force times the horizontal way per wheel and pitch angle."""
    base = started(PLANT, rolling_resistance=0.0, pitch_start=0.4, slope=0.3)
    pushed = started(PLANT, rolling_resistance=0.0, pitch_start=0.4, slope=0.3, push_force=2.0)
    wheel = pushed.wheel_acceleration - base.wheel_acceleration
    pitch = pushed.pitch_acceleration - base.pitch_acceleration
    m22, m44, reflected, first_moment, *_ = constants(base)
    m24 = first_moment * cos(0.7) - reflected
    assert m22 * wheel + m24 * pitch == pytest.approx(2.0 * 0.05 * cos(0.3), rel=1e-9)
    assert m24 * wheel + m44 * pitch == pytest.approx(2.0 * 0.15 * cos(0.4), rel=1e-9)
    assert sin(base.ground_slope) == pytest.approx(sin(0.3), rel=1e-12)
