"""The reference itself: closed forms, energy, convergence, and the plant's accelerations by another derivation."""

import math

import numpy as np
import pytest
from coupling_error import SCENARIOS, reference
from monolithic import STEP, Scenario, solve
from monolithic_events import (
    CURRENT,
    LEFT,
    PITCH,
    RATE,
    RIGHT,
    accelerations,
    advance,
    contact_rows,
    energy,
    next_mode,
    parameters,
    power_balance,
    record,
)
from plain import load, nominal_friction, started

from twip.robot.parameters import value

PLANT = load("plant").BLOCK
FRICTIONLESS = {
    f"{side}_{kind}_{way}": 0.0
    for side in ("left", "right")
    for kind in ("coulomb", "static", "viscous")
    for way in ("forward", "reverse")
} | {"rolling_resistance": 0.0}


def mode_of(y, p):
    contacts = np.array([row @ y[LEFT : RATE + 1] for row in contact_rows(p)])
    return next_mode(y, p, np.sign(contacts), np.abs(contacts) < 1e-12)  # rounding of a shaft's speed over n


@pytest.mark.parametrize("seed", range(20))
def test_accelerations_agree_with_the_plant(seed):
    """Kane's equations here, Lagrange's with the non-holonomic terms there; sliding, or with some contacts at rest."""
    random = np.random.default_rng(seed)
    n = value("gear_ratio")
    p = parameters(**{name: 0.0 for name in FRICTIONLESS if "viscous" in name})
    y = np.zeros(8)
    y[PITCH] = random.uniform(-1.0, 1.0)
    if seed % 4:
        y[LEFT], y[RIGHT], y[RATE] = random.uniform(-200.0, 200.0), random.uniform(-200.0, 200.0), random.uniform(-3, 3)
    if seed % 4 == 1:
        y[LEFT] = 0.0  # a shaft at rest
    if seed % 4 == 2:
        y[RIGHT] = -n * y[RATE]  # a wheel at rest
    y[CURRENT:] = random.uniform(-0.3, 0.3, 2)
    wheels = y[LEFT : RIGHT + 1] / n + y[RATE]
    if seed % 4 == 2:
        wheels[1] = 0.0
    v = started(
        PLANT, **nominal_friction(), pitch_start=y[PITCH], pitch_rate_start=y[RATE], wheel_rate_start=wheels.mean(),
        yaw_rate_start=value("wheel_radius") / value("track_width") * (wheels[1] - wheels[0]),
        left_drive_torque=value("torque_constant") * y[CURRENT],
        right_drive_torque=value("torque_constant") * y[CURRENT + 1],
    )  # fmt: skip
    # the start values pass through mean and difference: what rests must do so to the last bit
    v.left_wheel_rate, v.right_wheel_rate = wheels
    PLANT.step(v, 0.0, 1e-13)
    u, _, _ = accelerations(y, p, mode_of(y, p))
    left, right = u[0] / n + u[2], u[1] / n + u[2]
    expected = (0.5 * (left + right), u[2], value("wheel_radius") / value("track_width") * (right - left))
    found = (v.wheel_acceleration, v.pitch_acceleration, v.yaw_acceleration)
    # 1e-9 of some 100 rad/s2: roundings; the step of 1e-13 s changes the state by 1e-11
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-8)


def test_energy_changes_by_what_supply_and_losses_bring():
    """From rest with constant voltages: the contacts stick, break away, and the robot turns on the spot as it tips."""
    p = parameters()
    y = np.zeros(8)
    y[PITCH] = 0.05
    voltage = np.array([0.9, -0.4])
    mode = mode_of(y, p)
    h, events, work = 1e-5, 0, 0.0
    begin, power = energy(y, p), power_balance(y, p, mode, voltage)
    largest = 0.0
    for _ in range(30000):
        events += advance(y, p, mode, voltage, h)
        before, power = power, power_balance(y, p, mode, voltage)
        work += 0.5 * h * (before + power)
        largest = max(largest, abs(work))
    assert events > 0
    assert largest > 0.01
    # trapezoidal rule: 1.2e-7 J while the current rises, a quarter with half the step
    assert energy(y, p) - begin == pytest.approx(work, abs=2e-7)


def test_friction_stops_a_rolling_robot_when_the_closed_form_says():
    """Without motors and with the centre of gravity on the axle, rolling resistance alone: uniform deceleration."""
    p = parameters(
        **{**FRICTIONLESS, "rolling_resistance": 0.02}, torque_constant=0.0, cog_height=0.0, rotor_inertia=0.0,
        gear_inertia=0.0,
    )  # fmt: skip
    y = np.zeros(8)
    rate = 2.0
    y[LEFT] = y[RIGHT] = value("gear_ratio") * rate
    mass = value("body_mass") + 2 * value("wheel_mass")
    radius = value("wheel_radius")
    torque = 0.02 * mass * value("gravity") * radius
    stop = rate * (mass * radius * radius + 2 * value("wheel_inertia")) / torque
    mode = mode_of(y, p)
    h = 2e-5  # the idle windings must stay stable
    steps = math.floor(stop / h)
    for _ in range(steps):
        assert advance(y, p, mode, np.zeros(2), h) == 0
    wheel = y[LEFT] / value("gear_ratio") + y[RATE]
    # the state is integrated in time exactly (constant acceleration): roundings of some 1e4 steps
    assert wheel == pytest.approx(rate * (1.0 - steps * h / stop), abs=1e-9)
    assert advance(y, p, mode, np.zeros(2), h) > 0
    assert y[LEFT] / value("gear_ratio") + y[RATE] == pytest.approx(0.0, abs=1e-15)


def test_a_small_fall_follows_the_linear_solution():
    """Motors shorted, no friction: the matrix exponential of the linear equations with M22, M24, M44 written out.

    They are for a winding without inductance; here it has a hundredth of its own.
    """
    p = parameters(**FRICTIONLESS, inductance=65e-8)
    n, radius = value("gear_ratio"), value("wheel_radius")
    rotors = 2.0 * n * n * (value("rotor_inertia") + value("gear_inertia"))
    first = value("body_mass") * value("cog_height")
    mass = value("body_mass") + 2 * value("wheel_mass")
    m22 = mass * radius * radius + 2 * value("wheel_inertia") + rotors
    m24 = first * radius - rotors
    m44 = first * value("cog_height") + value("body_pitch_inertia") + rotors
    loss = 2.0 * n * n * value("torque_constant") * value("back_emf_constant") / value("resistance")
    # rows: wheel, pitch; states: pitch, wheel rate, pitch rate
    force = np.array([[0.0, -loss, loss], [first * value("gravity"), loss, -loss]])
    system = np.vstack([[0.0, 0.0, 1.0], np.linalg.solve([[m22, m24], [m24, m44]], force)])
    poles, vectors = np.linalg.eig(system)
    # the open loop's poles, known to 0.1 1/s with viscous friction, which adds 2 % to the losses
    np.testing.assert_allclose(np.sort(poles), [-29.5, -3.9, 8.3], atol=0.6)
    y = np.zeros(8)
    y[PITCH] = 1e-5
    expected = vectors @ np.diag(np.exp(poles * 0.1)) @ np.linalg.solve(vectors, [y[PITCH], 0.0, 0.0])
    rows = np.empty((1, 8))
    assert record(y, p, mode_of(y, p), np.zeros(2), 5e-7, 200_000, 200_000, rows) >= 0
    wheel_rate = y[LEFT] / n + y[RATE]
    # L/R times the fastest pole is 1e-5
    np.testing.assert_allclose([y[PITCH], wheel_rate, y[RATE]], expected.real, rtol=1e-4)


@pytest.mark.parametrize("name", ["rolling", "turn while standing up"])
def test_a_coarser_reference_is_the_same(name):
    """Twice the step moves the pitch by less than a tenth of the smallest error measured against it, 3e-6 deg or more.

    The classical Runge–Kutta method gains 16 by halving: the reference itself is that much closer.
    """
    coarse = solve(SCENARIOS[name], step=2 * STEP)
    difference = np.degrees(np.max(np.abs(coarse.states - reference(SCENARIOS[name], None, 0.0).states)[:, PITCH]))
    assert difference < {"rolling": 3e-7, "turn while standing up": 4e-5}[name]


@pytest.mark.heavy
@pytest.mark.parametrize("name", SCENARIOS)
def test_the_reference_has_converged(name):
    """Half the step moves the pitch by less than a tenth of the smallest error: 1.1e-4 deg, rolling 3e-6 deg."""
    fine = solve(SCENARIOS[name], step=0.5 * STEP)
    difference = np.degrees(np.max(np.abs(fine.states - reference(SCENARIOS[name], None, 0.0).states)[:, PITCH]))
    assert difference < (3e-7 if name == "rolling" else 1e-5)


def test_a_tick_waits_for_the_communication_step():
    """T_s = 5 ms on a grid of 2 ms: ticks at 0, 6, 10, 16 ms; with a delay the voltage comes so much later."""
    scenario = Scenario(0.019, math.radians(5.0))

    def changes(**options):
        voltages = solve(scenario, **options).voltages[:, 0]
        return [round(5e-2 * (k + 1), 3) for k in np.flatnonzero(np.diff(voltages))]

    assert changes(communication_step=0.002) == [6.0, 10.0, 16.0]
    assert changes() == [5.0, 10.0, 15.0]
    assert changes(delay=0.001) == [1.0, 6.0, 11.0, 16.0]
