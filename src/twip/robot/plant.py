"""The equations of motion of the robot on two wheels.

Coordinates: wheel angle theta (mean of the two wheels, absolute), pitch psi (forward lean positive, 0 upright), yaw
phi (left turn positive). The ground rises by the angle alpha along the heading; chi = psi + alpha is the lean off the
ground's normal. With a = W/(2R) the wheels turn at theta' -+ a phi' (left, right), and the motor shafts relative to
the body at n (theta'_i - psi').

    M22 theta" + M24 psi" - M L R sin(chi) (psi'^2 + phi'^2)
        = n (tau_l + tau_r) - (M + 2m) g R sin(alpha) + F R cos(alpha)
    M24 theta" + M44 psi" - M L R sin(chi) dalpha/dtheta theta'^2
        - M L^2 phi'^2 sin(chi) cos(chi) - M g L sin(psi)
        = -n (tau_l + tau_r) + F h_p cos(psi) + body torque
    M66 phi" + M L^2 sin(chi) cos(chi) (2 psi' + alpha') phi' + M L R sin(chi) theta' phi'
        = n a (tau_r - tau_l)

    M22 = (2m + M) R^2 + 2 J_w + 2 n^2 J_m       M24 = M L R cos(chi) - 2 n^2 J_m
    M44 = M L^2 + J_psi + 2 n^2 J_m              M66 = m W^2/2 + J_phi + 2 a^2 (J_w + n^2 J_m) + M L^2 sin(chi)^2
    J_m = rotor + gear, on the motor shaft

Friction (rolling of each wheel, each shaft) comes on top, see `stiction`. The phi'^2 term of row 1 and the theta'
phi' term of row 3 come from rolling without side slip, which is a non-holonomic constraint: they do no work and are
missing in the paper's eqs (30) and (32). Source: paper section 3, corrected; slope and terrain are this project's.

Neglected: wheel slip and lift-off; the rotor's spin relative to the body in the body's own inertia (it is taken to
turn with the wheel); different inertias of the body about its x and z axes; the time change of the slope that is
given from outside; gyroscopic roll torques, which the ground carries.
"""

from typing import Any, NamedTuple

from .elementary import sin_cos
from .friction import friction_levels
from .kernel import kernel
from .stiction import Inertia
from .terrain import bump_slope

LOCKED = 1e30
"""Torque limit [N.m] of a wheel whose brake is on."""


class Constants(NamedTuple):
    """What the parameters make of the equations' coefficients."""

    m22: float
    """M22 [kg.m2], as all that follow to `m66`."""
    m44: float
    """M44."""
    reflected: float
    """2 n^2 J_m."""
    first_moment: float
    """M L R."""
    second_moment: float
    """M L^2."""
    m66: float
    """The constant part of M66."""
    a: float
    """W/(2R) [1]."""
    gravity_torque: float
    """M g L [N.m]."""
    weight_torque: float
    """The robot's weight times R [N.m]."""


@kernel
def constants(v: Any) -> Constants:
    """Return what the parameters make of the equations' coefficients."""
    n = v.gear_ratio
    radius = v.wheel_radius
    reflected = 2.0 * n * n * (v.rotor_inertia + v.gear_inertia)
    first_moment = v.body_mass * v.cog_height
    second_moment = first_moment * v.cog_height
    mass = v.body_mass + 2.0 * v.wheel_mass
    a = v.track_width / (2.0 * radius)
    m22 = mass * radius * radius + 2.0 * v.wheel_inertia + reflected
    m44 = second_moment + v.body_pitch_inertia + reflected
    m66 = (
        0.5 * v.wheel_mass * v.track_width * v.track_width
        + v.body_yaw_inertia
        + a * a * (2.0 * v.wheel_inertia + reflected)
    )
    gravity_torque = first_moment * v.gravity
    return Constants(
        m22, m44, reflected, first_moment * radius, second_moment, m66, a, gravity_torque, mass * v.gravity * radius
    )


@kernel
def ground(v: Any, wheel_angle: float) -> tuple[float, float]:
    """Return the slope alpha [rad] under the wheels, uphill positive, and dalpha/dtheta [1] of the terrain.

    The slope given from outside and the angle of the bumps add up; its own change with time is neglected.
    """
    if v.bump_height == 0.0:
        return v.slope, 0.0
    angle, per_metre = bump_slope(
        v.wheel_radius * wheel_angle, v.bump_height, v.bump_length, v.bump_spacing, v.bump_start
    )
    return v.slope + angle, v.wheel_radius * per_metre


@kernel
def inertia_by_wheel(c: Constants, m24: float, m66: float) -> Inertia:
    """Return the mass matrix [kg.m2] for the rates of left wheel, right wheel and pitch.

    theta' = (u_l + u_r)/2,  phi' = (u_r - u_l)/(2a):   s, c = (M22 +- M66/a^2)/4,   x = M24/2,   w = M44
    """
    yaw = m66 / (c.a * c.a)
    return 0.25 * (c.m22 + yaw), 0.25 * (c.m22 - yaw), 0.5 * m24, c.m44


@kernel
def forces(
    v: Any, c: Constants, wheel_angle: float, pitch: float, wheel_rate: float, pitch_rate: float, yaw_rate: float
) -> tuple[float, float, float, float, float]:
    """Return M24, M66 [kg.m2] and the torques [N.m] on theta, psi and phi without friction.

    Everything of the equations of motion that is not M q" stands on the right. Angles in rad, rates in rad/s; drive
    torques on the motor shafts, push force, slope, body torque and parameters are taken from `v`.
    """
    alpha, curvature = ground(v, wheel_angle)
    sin_pitch, cos_pitch = sin_cos(pitch)
    sin_slope = 0.0
    cos_slope = 1.0
    sin_lean = sin_pitch
    cos_lean = cos_pitch
    if alpha != 0.0:
        sin_slope, cos_slope = sin_cos(alpha)
        sin_lean, cos_lean = sin_cos(pitch + alpha)
    yaw_squared = yaw_rate * yaw_rate
    inertial = c.first_moment * sin_lean
    centrifugal = c.second_moment * sin_lean * cos_lean
    drive = v.gear_ratio * (v.left_drive_torque + v.right_drive_torque)
    on_wheels = (
        drive + inertial * (pitch_rate * pitch_rate + yaw_squared)
        - c.weight_torque * sin_slope + v.push_force * v.wheel_radius * cos_slope
    )  # fmt: skip
    on_pitch = (
        -drive + c.gravity_torque * sin_pitch + centrifugal * yaw_squared
        + inertial * curvature * wheel_rate * wheel_rate + v.push_force * v.push_height * cos_pitch + v.body_torque
    )  # fmt: skip
    on_yaw = v.gear_ratio * c.a * (v.right_drive_torque - v.left_drive_torque) - yaw_rate * (
        centrifugal * (2.0 * pitch_rate + curvature * wheel_rate) + inertial * wheel_rate
    )
    m24 = c.first_moment * cos_lean - c.reflected
    m66 = c.m66 + c.second_moment * sin_lean * sin_lean
    return m24, m66, on_wheels, on_pitch, on_yaw


@kernel
def friction_limits(v: Any, left_shaft: float, right_shaft: float) -> tuple[float, float, float, float]:
    """Return the shafts' friction limits at the wheels [N.m]: left forward and reverse, right forward and reverse.

    Shaft speeds relative to the body in rad/s; limits per direction and side, and the Stribeck speed, come from the
    motors.
    """
    n = v.gear_ratio
    left_forward, left_reverse = friction_levels(
        left_shaft, v.left_coulomb_forward_limit, v.left_coulomb_reverse_limit, v.left_static_forward_limit,
        v.left_static_reverse_limit, v.left_stribeck_speed_limit,
    )  # fmt: skip
    right_forward, right_reverse = friction_levels(
        right_shaft, v.right_coulomb_forward_limit, v.right_coulomb_reverse_limit, v.right_static_forward_limit,
        v.right_static_reverse_limit, v.right_stribeck_speed_limit,
    )  # fmt: skip
    return n * left_forward, n * left_reverse, n * right_forward, n * right_reverse


@kernel
def rolling_limit(v: Any, c: Constants) -> float:
    """Return the rolling resistance limit of one wheel [N.m], `LOCKED` while the wheels are locked.

    C_rr (M + 2m) g R / 2

    The load on a wheel is taken as half the weight: load transfer in turns, the slope and the body's vertical
    acceleration are neglected.
    """
    if v.wheels_locked > 0.5:
        return LOCKED
    limit: float = 0.5 * v.rolling_resistance * c.weight_torque
    return limit


@kernel
def smallest_determinant(c: Constants) -> float:
    """Return the smallest M22 M44 - M24^2 [kg2.m4] over all leans, 0 if it is lost in rounding."""
    m24 = c.first_moment + c.reflected
    determinant = c.m22 * c.m44 - m24 * m24
    return determinant if determinant > 1e-12 * c.m22 * c.m44 else 0.0
