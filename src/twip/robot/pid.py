"""PID balance control (paper, section 5.3.1, eq (64)), for comparison with sliding mode."""

from .kernel import kernel


@kernel
def pid(
    error: float,
    rate: float,
    integral: float,
    elapsed: float,
    proportional_gain: float,
    integral_gain: float,
    derivative_gain: float,
    limit: float,
) -> tuple[float, float]:
    """Return the motor voltage and the new integral of the error.

        v = k_p e + k_i I + k_d e',   I := I + e h

    The voltage is held within +-limit; while it is, the integral does not grow in the direction of the excess
    (anti-windup).

    error e = psi - psi_ref in rad, positive leaning too far forward, and its rate e' in rad/s; integral I in rad.s;
    elapsed h in s; gains in V/rad, V/(rad.s), V.s/rad; limit in V. A positive voltage drives forward, under the body.
    """
    grown = integral + error * elapsed
    voltage = proportional_gain * error + integral_gain * grown + derivative_gain * rate
    if voltage > limit:
        return limit, integral if error > 0.0 else grown
    if voltage < -limit:
        return -limit, integral if error < 0.0 else grown
    return voltage, grown
