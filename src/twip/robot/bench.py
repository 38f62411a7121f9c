"""The test bench: one motor shaft with an inertia on it, and a supply that holds voltage or current."""

from math import floor

from .friction import friction_levels, slide_or_stick
from .kernel import kernel

INNER_STEP = 2.5e-4
"""Largest step [s] of the shaft's motion while the friction limits depend on the speed."""


@kernel
def constant_torque_motion(
    speed: float, torque: float, inertia: float, forward: float, reverse: float, step: float
) -> tuple[float, float]:
    """Return the speed [rad/s] after a step [s] of constant torque and limits [N.m], and the angle turned [rad].

    J omega' = tau + T,   T = -forward if omega > 0, +reverse if omega < 0, between if omega = 0

    Exact: a shaft that comes to rest within the step does so on time, and stays or turns back.
    """
    if speed == 0.0:
        end = slide_or_stick(0.0, torque * step, inertia, forward * step, reverse * step)
        return end, 0.5 * step * end
    friction = -forward if speed > 0.0 else reverse
    acceleration = (torque + friction) / inertia
    end = speed + acceleration * step
    if (speed > 0.0 and end > 0.0) or (speed < 0.0 and end < 0.0):
        return end, 0.5 * step * (speed + end)
    before = -speed / acceleration
    rest = max(step - before, 0.0)
    end = slide_or_stick(0.0, torque * rest, inertia, forward * rest, reverse * rest)
    return end, 0.5 * (before * speed + rest * end)


@kernel
def bench_motion(
    speed: float, torque: float, inertia: float, coulomb_forward: float, coulomb_reverse: float,
    static_forward: float, static_reverse: float, stribeck_speed: float, step: float,
) -> tuple[float, float]:  # fmt: skip
    """Return the shaft's speed [rad/s] after a step [s] of constant drive torque [N.m], and the angle turned [rad].

    Friction limits as in `friction_levels`. Without Stribeck effect the result is exact; with it, the step is cut into
    parts of at most `INNER_STEP`, each with the limits at the speed of its middle (second order).
    """
    if static_forward == coulomb_forward and static_reverse == coulomb_reverse:
        return constant_torque_motion(speed, torque, inertia, coulomb_forward, coulomb_reverse, step)
    count = -floor(1e-9 - step / INNER_STEP)
    if count < 1:
        count = 1
    part = step / count
    angle = 0.0
    for _ in range(count):
        forward, reverse = friction_levels(
            speed, coulomb_forward, coulomb_reverse, static_forward, static_reverse, stribeck_speed
        )
        middle, _ = constant_torque_motion(speed, torque, inertia, forward, reverse, 0.5 * part)
        forward, reverse = friction_levels(
            middle, coulomb_forward, coulomb_reverse, static_forward, static_reverse, stribeck_speed
        )
        speed, turned = constant_torque_motion(speed, torque, inertia, forward, reverse, part)
        angle += turned
    return speed, angle


@kernel
def limited(voltage: float, supply: float) -> float:
    """Return a voltage [V] within the supply."""
    return max(-supply, min(supply, voltage))


@kernel
def beyond(value: float, first: float, second: float, third: float) -> float:
    """Return by how much a value lies above (positive) or below (negative) the range of three others."""
    high = max(max(first, second), third)
    low = min(min(first, second), third)
    return max(value - high, 0.0) + min(value - low, 0.0)


@kernel
def trimmed(trim: float, excess: float, resistance: float, step: float) -> float:
    """Return the trim voltage [V] of the current drive after a step [s] in which the current [A] exceeded its command.

    dv_trim/dt = -R excess / T, T = 4 ms; steps beyond 1 ms count as 1 ms, so that one step of delay cannot make it
    swing
    """
    return trim - 0.25 * min(step / 1e-3, 1.0) * resistance * excess


@kernel
def drive_voltage(
    speed: float, current_command: float, trim: float, resistance: float, back_emf_constant: float, supply: float
) -> float:
    """Return the voltage [V] that drives the commanded current [A] at a shaft speed [rad/s], within the supply [V].

    v = R i + K_b omega + v_trim; the trim pays for what the motor does not share with this: other parameters, a speed
    sampled at another time.
    """
    return limited(resistance * current_command + back_emf_constant * speed + trim, supply)
