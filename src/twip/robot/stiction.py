"""Dry friction of the robot: which of its four contacts stick, which slide, and what speeds that leaves.

Speeds are those of the left wheel u_l, the right wheel u_r (both absolute) and the body's pitch w, in rad/s. The
contacts, in this order everywhere, move at

    rolling left  u_l      rolling right  u_r      shaft left  u_l - w      shaft right  u_r - w

Given the momenta p of the three speeds after a step without friction, impulses j are sought so that each contact's
speed after the step and its impulse agree: j = -forward where it moves forward, +reverse where it moves backward,
between these where it rests (time stepping after Moreau; the limits are torques times the step). The speeds are the
minimum of a strictly convex function and therefore unique. The impulses are not when all four contacts rest, because
u_l - u_r = (u_l - w) - (u_r - w).

A mode gives each contact its direction: 1., -1. or 0. (sticks). In a mode the speeds follow from a linear system in
what may still move, so that what sticks rests exactly. The right mode is the one whose result agrees with itself. It
is found by correcting the contacts that do not, and if that leads nowhere, by trying all modes.

Left and right enter symmetrically down to the order of sums: the mirrored problem has the mirrored solution, bit for
bit.
"""

from .kernel import kernel

Speeds = tuple[float, float, float]
"""Left wheel, right wheel, pitch [rad/s]."""

Momenta = tuple[float, float, float]
"""Of left wheel, right wheel, pitch [N.m.s]."""

Inertia = tuple[float, float, float, float]
"""Entries s, c, x, w [kg.m2] of the mass matrix [[s, c, x], [c, s, x], [x, x, w]]."""

Limits = tuple[float, float, float, float, float, float]
"""Rolling left and right, left shaft forward and reverse, right shaft forward and reverse, at the wheels [N.m.s]."""

Contacts = tuple[float, float, float, float]
"""One number for each contact: its impulse [N.m.s] or its direction."""

TOLERANCE = 1e-12
"""A sticking contact may exceed its limit by this share: rounding of the impulse."""


@kernel
def direction(speed: float) -> float:
    """Return the sign of a speed: 1., -1. or 0."""
    return 1.0 if speed > 0.0 else (-1.0 if speed < 0.0 else 0.0)


@kernel
def directions(speeds: Speeds) -> Contacts:
    """Return the directions in which the contacts move at given speeds."""
    left, right, pitch = speeds
    return direction(left), direction(right), direction(left - pitch), direction(right - pitch)


@kernel
def sticking(mode: Contacts) -> int:
    """Return how many contacts stick in a mode."""
    return (mode[0] == 0.0) + (mode[1] == 0.0) + (mode[2] == 0.0) + (mode[3] == 0.0)


@kernel
def rest_impulses(momenta: Momenta, limits: Limits) -> tuple[bool, Contacts]:
    """Return whether friction can hold everything at rest, and its impulses.

    At rest j1 + j3 = -p_l, j2 + j4 = -p_r and j3 + j4 = p_w leave one impulse free: any j3 in the intersection of four
    intervals will do, its middle is taken.
    """
    p_left, p_right, p_pitch = momenta
    rolling_left, rolling_right, left_forward, left_reverse, right_forward, right_reverse = limits
    low = max(
        max(-left_forward, -p_left - rolling_left), max(p_pitch - right_reverse, p_right + p_pitch - rolling_right)
    )
    high = min(
        min(left_reverse, rolling_left - p_left), min(p_pitch + right_forward, p_right + p_pitch + rolling_right)
    )
    shaft_left = 0.5 * (low + high)
    shaft_right = p_pitch - shaft_left
    rolling = (-p_left - shaft_left, -p_right - shaft_right)
    known = p_left + p_right + p_pitch
    # not a number is not at rest: it must show in the speeds
    return low <= high and known == known, (rolling[0], rolling[1], shaft_left, shaft_right)


@kernel
def mode_solution(inertia: Inertia, momenta: Momenta, limits: Limits, mode: Contacts) -> tuple[Speeds, Contacts]:
    """Return the speeds and the impulses in a mode with at most two sticking contacts.

    What sticks is eliminated (a wheel stands or turns with the body, the body stands), the rest is solved, and the
    impulses of the sticking contacts are what the eliminated equations lack.
    """
    side, cross, mixed, own = inertia
    rolling_left, rolling_right, left_forward, left_reverse, right_forward, right_reverse = limits
    s1, s2, s3, s4 = mode
    j1 = -rolling_left * s1
    j2 = -rolling_right * s2
    j3 = -(left_forward if s3 > 0.0 else left_reverse) * s3
    j4 = -(right_forward if s4 > 0.0 else right_reverse) * s4
    q_left = momenta[0] + (j1 + j3)
    q_right = momenta[1] + (j2 + j4)
    q_pitch = momenta[2] - (j3 + j4)

    body = 0.0 if (s1 == 0.0 and s3 == 0.0) or (s2 == 0.0 and s4 == 0.0) else 1.0
    left_free = 1.0 if s1 != 0.0 and s3 != 0.0 else 0.0
    right_free = 1.0 if s2 != 0.0 and s4 != 0.0 else 0.0
    left_with_body = body if s1 != 0.0 and s3 == 0.0 else 0.0
    right_with_body = body if s2 != 0.0 and s4 == 0.0 else 0.0

    # the wheels that move by themselves: two equations, a trivial one for each wheel that does not
    a_left = side if left_free == 1.0 else 1.0
    a_right = side if right_free == 1.0 else 1.0
    a_cross = left_free * right_free * cross
    determinant = a_left * a_right - a_cross * a_cross
    b_left = left_free * (right_with_body * cross + body * mixed)
    b_right = right_free * (left_with_body * cross + body * mixed)
    y_left = (a_right * b_left - a_cross * b_right) / determinant
    y_right = (a_left * b_right - a_cross * b_left) / determinant
    r_left = left_free * q_left
    r_right = right_free * q_right
    z_left = (a_right * r_left - a_cross * r_right) / determinant
    z_right = (a_left * r_right - a_cross * r_left) / determinant

    # the body, with the wheels that turn with it
    together = left_with_body + right_with_body
    moved = own + together * (side + 2.0 * mixed) + 2.0 * left_with_body * right_with_body * cross
    q_moved = q_pitch + (left_with_body * q_left + right_with_body * q_right)
    pitch = 0.0
    if body == 1.0:
        pitch = (q_moved - (b_left * z_left + b_right * z_right)) / (moved - (b_left * y_left + b_right * y_right))
    left = z_left - y_left * pitch if left_free == 1.0 else (pitch if left_with_body == 1.0 else 0.0)
    right = z_right - y_right * pitch if right_free == 1.0 else (pitch if right_with_body == 1.0 else 0.0)

    lack_left = side * left + cross * right + mixed * pitch - q_left
    lack_right = side * right + cross * left + mixed * pitch - q_right
    lack_pitch = mixed * (left + right) + own * pitch - q_pitch
    if s3 == 0.0:
        j3 = -lack_pitch if s1 == 0.0 else lack_left
    if s1 == 0.0:
        j1 = lack_left - j3 if s3 == 0.0 else lack_left
    if s4 == 0.0:
        j4 = -lack_pitch if s2 == 0.0 else lack_right
    if s2 == 0.0:
        j2 = lack_right - j4 if s4 == 0.0 else lack_right
    return (left, right, pitch), (j1, j2, j3, j4)


@kernel
def corrected(mode: float, speed: float, impulse: float, forward: float, reverse: float) -> float:
    """Return the direction that suits a contact's result better than the one it was computed with, or the same."""
    if mode == 0.0:
        if impulse < -forward * (1.0 + TOLERANCE):
            return 1.0
        return -1.0 if impulse > reverse * (1.0 + TOLERANCE) else 0.0
    return mode if mode * speed >= 0.0 or (forward == 0.0 and reverse == 0.0) else 0.0


@kernel
def disagreement(mode: float, speed: float, impulse: float, forward: float, reverse: float, inertia: float) -> float:
    """Return by how much [N.m.s] a contact's result contradicts its direction."""
    if mode == 0.0:
        return max(max(-forward - impulse, impulse - reverse), 0.0)
    return 0.0 if forward == 0.0 and reverse == 0.0 else max(-mode * speed * inertia, 0.0)


@kernel
def stick_slip(inertia: Inertia, momenta: Momenta, limits: Limits, guess: Contacts) -> tuple[Speeds, Contacts]:
    """Return the speeds and the friction impulses after a step with dry friction, see the module.

    `guess` is a mode, for instance the directions before the step: it decides how long it takes, not the result.
    """
    can_rest, impulses = rest_impulses(momenta, limits)
    if can_rest:
        return (0.0, 0.0, 0.0), impulses
    mode = guess
    if sticking(mode) > 2:
        # three contacts at rest are all four, which is excluded: begin where the robot would go without friction
        speeds, impulses = mode_solution(inertia, momenta, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (1.0, 1.0, 1.0, 1.0))
        mode = directions(speeds)
    for _ in range(8):
        if sticking(mode) > 2:
            break
        speeds, impulses = mode_solution(inertia, momenta, limits, mode)
        left, right, pitch = speeds
        better = (
            corrected(mode[0], left, impulses[0], limits[0], limits[0]),
            corrected(mode[1], right, impulses[1], limits[1], limits[1]),
            corrected(mode[2], left - pitch, impulses[2], limits[2], limits[3]),
            corrected(mode[3], right - pitch, impulses[3], limits[4], limits[5]),
        )
        if better == mode:
            return speeds, impulses
        mode = better
    return best_of_all(inertia, momenta, limits)


@kernel
def best_of_all(inertia: Inertia, momenta: Momenta, limits: Limits) -> tuple[Speeds, Contacts]:
    """Return the result of the mode that agrees with itself best, of all modes with at most two sticking contacts."""
    smallest = 1e300
    best, best_impulses = mode_solution(inertia, momenta, limits, (1.0, 1.0, 1.0, 1.0))
    for code in range(81):
        mode = (code % 3 - 1.0, code // 3 % 3 - 1.0, code // 9 % 3 - 1.0, code // 27 - 1.0)
        if sticking(mode) <= 2:
            speeds, impulses = mode_solution(inertia, momenta, limits, mode)
            left, right, pitch = speeds
            rolling_left = disagreement(mode[0], left, impulses[0], limits[0], limits[0], inertia[0])
            rolling_right = disagreement(mode[1], right, impulses[1], limits[1], limits[1], inertia[0])
            shaft_left = disagreement(mode[2], left - pitch, impulses[2], limits[2], limits[3], inertia[0])
            shaft_right = disagreement(mode[3], right - pitch, impulses[3], limits[4], limits[5], inertia[0])
            worst = max(max(rolling_left, rolling_right), max(shaft_left, shaft_right))
            if worst < smallest:
                smallest = worst
                best = speeds
                best_impulses = impulses
    return best, best_impulses
