"""The robot's motion over a step: midpoint rule with implicit dry friction.

A step of length h is taken twice: to its middle with the torques at its beginning, then over the whole with the
torques at its middle, both times with friction in agreement with the rates at the end. Angles follow the mean of the
rates at both ends. The error falls with h^2 in smooth motion. Friction that jumps within a step, at a reversal or
from static to sliding, is taken as if it had jumped at the step's beginning: an error of order h, once for each such
event.
"""

from math import floor
from typing import Any

from .elementary import cos, sin_cos
from .kernel import kernel
from .plant import Constants, constants, forces, friction_limits, ground, inertia_by_wheel, rolling_limit
from .stiction import directions, stick_slip


@kernel
def kick(
    v: Any, c: Constants, wheel_angle: float, pitch_angle: float, left: float, right: float, pitch: float,
    left0: float, right0: float, pitch0: float, step: float,
) -> tuple[float, float, float]:  # fmt: skip
    """Return the rates (left wheel, right wheel, pitch) [rad/s] a `step` [s] after `left0`, `right0`, `pitch0`.

    Torques and inertia are those at the given angles [rad] and rates [rad/s]; friction agrees with the result.
    """
    m22, m44, a = c.m22, c.m44, c.a
    m24, m66, on_wheels, on_pitch, on_yaw = forces(
        v, c, wheel_angle, pitch_angle, 0.5 * (left + right), pitch, (right - left) / (2.0 * a)
    )
    n = v.gear_ratio
    left_forward, left_reverse, right_forward, right_reverse = friction_limits(
        v, n * (left - pitch), n * (right - pitch)
    )
    rolling = rolling_limit(v, c)
    turn = on_yaw / (2.0 * a)
    on_left = 0.5 * on_wheels - turn
    on_right = 0.5 * on_wheels + turn
    left_shaft = left0 - pitch0
    right_shaft = right0 - pitch0
    if left0 != 0.0 and right0 != 0.0 and left_shaft != 0.0 and right_shaft != 0.0:
        # everything slides at the beginning: most often to the end too, and then no system need be solved
        left_friction = -left_forward if left_shaft > 0.0 else left_reverse
        right_friction = -right_forward if right_shaft > 0.0 else right_reverse
        sum_left = on_left + (left_friction + (-rolling if left0 > 0.0 else rolling))
        sum_right = on_right + (right_friction + (-rolling if right0 > 0.0 else rolling))
        on_both = sum_left + sum_right
        on_body = on_pitch - (left_friction + right_friction)
        scale = step / (m22 * m44 - m24 * m24)
        forward = scale * (m44 * on_both - m24 * on_body)
        turning = step * a * a / m66 * (sum_right - sum_left)
        new_left = left0 + (forward - turning)
        new_right = right0 + (forward + turning)
        new_pitch = pitch0 + scale * (m22 * on_body - m24 * on_both)
        if (
            new_left * left0 > 0.0
            and new_right * right0 > 0.0
            and (new_left - new_pitch) * left_shaft > 0.0
            and (new_right - new_pitch) * right_shaft > 0.0
        ):
            return new_left, new_right, new_pitch
    inertia = inertia_by_wheel(c, m24, m66)
    side, cross, mixed, own = inertia
    momenta = (
        (side * left0 + cross * right0) + (mixed * pitch0 + step * on_left),
        (side * right0 + cross * left0) + (mixed * pitch0 + step * on_right),
        mixed * (left0 + right0) + (own * pitch0 + step * on_pitch),
    )
    limits = (
        step * rolling, step * rolling,
        step * left_forward, step * left_reverse, step * right_forward, step * right_reverse,
    )  # fmt: skip
    speeds, _ = stick_slip(inertia, momenta, limits, directions((left0, right0, pitch0)))
    return speeds


@kernel
def inner_step(v: Any, c: Constants, step: float) -> None:
    """Move the robot by one inner step [s].

    Each angle is integrated from its own rate, the shafts' relative angles too, so that what rests is still to the
    last bit.

    x' = R theta' cos(alpha) cos(phi)      y' = R theta' cos(alpha) sin(phi)
    """
    left0 = v.left_wheel_rate
    right0 = v.right_wheel_rate
    pitch0 = v.pitch_rate
    half = 0.5 * step
    left, right, pitch = kick(v, c, v.wheel_angle, v.pitch, left0, right0, pitch0, left0, right0, pitch0, half)
    middle_wheel = v.wheel_angle + 0.25 * half * ((left0 + right0) + (left + right))
    middle_pitch = v.pitch + 0.5 * half * (pitch0 + pitch)
    left, right, pitch = kick(v, c, middle_wheel, middle_pitch, left, right, pitch, left0, right0, pitch0, step)
    turned = 0.5 * half * ((left0 + right0) + (left + right))
    yawed = half / (2.0 * c.a) * ((right0 - left0) + (right - left))
    v.pitch += half * (pitch0 + pitch)
    v.left_shaft_angle += v.gear_ratio * half * ((left0 - pitch0) + (left - pitch))
    v.right_shaft_angle += v.gear_ratio * half * ((right0 - pitch0) + (right - pitch))
    slope, _ = ground(v, middle_wheel)
    way = v.wheel_radius * turned * cos(slope)
    across, along = sin_cos(v.yaw + 0.5 * yawed)
    v.x += way * along
    v.y += way * across
    v.wheel_angle += turned
    v.yaw += yawed
    v.left_wheel_rate = left
    v.right_wheel_rate = right
    v.pitch_rate = pitch


@kernel
def advance(v: Any, step_size: float) -> None:
    """Move the robot by `step_size` [s] in equal inner steps of at most `inner_step` [s], with constant inputs."""
    c = constants(v)
    count = -floor(1e-9 - step_size / v.inner_step)
    if count < 1:
        count = 1
    for _ in range(count):
        inner_step(v, c, step_size / count)
