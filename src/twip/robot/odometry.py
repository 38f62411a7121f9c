"""Wheel motion and yaw from the motors' encoders."""

from math import pi

from .kernel import kernel


@kernel
def shaft_turned(count: float, reference: float, encoder_resolution: float) -> float:
    """Return the angle (rad) a shaft turned between two counts; encoder_resolution in counts per revolution."""
    return 2.0 * pi * (count - reference) / encoder_resolution


@kernel
def wheel_rate(left_shaft_speed: float, right_shaft_speed: float, pitch_rate: float, gear_ratio: float) -> float:
    """Return the mean absolute wheel rate in rad/s: theta' = (omega_l + omega_r) / (2 n) + psi'.

    Shaft speeds omega relative to the body and pitch_rate psi' in rad/s, forward positive; gear_ratio n.
    """
    return (left_shaft_speed + right_shaft_speed) / (2.0 * gear_ratio) + pitch_rate


@kernel
def yaw(left: float, right: float, wheel_radius: float, track_width: float, gear_ratio: float) -> float:
    """Return the yaw (rad, from shaft angles in rad) or the yaw rate (rad/s, from shaft speeds), left turn positive.

    phi = (R / W) (omega_r - omega_l) / n, paper eq (15); the body's pitch turns both shafts alike and drops out.

    wheel_radius R and track_width W in m, gear_ratio n. Neglected: slip.
    """
    return wheel_radius / track_width * (right - left) / gear_ratio
