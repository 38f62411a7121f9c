"""Sliding-mode control of balance and yaw (paper, section 5.1, corrected)."""

from typing import Any

from .elementary import sin_cos
from .kernel import kernel


@kernel
def reaching(surface: float, boundary: float) -> float:
    """Return sat(s / Phi) in [-1, 1], linear within the boundary layer +-Phi; Phi = 0 is the sgn(s) of paper eq (46).

    surface s and boundary Phi in one unit.
    """
    if surface > boundary:
        return 1.0
    if surface < -boundary:
        return -1.0
    if boundary > 0.0:
        return surface / boundary
    return 0.0


@kernel
def balance_torque(v: Any, pitch: float, pitch_rate: float, wheel_rate: float, yaw_rate: float, reach: float) -> float:
    """Return the wheel torque u2 (N.m, both motors' share at stall) that makes the balance surface approach zero.

        u2 = M21 (theta' - psi') + D (c1 psi' + eps1 reach) / (c2 (M22 + M24)) + (M22 f4 - M24 f2) / (M22 + M24)
        M22 = (2 m + M) R^2 + 2 J_w + 2 n^2 J_m,   M24 = M L R cos psi - 2 n^2 J_m,   M44 = M L^2 + J_psi + 2 n^2 J_m
        D = M22 M44 - M24^2,   M21 = 2 n^2 (K_t K_b / R_m + sigma)
        f2 = M L R (psi'^2 + phi'^2) sin psi,   f4 = M g L sin psi + M L^2 phi'^2 sin psi cos psi

    With u2 = (n K_t / R_m) (v_l + v_r) and the exact model without Coulomb friction, s1' = -eps1 reach. Paper eq
    (49), with the motion terms that eqs (30) lack and without Coulomb friction, which `compensation` handles per
    motor.

    pitch psi, pitch_rate psi': rad and s, forward lean positive; wheel_rate theta' in rad/s, forward positive;
    yaw_rate phi' in rad/s; reach = sat(s1 / Phi1), no unit; `v` holds the model parameters and c1, c2, epsilon1.
    sigma is the mean of the four viscous coefficients, J_m the inertia of rotor and gear. Beyond a quarter turn cos
    psi counts as 0.
    """
    n = v.gear_ratio
    sine, cosine = sin_cos(pitch)
    if cosine < 0.0:
        cosine = 0.0
    rotors = 2.0 * n * n * (v.rotor_inertia + v.gear_inertia)
    coupling = v.body_mass * v.cog_height * v.wheel_radius
    m22 = (2.0 * v.wheel_mass + v.body_mass) * v.wheel_radius * v.wheel_radius + 2.0 * v.wheel_inertia + rotors
    m24 = coupling * cosine - rotors
    m44 = v.body_mass * v.cog_height * v.cog_height + v.body_pitch_inertia + rotors
    determinant = m22 * m44 - m24 * m24
    f2 = coupling * (pitch_rate * pitch_rate + yaw_rate * yaw_rate) * sine
    f4 = v.body_mass * v.cog_height * sine * (v.gravity + v.cog_height * yaw_rate * yaw_rate * cosine)
    wanted = (v.c1 * pitch_rate + v.epsilon1 * reach) / v.c2
    losses = speed_coefficient(v) * (wheel_rate - pitch_rate)
    torque: float = losses + (determinant * wanted + m22 * f4 - m24 * f2) / (m22 + m24)
    return torque


@kernel
def yaw_torque(v: Any, pitch: float, pitch_rate: float, wheel_rate: float, yaw_rate: float, reach: float) -> float:
    """Return the yaw torque u6 (N.m) that makes the yaw surface approach zero.

        u6 = M65 phi' - f6 - M66 (c3 phi' + eps2 reach) / c4
        M65 = a^2 M21,   a = W / (2 R),   M66 = m W^2 / 2 + J_phi + 2 a^2 (J_w + n^2 J_m) + M L^2 sin^2 psi
        f6 = -2 M L^2 psi' phi' sin psi cos psi - M L R theta' phi' sin psi

    With u6 = a (n K_t / R_m) (v_r - v_l) and the exact model without Coulomb friction, s2' = -eps2 reach. Paper eq
    (51) with its missing division by c4 and the term of theta' that eq (32) lacks.

    Arguments as in `balance_torque`, yaw_rate left positive; `v` holds the model parameters and c3, c4, epsilon2.
    """
    n = v.gear_ratio
    a = v.track_width / (2.0 * v.wheel_radius)
    sine, cosine = sin_cos(pitch)
    offset = v.body_mass * v.cog_height * sine
    wheels = v.wheel_inertia + n * n * (v.rotor_inertia + v.gear_inertia)
    m66 = 0.5 * v.wheel_mass * v.track_width * v.track_width + v.body_yaw_inertia + 2.0 * a * a * wheels
    m66 += offset * v.cog_height * sine
    f6 = -yaw_rate * offset * (2.0 * v.cog_height * pitch_rate * cosine + v.wheel_radius * wheel_rate)
    wanted = (v.c3 * yaw_rate + v.epsilon2 * reach) / v.c4
    torque: float = a * a * speed_coefficient(v) * yaw_rate - f6 - m66 * wanted
    return torque


@kernel
def speed_coefficient(v: Any) -> float:
    """Return M21 = 2 n^2 (K_t K_b / R_m + sigma) in N.m.s/rad: torque lost to back-EMF and viscous friction."""
    viscous = v.left_viscous_forward + v.left_viscous_reverse + v.right_viscous_forward + v.right_viscous_reverse
    damping = v.torque_constant * v.back_emf_constant / v.resistance + 0.25 * viscous
    coefficient: float = 2.0 * v.gear_ratio * v.gear_ratio * damping
    return coefficient


@kernel
def voltages(v: Any, balance: float, yaw: float) -> tuple[float, float]:
    """Return the motor voltages (left, right in V) for the torques u2 and u6 (N.m).

        v_r,l = R_m u2 / (2 n K_t) +- R R_m u6 / (n K_t W)

    Paper eqs (52) and (53) with the sign of u2 right: as printed the robot is driven away from balance.
    """
    per_torque = v.resistance / (v.gear_ratio * v.torque_constant)
    common, difference = 0.5 * per_torque * balance, per_torque * v.wheel_radius / v.track_width * yaw
    return common - difference, common + difference
