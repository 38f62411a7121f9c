"""Section 3 of the paper as printed, and what becomes of it: eqs (13) to (39), see docs/errata.md."""

import math

import pytest
import sympy as sp
from plain import load, nominal_friction, started

from twip.robot.motor import motor_step
from twip.robot.parameters import value
from twip.robot.plant import constants

PLANT = load("plant").BLOCK
N = value("gear_ratio")
A = value("track_width") / (2 * value("wheel_radius"))
MOTOR = (value("resistance"), value("inductance"), value("torque_constant"), value("back_emf_constant"))
TABLES_1_AND_3 = {"left": -7.223e-4, "right": -5.6e-4}
"""T_c as printed, forward, N.m; the paper's section 3 calls it T_s."""


def shaft_torque(voltage, speed, viscous=0.0):
    """Return the motor's torque [N.m] with a settled winding."""
    return motor_step(0.0, voltage, speed, 1e9, *MOTOR, viscous, viscous)[1]


def test_eq_13_the_sum_turns_gravity_round():
    """Lagrange's equations of T1 + T2 - U are eqs (30) and (31); those of T1 + T2 + U hold the robot upright."""
    t = sp.Symbol("t")
    theta, psi = sp.Function("theta")(t), sp.Function("psi")(t)
    m, body, radius, length, wheel, pitch_inertia, reflected, g = sp.symbols("m M R L Jw Jpsi Jr g", positive=True)
    forward = radius * theta.diff(t) + length * psi.diff(t) * sp.cos(psi)
    kinetic = (
        m * (radius * theta.diff(t)) ** 2
        + body * (forward**2 + (length * psi.diff(t) * sp.sin(psi)) ** 2) / 2
        + wheel * theta.diff(t) ** 2
        + pitch_inertia * psi.diff(t) ** 2 / 2
        + reflected * (theta.diff(t) - psi.diff(t)) ** 2 / 2  # 2 n^2 J_m
    )
    potential = body * g * length * sp.cos(psi)

    def rows(lagrangian):
        return [lagrangian.diff(q.diff(t)).diff(t) - lagrangian.diff(q) for q in (theta, psi)]

    mixed = body * length * radius * sp.cos(psi) - reflected
    row_30 = ((2 * m + body) * radius**2 + 2 * wheel + reflected) * theta.diff(t, 2) + mixed * psi.diff(t, 2)
    row_30 -= body * length * radius * psi.diff(t) ** 2 * sp.sin(psi)
    row_31 = mixed * theta.diff(t, 2) + (body * length**2 + pitch_inertia + reflected) * psi.diff(t, 2)
    row_31 -= body * g * length * sp.sin(psi)
    right, printed = rows(kinetic - potential), rows(kinetic + potential)
    assert [sp.simplify(a - b) for a, b in zip(right, (row_30, row_31), strict=True)] == [0, 0]
    assert sp.simplify(printed[1] - right[1] - 2 * body * g * length * sp.sin(psi)) == 0


def test_eq_17_loses_the_gears_inertia():
    """n^2 J_m without J_redu of eq (12): 10 % of the rotor's terms, 0.4 % of M22."""
    m22, _, reflected, *_ = constants(started(PLANT))
    lost = reflected - 2 * N**2 * value("rotor_inertia")
    assert lost == pytest.approx(2 * N**2 * 6.68e-8, rel=1e-9)
    assert lost / reflected == pytest.approx(0.105, abs=1e-3)
    assert lost / m22 == pytest.approx(0.0041, abs=1e-4)


def test_eq_17_neglects_that_the_body_carries_the_rotors():
    """A rotor turns at n theta' - (n-1) psi': 7 % off its term in M24, 14 % in M44; 0.2 % of M24 and M44 in all."""
    wheel, body, n, rotor = sp.symbols("wheel body n J")
    exact = sp.expand(rotor * (n * wheel - (n - 1) * body) ** 2)
    printed = sp.expand(rotor * n**2 * (wheel - body) ** 2)
    missing = {
        "M22": sp.simplify((exact - printed).diff(wheel, 2)), "M24": sp.simplify((exact - printed).diff(wheel, body)),
        "M44": sp.expand((exact - printed).diff(body, 2)),
    }  # fmt: skip
    assert missing == {"M22": 0, "M24": 2 * n * rotor, "M44": sp.expand(-(4 * n - 2) * rotor)}
    _, m44, reflected, first_moment, *_ = constants(started(PLANT))
    jm = value("rotor_inertia")
    rotors = 2 * N**2 * jm
    assert 2 * N * jm / rotors == pytest.approx(0.07, abs=5e-3)
    assert (4 * N - 2) * jm / rotors == pytest.approx(0.14, abs=5e-3)
    assert 2 * N * jm / (first_moment - reflected) == pytest.approx(2.1e-3, abs=1e-4)
    assert (4 * N - 2) * jm / m44 == pytest.approx(1.6e-3, abs=1e-4)


@pytest.mark.parametrize("side", ["left", "right"])
def test_eqs_25_26_friction_of_the_motor_shaft_acts_n_times_and_n_squared_times(side):
    """At the wheel n T_c and n^2 sigma: printed 13.7 and 188 times too small, by the blocks' own power."""
    v = started(PLANT, **nominal_friction(), wheel_rate_start=7.0, pitch_rate_start=2.0)
    friction, speed = getattr(v, f"{side}_friction_torque"), getattr(v, f"{side}_shaft_speed")
    relative_rate = v.wheel_rate - v.pitch_rate
    at_the_wheel = friction * speed / relative_rate  # what takes this power at the wheel's rate
    assert at_the_wheel / TABLES_1_AND_3[side] == pytest.approx(13.7, rel=1e-12)
    viscous = value(f"{side}.viscous_forward")
    lost = shaft_torque(0.0, speed, 0.0) - shaft_torque(0.0, speed, viscous)
    printed = viscous * relative_rate
    assert lost * speed / relative_rate / printed == pytest.approx(13.7**2, rel=1e-12)


def test_eqs_25_26_printed_friction_drives_a_wheel_that_rolls_backwards():
    """+T_s has one sign: with the tables' -7.2e-4 N.m it brakes forward and drives backward motion."""
    powers = [TABLES_1_AND_3["left"] * rate for rate in (5.0, -5.0)]
    assert powers[0] < 0.0 < powers[1]
    for rate in (5.0, -5.0):
        v = started(PLANT, **nominal_friction(), wheel_rate_start=rate)
        assert v.left_friction_torque * v.left_shaft_speed < 0.0


def test_eq_28_is_a_current_not_its_derivative():
    """With L = 0 eq (27) leaves i = (v - K_b omega)/R, as eq (29) then uses it."""
    assert shaft_torque(3.0, 100.0) == pytest.approx(0.0134 * (3.0 - 0.0134 * 100.0) / 1.9, rel=1e-12)


def test_eq_34_friction_acts_on_the_body_against_the_wheels():
    """What brakes the wheels pushes the body: the two friction torques of rows 1 and 2 cancel in their sum."""
    motion = {"pitch_start": 0.2, "wheel_rate_start": 9.0, "pitch_rate_start": -1.0, "rolling_resistance": 0.0}
    bare, rubbed = started(PLANT, **motion), started(PLANT, **motion, **nominal_friction())
    m22, m44, reflected, first_moment, *_ = constants(bare)
    m24 = first_moment * math.cos(0.2) - reflected
    wheel = rubbed.wheel_acceleration - bare.wheel_acceleration
    pitch = rubbed.pitch_acceleration - bare.pitch_acceleration
    friction = -N * (value("left.coulomb_forward") + value("right.coulomb_forward"))
    assert m22 * wheel + m24 * pitch == pytest.approx(friction, rel=1e-9)
    assert m24 * wheel + m44 * pitch == pytest.approx(-friction, rel=1e-9)


def test_eq_35_halves_the_motors_yaw_damping():
    """Motors at 0 V brake a turn with a^2 M21 = 0.1447 N.m.s; eq (35) has half the back-EMF and n^2 less friction."""
    yaw_rate, viscous = 1.0, 1.9e-6
    torques = [shaft_torque(0.0, sign * N * A * yaw_rate, viscous) for sign in (-1, 1)]
    damping = -N * A * (torques[1] - torques[0]) / yaw_rate
    resistance, _, torque_constant, back_emf = MOTOR
    printed = 2 * A**2 * (N**2 * torque_constant * back_emf / (2 * resistance) + viscous)
    derived = 2 * A**2 * N**2 * (torque_constant * back_emf / resistance + viscous)
    assert damping == pytest.approx(derived, rel=1e-12)
    assert damping == pytest.approx(0.1447, abs=1e-4)
    assert printed / damping == pytest.approx(0.49, abs=5e-3)


@pytest.mark.parametrize(
    ("left", "right", "expected"),
    [("forward", "forward", 0.00445), ("reverse", "forward", -0.02996), ("forward", "reverse", 0.03229)],
)
def test_eq_35_lacks_coulomb_friction(left, right, expected):
    """-n a (T_cr sgn - T_cl sgn): 0.0045 N.m straight on, sides being unequal, 0.030 or 0.032 N.m on the spot."""
    rolling = {"forward": 9.0, "reverse": -9.0}
    rates = rolling[left], rolling[right]
    motion = {"wheel_rate_start": sum(rates) / 2, "yaw_rate_start": (rates[1] - rates[0]) / (2 * A)}
    bare = started(PLANT, **motion, rolling_resistance=0.0)
    v = started(PLANT, **motion, rolling_resistance=0.0, **nominal_friction())
    torque = constants(v).m66 * (v.yaw_acceleration - bare.yaw_acceleration)
    coulomb = [math.copysign(value(f"{side}.coulomb_{way}"), rate)
               for side, way, rate in (("left", left, rates[0]), ("right", right, rates[1]))]  # fmt: skip
    assert torque == pytest.approx(-N * A * (coulomb[1] - coulomb[0]), rel=1e-9)
    assert torque == pytest.approx(expected, abs=1e-5)
