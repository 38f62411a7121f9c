"""The largest torque that dry friction can carry, and friction on a single shaft."""

from .elementary import exp
from .kernel import kernel


@kernel
def stribeck_weight(speed: float, stribeck_speed: float) -> float:
    """Return the share [1] of the static level at a speed [rad/s]: e^-(speed/stribeck_speed)^2."""
    if speed == 0.0:
        return 1.0
    if stribeck_speed <= 0.0:
        return 0.0
    relative = speed / stribeck_speed
    return exp(-relative * relative)


@kernel
def friction_levels(
    speed: float,
    coulomb_forward: float,
    coulomb_reverse: float,
    static_forward: float,
    static_reverse: float,
    stribeck_speed: float,
) -> tuple[float, float]:
    """Return the friction limits [N.m] towards positive and negative motion at a shaft speed [rad/s].

    T = T_c + (T_s - T_c) e^-(omega/v_s)^2   for each direction

    All limits are magnitudes. Friction lies anywhere within them while the shaft sticks and at the limit, against the
    motion, while it slides. The viscous part belongs to the motor's torque. Source: paper eqs (1) and (4), with the
    exponential weighting only the excess of static over Coulomb friction, sign outside.
    """
    if static_forward == coulomb_forward and static_reverse == coulomb_reverse:
        return coulomb_forward, coulomb_reverse
    weight = stribeck_weight(speed, stribeck_speed)
    return coulomb_forward + (static_forward - coulomb_forward) * weight, coulomb_reverse + (
        static_reverse - coulomb_reverse
    ) * weight


@kernel
def slide_or_stick(speed: float, impulse: float, inertia: float, forward: float, reverse: float) -> float:
    """Return the speed [rad/s] of one shaft after a drive impulse [N.m.s], with friction that agrees with it.

    J (omega+ - omega) = impulse + friction,   friction = -forward if omega+ > 0, +reverse if omega+ < 0, between if
    omega+ = 0

    `forward` and `reverse` are the friction limits times the step [N.m.s], `inertia` in kg.m2. A shaft that sticks
    gets exactly 0.
    """
    momentum = inertia * speed + impulse
    if momentum > forward:
        return (momentum - forward) / inertia
    if momentum < -reverse:
        return (momentum + reverse) / inertia
    return 0.0
