"""The friction equations as the paper prints them, kept to show that they fail; nothing computes with them."""

from math import copysign, exp


def printed_parameters(slope: float, intercept: float) -> tuple[float, float]:
    """Return T_c and sigma of a line y = a x + b as eq (3) assigns them: T_c = a, sigma = b."""
    return slope, intercept


def printed_stribeck(speed: float, coulomb: float, static: float, stribeck_speed: float, viscous: float) -> float:
    """Return the friction torque [N.m] of eq (4) as printed: the sign on the exponential term alone.

    T_f = T_c + (T_s - T_c) e^-(omega/v_s)^2 sgn(omega) + sigma_2 omega
    """
    sign = copysign(1.0, speed) if speed else 0.0
    return coulomb + (static - coulomb) * exp(-((speed / stribeck_speed) ** 2)) * sign + viscous * speed


def corrected_stribeck(speed: float, coulomb: float, static: float, stribeck_speed: float, viscous: float) -> float:
    """Return the same with the sign on all of the dry friction; magnitudes of one direction.

    T_f = [T_c + (T_s - T_c) e^-(omega/v_s)^2] sgn(omega) + sigma_2 omega
    """
    sign = copysign(1.0, speed) if speed else 0.0
    return (coulomb + (static - coulomb) * exp(-((speed / stribeck_speed) ** 2))) * sign + viscous * speed
