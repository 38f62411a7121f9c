"""The direct-current motor: current, torque and the viscous part of its friction."""

from .elementary import exp
from .kernel import kernel


@kernel
def current_response(current: float, steady: float, rate: float, step: float) -> tuple[float, float]:
    """Return the current [A] at the end of a step and its mean over the step, exactly.

    di/dt = -rate (i - steady):   i(h) = steady + (i - steady) e^-x,   mean = steady + (i - steady) (1 - e^-x)/x,   x
    = rate h

    `rate` = R/L [1/s], `step` h [s] may be as small as 0. `steady` [A] is the current that voltage and speed would
    end in.
    """
    x = rate * step
    decay = exp(-x)
    # below 1e-4 the difference 1 - e^-x has lost more than the series' next term, x^4/120
    mean_decay = (1.0 - decay) / x if x > 1e-4 else 1.0 - x / 2.0 * (1.0 - x / 3.0 * (1.0 - x / 4.0))
    return steady + (current - steady) * decay, steady + (current - steady) * mean_decay


@kernel
def viscous_torque(speed: float, viscous_forward: float, viscous_reverse: float) -> float:
    """Return the viscous friction torque [N.m] on the shaft: -sigma(sign omega) omega, paper eq (1)."""
    return -(viscous_forward if speed > 0.0 else viscous_reverse) * speed


@kernel
def motor_step(
    current: float, voltage: float, speed: float, step: float, resistance: float, inductance: float,
    torque_constant: float, back_emf_constant: float, viscous_forward: float, viscous_reverse: float,
) -> tuple[float, float]:  # fmt: skip
    """Return the current [A] at the end of the step and the drive torque [N.m], its mean over the step.

    L di/dt = v - K_b omega - R i          tau = K_t i - sigma(sign omega) omega

    `voltage` v [V] and shaft `speed` omega [rad/s] are constant over the `step` [s]; resistance R [Ohm], inductance L
    [H], K_t [N.m/A], K_b [V.s/rad], sigma [N.m.s/rad] per direction. Positive voltage drives towards positive speed,
    which is the wheel rolling forward. Coulomb and static friction are not in the torque: the plant resolves them
    with the inertia they hold. Source: paper eqs (1), (2), (28), the last with the derivative kept.
    """
    steady = (voltage - back_emf_constant * speed) / resistance
    end, mean = current_response(current, steady, resistance / inductance, step)
    return end, torque_constant * mean + viscous_torque(speed, viscous_forward, viscous_reverse)
