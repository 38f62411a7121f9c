"""The test bench: exact motion with dry friction, steady speeds, and the current drive."""

from math import exp, sin
from typing import Any

import pytest
from plain import load, started

from twip.robot.bench import INNER_STEP, bench_motion, constant_torque_motion
from twip.robot.parameters import value

BENCH = load("bench").BLOCK
MOTOR = load("motor").BLOCK
LIMITS = ("coulomb_forward", "coulomb_reverse", "static_forward", "static_reverse")
J = value("bench_inertia")


def exact(speed: float, torque: float, forward: float, reverse: float, duration: float) -> tuple[float, float]:
    """Follow the motion with constant torque from event to event; inertia 1."""
    angle = 0.0
    while duration > 0.0:
        drive = torque - forward if speed > 0.0 or (speed == 0.0 and torque > forward) else 0.0
        if speed < 0.0 or (speed == 0.0 and torque < -reverse):
            drive = torque + reverse
        until_rest = -speed / drive if speed * drive < 0.0 else duration
        part = min(duration, until_rest)
        angle += speed * part + 0.5 * drive * part * part
        speed = 0.0 if until_rest <= duration and speed * drive < 0.0 else speed + drive * part
        duration -= part
    return speed, angle


@pytest.mark.parametrize("speed", [0.0, 3.0, -3.0, 0.1])
@pytest.mark.parametrize("torque", [0.0, 0.9, 1.5, -0.4, -0.6, -5.0, 8.0])
def test_motion_through_rest_and_reversal_is_exact(speed: float, torque: float) -> None:
    result = constant_torque_motion(speed, torque, 1.0, 1.0, 0.5, 2.0)
    assert result == pytest.approx(exact(speed, torque, 1.0, 0.5, 2.0), abs=1e-14)


def test_any_division_of_a_step_gives_the_same() -> None:
    whole = bench_motion(50.0, -2e-3, J, 7e-4, 5e-4, 7e-4, 5e-4, 0.4, 0.1)
    speed, angle = 50.0, 0.0
    for _ in range(100):
        speed, turned = bench_motion(speed, -2e-3, J, 7e-4, 5e-4, 7e-4, 5e-4, 0.4, 1e-3)
        angle += turned
    assert (speed, angle) == pytest.approx(whole, rel=1e-12)


def test_stiction_holds_for_ever() -> None:
    b = started(BENCH, drive_torque=4.9e-4, **{f"{name}_limit": 5e-4 for name in LIMITS})
    for k in range(10_000):
        BENCH.step(b, k * 1e-3, 1e-3)
        assert b.shaft_speed == b.shaft_angle == 0.0


def test_static_friction_breaks_away_above_its_level_only() -> None:
    coulomb = {"coulomb_forward_limit": 5e-4, "coulomb_reverse_limit": 5e-4}
    limits = coulomb | {"static_forward_limit": 8e-4, "static_reverse_limit": 8e-4}
    b = started(BENCH, drive_torque=7.999e-4, **limits)
    BENCH.step(b, 0.0, 1e-3)
    assert b.shaft_speed == 0.0
    b.drive_torque = 8.001e-4
    BENCH.step(b, 1e-3, 1e-3)
    assert b.shaft_speed > 0.0
    b.drive_torque = 9e-4
    for k in range(10):
        BENCH.step(b, k * 1e-3, 1e-3)
    assert b.shaft_speed > b.stribeck_speed_limit
    b.drive_torque = 6e-4  # moving fast enough, it needs no more than the Coulomb level
    for k in range(100):
        BENCH.step(b, k * 1e-3, 1e-3)
    assert b.shaft_speed > 1.0


def test_stribeck_motion_is_of_second_order() -> None:
    def speed(parts: int) -> float:
        w = 0.5
        for _ in range(parts):
            w, _ = bench_motion(w, 6.5e-4, J, 5e-4, 5e-4, 8e-4, 8e-4, 0.41, 4 * INNER_STEP / parts)
        return w

    reference = speed(4000)
    errors = [abs(speed(parts) - reference) for parts in (4, 8, 16)]
    # 4 but for the next term, the limits change much within a step here
    assert errors[0] / errors[1] == pytest.approx(4.0, abs=0.8)
    assert errors[1] / errors[2] == pytest.approx(4.0, abs=0.5)


def run(
    side: str, steps: int, step: float, coupling: str = "jacobi", **bench: float
) -> list[tuple[float, float, float]]:
    """Return current, speed and voltage after each step of one side's motor on the bench."""
    friction = {name: value(f"{side}.{name}") for name in (*LIMITS, "viscous_forward", "viscous_reverse")}
    m, b = started(MOTOR, **friction), started(BENCH, **bench)
    rows = []
    last = b.shaft_speed
    for k in range(steps):
        m.voltage, m.shaft_speed, m.shaft_angle = b.voltage, b.shaft_speed, b.shaft_angle
        if coupling == "extrapolated":
            m.shaft_speed += 0.5 * (b.shaft_speed - last)
        last = b.shaft_speed
        if coupling == "jacobi":
            connect(m, b)
            MOTOR.step(m, k * step, step)
        else:
            MOTOR.step(m, k * step, step)
            connect(m, b)
        BENCH.step(b, k * step, step)
        rows.append((m.current, b.shaft_speed, b.voltage))
    return rows


def connect(m: Any, b: Any) -> None:
    for name in LIMITS:
        setattr(b, f"{name}_limit", getattr(m, f"{name}_limit"))
    b.stribeck_speed_limit, b.drive_torque, b.current = m.stribeck_speed_limit, m.drive_torque, m.current


@pytest.mark.parametrize(
    ("side", "sign", "expected"), [("left", 1, 114.0), ("left", -1, 169.0), ("right", 1, 200.0), ("right", -1, 386.0)]
)
def test_steady_speeds_at_70_milliamperes(side: str, sign: int, expected: float) -> None:
    way = "forward" if sign > 0 else "reverse"
    viscous = value(f"{side}.viscous_{way}")
    steady = (0.07 * value("torque_constant") - value(f"{side}.coulomb_{way}")) / viscous
    assert steady == pytest.approx(expected, abs=0.5)
    rows = run(side, 8000, 1e-3, current_drive=1.0, current_command=sign * 0.07)
    # the paper's eq (8) corrected: omega = steady (1 - e^-(sigma t/J)); one step of delay at the start is 0.04 % of it
    speed = steady * (1.0 - exp(-viscous * 8.0 / J))
    assert sign * rows[-1][1] == pytest.approx(speed, rel=1e-3)


@pytest.mark.parametrize("coupling", ["jacobi", "gauss-seidel", "extrapolated"])
@pytest.mark.parametrize("step", [1e-3, 1e-4])
def test_current_follows_its_command(coupling: str, step: float) -> None:
    rows = run("right", round(0.05 / step), step, coupling, current_drive=1.0, current_command=-0.07)
    late = rows[round(0.015 / step) :]
    assert max(abs(i + 0.07) for i, _, _ in late) < 0.07e-3
    assert max(abs(i) for i, _, _ in rows) < 0.07 * 1.01  # and never overshoots much


def test_current_drive_corrects_what_it_does_not_know() -> None:
    """The bench believes in a resistance 20 % off."""
    rows = run("left", 100, 1e-3, current_drive=1.0, current_command=0.07, resistance=0.8 * value("resistance"))
    assert rows[-1][0] == pytest.approx(0.07, rel=1e-3)


def test_voltage_stays_within_the_supply_and_nothing_winds_up() -> None:
    b = started(BENCH, current_drive=1.0, current_command=20.0)
    assert b.voltage == 12.0
    for k in range(1000):
        BENCH.step(b, k * 1e-3, 1e-3)
    assert b.voltage == 12.0
    assert b.trim_voltage == 0.0
    c = started(BENCH, voltage_command=-30.0)
    assert c.voltage == -12.0


def test_voltage_drive_passes_the_command() -> None:
    b = started(BENCH, voltage_command=3.0)
    assert b.voltage == 3.0
    for k in range(10):
        b.voltage_command = 5.0 * sin(k)
        BENCH.step(b, k * 1e-3, 1e-3)
        assert b.voltage == 5.0 * sin(k)


def test_start_speed() -> None:
    b = started(BENCH, shaft_speed_start=100.0, coulomb_forward_limit=J, static_forward_limit=J)
    BENCH.step(b, 0.0, 0.5)
    assert b.shaft_speed == pytest.approx(99.5, rel=1e-12)
    assert b.shaft_angle == pytest.approx(0.5 * 99.75, rel=1e-12)
