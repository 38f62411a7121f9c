"""Compensation of Coulomb friction by voltage."""

from .kernel import kernel


@kernel
def friction_voltage(
    command: float,
    shaft_speed: float,
    coulomb_forward: float,
    coulomb_reverse: float,
    resistance: float,
    torque_constant: float,
    full_speed: float,
    rest_speed: float,
) -> float:
    """Return the voltage that pays for one motor's Coulomb friction.

        v_c = (R_m / K_t) T_c sat(omega / omega_0)      moving
        v_c = (R_m / K_t) T_c sgn(command)              at rest, |omega| < rest_speed

    T_c is the value of the direction of motion, or at rest of the commanded direction. At rest the measured speed
    says nothing, and the full value takes the motor to the edge of motion without delay.

    command: voltage wanted without compensation, V; shaft_speed omega relative to the body, rad/s; coulomb_forward,
    coulomb_reverse: T_c for positive and negative omega, N.m; resistance R_m, Ohm; torque_constant K_t, N.m/A;
    full_speed omega_0 and rest_speed, rad/s. Neglected: Stribeck effect. Replaces F_c of paper eq (39), per motor and
    direction.
    """
    if shaft_speed >= rest_speed or shaft_speed <= -rest_speed:
        share = shaft_speed / full_speed
        if share > 1.0:
            share = 1.0
        elif share < -1.0:
            share = -1.0
    elif command > 0.0:
        share = 1.0
    elif command < 0.0:
        share = -1.0
    else:
        share = 0.0
    torque = coulomb_forward if share > 0.0 else coulomb_reverse
    return resistance / torque_constant * torque * share
