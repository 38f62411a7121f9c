"""The outer velocity loop: a pitch reference that makes the robot keep a speed."""

from .kernel import kernel


@kernel
def pitch_reference(
    error: float, integral: float, elapsed: float, proportional_gain: float, integral_gain: float, limit: float
) -> tuple[float, float]:
    """Return the pitch reference (rad) and the new integral (m) of the speed error.

        psi_ref = sat(k_p e + k_i I),   I := I + e h

    A robot that is too slow leans forward: the lean sets its acceleration. While the reference is at its limit the
    integral does not grow in the direction of the excess (anti-windup). Not in the paper, whose law lets the robot
    drift.

    error e = speed_reference - speed in m/s, integral I in m, elapsed h in s; gains in rad.s/m and rad/m; limit in rad.
    """
    grown = integral + error * elapsed
    reference = proportional_gain * error + integral_gain * grown
    if reference > limit:
        return limit, integral if error > 0.0 else grown
    if reference < -limit:
        return -limit, integral if error < 0.0 else grown
    return reference, grown
