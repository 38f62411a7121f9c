"""Pitch from the specific force, and what else than gravity is in it."""

from math import sqrt

from .elementary import atan2, cos, sin_cos
from .kernel import kernel


@kernel
def pitch_arctan(force_x: float, force_z: float) -> float:
    """Return the pitch (rad) that gravity alone explains: psi = atan2(-f_x, f_z), paper eq (41), second form.

    force_x forward and force_z up, body axes, m/s2. The paper's a_x points the other way.
    """
    return atan2(-force_x, force_z)


@kernel
def pitch_arcsin(force_x: float, gravity: float) -> float:
    """Return the pitch in rad by psi = arcsin(-f_x / g), paper eq (41), first form; forces beyond g count as g.

    force_x forward in body axes and gravity g in m/s2. The arcsine is written as atan2(s, sqrt(1 - s^2)).
    """
    sine = -force_x / gravity
    if sine > 1.0:
        sine = 1.0
    elif sine < -1.0:
        sine = -1.0
    return atan2(sine, sqrt((1.0 - sine) * (1.0 + sine)))


@kernel
def lever_arm_force(
    pitch_rate: float, pitch_acceleration: float, sensor_distance: float, sensor_elevation: float
) -> tuple[float, float]:
    """Return the part of the specific force (f_x, f_z in m/s2) that pitching gives a sensor away from the axle.

        f_x = L_s sin(beta) psi'' - L_s cos(beta) psi'^2,   f_z = -L_s cos(beta) psi'' - L_s sin(beta) psi'^2

    pitch_rate psi' in rad/s, pitch_acceleration psi'' in rad/s2, forward positive; sensor_distance L_s in m,
    sensor_elevation beta in rad. Paper eqs (43) and (44) with the signs of both sin terms right.
    """
    sine, cosine = sin_cos(sensor_elevation)
    x, z = sensor_distance * cosine, sensor_distance * sine
    squared = pitch_rate * pitch_rate
    return z * pitch_acceleration - x * squared, -x * pitch_acceleration - z * squared


@kernel
def axle_force(pitch: float, axle_acceleration: float) -> tuple[float, float]:
    """Return the part of the specific force (f_x, f_z in m/s2) that comes from the axle's acceleration a (m/s2).

    f_x = a cos psi,   f_z = a sin psi

    pitch psi in rad. Level ground; missing in the paper.
    """
    sine, cosine = sin_cos(pitch)
    return axle_acceleration * cosine, axle_acceleration * sine


@kernel
def yaw_force(pitch: float, yaw_rate: float, sensor_distance: float, sensor_elevation: float) -> tuple[float, float]:
    """Return the part of the specific force (f_x, f_z in m/s2) that turning gives a sensor in front of the yaw axis.

    f_x = -phi'^2 L_s cos(beta - psi) cos psi,   f_z = -phi'^2 L_s cos(beta - psi) sin psi

    pitch psi in rad, yaw_rate phi' in rad/s, sensor_distance L_s in m, sensor_elevation beta in rad. Missing in the
    paper.
    """
    inward = -yaw_rate * yaw_rate * sensor_distance * cos(sensor_elevation - pitch)
    sine, cosine = sin_cos(pitch)
    return inward * cosine, inward * sine
