"""The robot's accelerations under the present torques, and the friction that goes with them."""

from typing import Any

from .kernel import kernel
from .plant import Constants, constants, forces, friction_limits, ground, inertia_by_wheel, rolling_limit
from .stiction import Contacts, Speeds, stick_slip


@kernel
def sliding_friction(speed: float, forward: float, reverse: float) -> float:
    """Return the friction torque [N.m] of a contact that moves, 0 if it rests."""
    if speed > 0.0:
        return -forward
    return reverse if speed < 0.0 else 0.0


@kernel
def accelerations(
    v: Any, c: Constants, wheel_angle: float, pitch_angle: float, left: float, right: float, pitch: float
) -> tuple[Speeds, Contacts]:
    """Return the accelerations (left wheel, right wheel, pitch) [rad/s2] and friction torques at the wheel axle [N.m].

    The friction torques are those of rolling left, rolling right, left shaft, right shaft. A contact that moves has
    its sliding friction. One that rests has friction within its limits and may only start against it: the same
    problem as for the rates of a step, with acceleration in place of speed and torque in place of momentum. Locked
    wheels do not accelerate.
    """
    a = c.a
    m24, m66, on_wheels, on_pitch, on_yaw = forces(
        v, c, wheel_angle, pitch_angle, 0.5 * (left + right), pitch, (right - left) / (2.0 * a)
    )
    n = v.gear_ratio
    left_shaft = left - pitch
    right_shaft = right - pitch
    left_forward, left_reverse, right_forward, right_reverse = friction_limits(v, n * left_shaft, n * right_shaft)
    rolling = rolling_limit(v, c)
    locked = v.wheels_locked > 0.5
    known1 = 0.0 if locked else sliding_friction(left, rolling, rolling)
    known2 = 0.0 if locked else sliding_friction(right, rolling, rolling)
    known3 = sliding_friction(left_shaft, left_forward, left_reverse)
    known4 = sliding_friction(right_shaft, right_forward, right_reverse)
    turn = on_yaw / (2.0 * a)
    torques = (
        0.5 * on_wheels - turn + (known1 + known3),
        0.5 * on_wheels + turn + (known2 + known4),
        on_pitch - (known3 + known4),
    )
    # the limit of a contact that moves is spent: no torque is left to it, in any direction
    rests1 = 1.0 if locked or left == 0.0 else 0.0
    rests2 = 1.0 if locked or right == 0.0 else 0.0
    rests3 = 1.0 if left_shaft == 0.0 else 0.0
    rests4 = 1.0 if right_shaft == 0.0 else 0.0
    limits = (
        rests1 * rolling, rests2 * rolling,
        rests3 * left_forward, rests3 * left_reverse, rests4 * right_forward, rests4 * right_reverse,
    )  # fmt: skip
    mode = (1.0 - rests1, 1.0 - rests2, 1.0 - rests3, 1.0 - rests4)
    result, held = stick_slip(inertia_by_wheel(c, m24, m66), torques, limits, mode)
    return result, (known1 + held[0], known2 + held[1], known3 + held[2], known4 + held[3])


@kernel
def observe(v: Any, held: float) -> None:
    """Set what follows from the state and the present inputs: rates, ground slope, accelerations, friction torques.

    While the robot is `held` (1.) nothing accelerates and no friction is counted. With all four contacts at rest only
    sums of friction torques are determined; the shafts' have the middle of what is possible (`rest_impulses`).
    """
    c = constants(v)
    left = v.left_wheel_rate
    right = v.right_wheel_rate
    a = c.a
    v.wheel_rate = 0.5 * (left + right)
    v.yaw_rate = (right - left) / (2.0 * a)
    v.left_shaft_speed = v.gear_ratio * (left - v.pitch_rate)
    v.right_shaft_speed = v.gear_ratio * (right - v.pitch_rate)
    v.ground_slope, curvature = ground(v, v.wheel_angle)
    v.ground_slope_rate = curvature * v.wheel_rate
    v.wheel_acceleration = 0.0
    v.pitch_acceleration = 0.0
    v.yaw_acceleration = 0.0
    v.left_rolling_torque = 0.0
    v.right_rolling_torque = 0.0
    v.left_friction_torque = 0.0
    v.right_friction_torque = 0.0
    if held < 0.5:
        result, friction = accelerations(v, c, v.wheel_angle, v.pitch, left, right, v.pitch_rate)
        v.wheel_acceleration = 0.5 * (result[0] + result[1])
        v.pitch_acceleration = result[2]
        v.yaw_acceleration = (result[1] - result[0]) / (2.0 * a)
        v.left_rolling_torque = friction[0]
        v.right_rolling_torque = friction[1]
        v.left_friction_torque = friction[2] / v.gear_ratio
        v.right_friction_torque = friction[3] / v.gear_ratio
