"""The motor against the analytic solution of its winding, and its encoder."""

import itertools
from math import exp, floor, inf, pi, sin

import pytest
from plain import load, started
from scipy.integrate import quad

from twip.robot.encoder import encoder_count
from twip.robot.motor import current_response, motor_step, viscous_torque
from twip.robot.parameters import value

MOTOR = load("motor").BLOCK
R, L, KT, KB = (value(name) for name in ("resistance", "inductance", "torque_constant", "back_emf_constant"))
FORWARD, REVERSE = value("left.viscous_forward"), value("left.viscous_reverse")


def analytic_current(t: float, start: float, voltage: float, speed: float) -> float:
    steady = (voltage - KB * speed) / R
    return steady + (start - steady) * exp(-R / L * t)


@pytest.mark.parametrize("step", [1e-6, 2e-5, 1e-4, 1e-3, 5e-3])
@pytest.mark.parametrize("speed", [300.0, -50.0, 0.0])
def test_current_and_mean_torque_are_exact(step: float, speed: float) -> None:
    start, voltage = 0.8, -3.0
    end, torque = motor_step(start, voltage, speed, step, R, L, KT, KB, FORWARD, REVERSE)
    assert end == pytest.approx(analytic_current(step, start, voltage, speed), rel=1e-13)
    charge = 0.0
    edges = [step * min(k * 2e-5 / step, 1.0) for k in range(round(step / 2e-5) + 2)]
    for a, b in itertools.pairwise(edges):
        charge += quad(analytic_current, a, b, args=(start, voltage, speed), epsabs=0.0, epsrel=1e-13)[0]
    viscous = -(FORWARD if speed > 0 else REVERSE) * speed
    assert torque == pytest.approx(KT * charge / step + viscous, rel=1e-10)  # what the quadrature gives


def test_any_division_of_a_step_gives_the_same() -> None:
    whole = motor_step(0.1, 6.0, 80.0, 1e-3, R, L, KT, KB, FORWARD, REVERSE)
    current, torque = 0.1, 0.0
    for part in (1e-4, 3e-4, 6e-4):
        current, mean = motor_step(current, 6.0, 80.0, part, R, L, KT, KB, FORWARD, REVERSE)
        torque += mean * part / 1e-3
    assert (current, torque) == pytest.approx(whole, rel=1e-13)


def test_mean_current_of_short_steps_has_no_cancellation() -> None:
    """Across the change of formula at x = 1e-4: the mean decay is 1 - x/2 + x^2/6 up to x^3/24."""
    for x in (0.0, 1e-300, 1e-13, 9e-5, 0.9999e-4, 1.0001e-4, 2e-4):
        _, mean = current_response(1.0, 0.0, x, 1.0)
        # above 1e-4 the difference of two numbers near 1 leaves a rounding of 1e-16/x
        assert mean == pytest.approx(1.0 - x / 2.0 + x * x / 6.0 - x**3 / 24.0, abs=3e-12 if x > 1e-4 else 3e-16)


def test_energy_balance_of_the_winding() -> None:
    """Electrical work goes into heat, field and shaft: v i = R i^2 + L i di/dt + K_b omega i."""
    current, work, heat, shaft = 0.0, 0.0, 0.0, 0.0
    step, speed, voltage = 1e-5, 60.0, 9.0
    for _ in range(400):
        before = current
        current, torque = motor_step(before, voltage, speed, step, R, L, KT, KB, 0.0, 0.0)
        mean = torque / KT
        work += voltage * mean * step
        shaft += torque * speed * step
        steady, rate = (voltage - KB * speed) / R, R / L
        square = steady**2 * step + 2 * steady * (mean - steady) * step
        square += (before - steady) ** 2 * (1.0 - exp(-2 * rate * step)) / (2 * rate)
        heat += R * square
    assert work == pytest.approx(heat + shaft + 0.5 * L * current * current, rel=1e-12)


@pytest.mark.parametrize(("speed", "expected"), [(100.0, -1.886e-4), (-100.0, 2.394e-4), (0.0, 0.0)])
def test_viscous_torque_has_a_value_per_direction(speed: float, expected: float) -> None:
    assert viscous_torque(speed, FORWARD, REVERSE) == pytest.approx(expected, rel=1e-12)
    assert viscous_torque(speed, FORWARD, REVERSE) * speed <= 0.0


def test_counts_are_rounded_down_on_both_sides_of_zero() -> None:
    count = 2 * pi / 2048
    assert [encoder_count(x * count, 2048.0) for x in (-1.5, -0.5, 0.0, 0.5, 1.5, 2048.2)] == [-2, -1, 0, 0, 1, 2048]


def test_block_counts_at_the_end_of_the_step() -> None:
    m = started(MOTOR)
    angle, speed, step = 0.0, 0.0, 1e-3
    for k in range(500):
        m.shaft_angle, m.shaft_speed = angle, speed
        MOTOR.step(m, k * step, step)
        angle += speed * step
        assert m.encoder_count == floor(angle * 2048 / (2 * pi))
        speed = 40.0 * sin(0.02 * k)


def test_block_passes_its_friction_on() -> None:
    m = started(
        MOTOR, coulomb_forward=1e-3, coulomb_reverse=2e-3, static_forward=3e-3, static_reverse=4e-3, stribeck_speed=0.5
    )
    limits = (m.coulomb_forward_limit, m.coulomb_reverse_limit, m.static_forward_limit, m.static_reverse_limit)
    assert limits == (1e-3, 2e-3, 3e-3, 4e-3)
    assert m.stribeck_speed_limit == 0.5


def test_block_starts_without_current() -> None:
    m = started(MOTOR, voltage=12.0, shaft_speed=100.0, shaft_angle=1.0)
    assert m.current == 0.0
    assert m.drive_torque == pytest.approx(-1.886e-4, rel=1e-12)
    assert m.encoder_count == floor(2048 / (2 * pi))
    MOTOR.step(m, 0.0, 1e-3)
    assert m.current == pytest.approx((12.0 - 1.34) / 1.9, rel=1e-11)  # 29 time constants later
    assert m.drive_torque < inf
