"""Motion of the robot with its motors as smooth pieces between the events of dry friction.

The state is y = (pitch, yaw, wheel angle, s_l, s_r, w, i_l, i_r): angles in rad, speeds of the two motor shafts
relative to the body and pitch rate in rad/s, winding currents in A. The equations are Kane's, assembled from the
partial velocities of each body in the frame that turns with the heading (x forward, y left, z up):

    wheel i turns at u_i = s_i/n + w,   the axle's middle moves at v = R (u_l + u_r)/2,
    the frame turns at r = R (u_r - u_l)/W
    body's centre of gravity:  velocity (v + L cos(psi) w,  L sin(psi) r,  -L sin(psi) w)

Each dry contact (left and right shaft, at speed s_i; left and right wheel on the ground, at u_i) slides forward (1),
slides backward (-1) or sticks (0). In such a mode the equations are smooth and are integrated by the classical
Runge–Kutta method of fourth order; the windings are part of the system. A contact that comes to rest, or whose friction
would exceed its limit, ends the mode: the instant is found by bisection, and the next mode is the one whose
accelerations and friction torques agree with themselves, among all modes of the contacts that rest then.

Flat ground, no push. All compiled code is in this one file, because numba's cache notices changes only in the file that
holds a function.
"""

from math import cos, exp, inf, sin

import numpy as np
from numba import njit
from numpy.typing import NDArray

from twip.robot.parameters import value

Array = NDArray[np.float64]

NAMES = (
    "gravity", "gear_ratio", "wheel_radius", "wheel_mass", "wheel_inertia", "track_width", "body_mass", "cog_height",
    "body_pitch_inertia", "body_yaw_inertia", "rolling_resistance", "resistance", "inductance", "torque_constant",
    "back_emf_constant", "stribeck_speed", "rotor_inertia", "gear_inertia",
)  # fmt: skip
(
    GRAVITY, GEAR, RADIUS, WHEEL_MASS, WHEEL_INERTIA, TRACK, MASS, HEIGHT,
    PITCH_INERTIA, YAW_INERTIA, ROLLING, RESISTANCE, INDUCTANCE, TORQUE_CONSTANT,
    BACK_EMF, STRIBECK, ROTOR, REDUCTION,
) = range(len(NAMES))  # fmt: skip
COULOMB, STATIC, VISCOUS = len(NAMES), len(NAMES) + 4, len(NAMES) + 8
"""Where the friction of the shafts begins: left forward, left reverse, right forward, right reverse."""

PITCH, YAW, WHEEL, LEFT, RIGHT, RATE, CURRENT = range(7)
"""Places in the state; the left current is followed by the right one."""


def parameters(**changes: float) -> Array:
    """Return the nominal parameters as an array, with `changes` by name (dots as underscores)."""
    sides = [f"{side}.{{}}_{way}" for side in ("left", "right") for way in ("forward", "reverse")]
    names = [*NAMES, *(place.format(kind) for kind in ("coulomb", "static", "viscous") for place in sides)]
    given = {name.replace(".", "_"): value(name) for name in names}
    assert set(changes) <= set(given), f"unknown: {set(changes) - set(given)}"
    return np.array([changes.get(name, nominal) for name, nominal in given.items()], np.float64)


@njit(cache=True)
def contact_rows(p: Array) -> Array:
    """Return the speeds of the contacts (left shaft, right shaft, left wheel, right wheel) per s_l, s_r, w: (4, 3)."""
    n = p[GEAR]
    return np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0 / n, 0.0, 1.0], [0.0, 1.0 / n, 1.0]])


@njit(cache=True)
def dot(a: Array, b: Array) -> float:
    """Return the scalar product of two vectors (3,)."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True)
def times(m: Array, a: Array) -> Array:
    """Return the product of a matrix (3, 3) and a vector (3,)."""
    return np.array([dot(m[0], a), dot(m[1], a), dot(m[2], a)])


@njit(cache=True)
def add(matrix: Array, force: Array, partial: Array, inertia: float, effort: float) -> None:
    """Add a body's share: its inertia and the force or torque that acts along its partial velocity (3,)."""
    for i in range(3):
        force[i] += effort * partial[i]
        for j in range(3):
            matrix[i, j] += inertia * partial[i] * partial[j]


@njit(cache=True)
def equations(y: Array, p: Array) -> tuple[Array, Array]:
    """Return the mass matrix (3, 3) and the generalized forces (3,) of s_l, s_r, w without dry friction.

    M u' = sum over bodies of J^T (force - m a_0), J the body's partial velocities, a_0 its acceleration at u' = 0.
    """
    n = p[GEAR]
    radius = p[RADIUS]
    sine = sin(y[PITCH])
    cosine = cos(y[PITCH])
    height = p[HEIGHT]
    w = y[RATE]
    # wheel rates, speed of the axle's middle and yaw rate, per s_l, s_r, w
    left = np.array([1.0 / n, 0.0, 1.0])
    right = np.array([0.0, 1.0 / n, 1.0])
    ahead = 0.5 * radius * (left + right)
    turn = radius / p[TRACK] * (right - left)
    pitching = np.array([0.0, 0.0, 1.0])
    speeds = y[LEFT : RATE + 1]
    v = dot(ahead, speeds)
    r = dot(turn, speeds)
    # the body's centre: partial velocities and what its acceleration has without u'
    body_x = ahead + height * cosine * pitching
    body_y = height * sine * turn
    body_z = -height * sine * pitching
    still_x = -height * sine * w * w - r * (height * sine * r)
    still_y = height * cosine * w * r + r * (v + height * cosine * w)
    still_z = -height * cosine * w * w
    mass = p[MASS]
    matrix, force = np.zeros((3, 3)), np.zeros(3)
    add(matrix, force, body_x, mass, -mass * still_x)
    add(matrix, force, body_y, mass, -mass * still_y)
    add(matrix, force, body_z, mass, -mass * (still_z + p[GRAVITY]))
    add(matrix, force, pitching, p[PITCH_INERTIA], 0.0)
    add(matrix, force, turn, p[YAW_INERTIA], 0.0)
    # wheels: their centres only move along x, the left one at v - r W/2, the right one at v + r W/2
    for wheel, side in ((left, -1.0), (right, 1.0)):
        centre = ahead + 0.5 * side * p[TRACK] * turn
        add(matrix, force, centre, p[WHEEL_MASS], 0.0)
        add(matrix, force, wheel, p[WHEEL_INERTIA], 0.0)
    # rotor and gear, at the shafts' speed; torque and viscous friction act on the shafts
    for side in range(2):
        s = y[LEFT + side]
        matrix[side, side] += p[ROTOR] + p[REDUCTION]
        force[side] += p[TORQUE_CONSTANT] * y[CURRENT + side] - p[VISCOUS + 2 * side + (0 if s > 0.0 else 1)] * s
    return matrix, force


@njit(cache=True)
def limits(y: Array, p: Array) -> Array:
    """Return the friction limits (4, 2) [N.m] of the contacts against forward and against backward motion."""
    result = np.empty((4, 2))
    load_torque = 0.5 * p[ROLLING] * (p[MASS] + 2.0 * p[WHEEL_MASS]) * p[GRAVITY] * p[RADIUS]
    for side in range(2):
        ratio = y[LEFT + side] / p[STRIBECK]
        weight = exp(-ratio * ratio)
        for way in range(2):
            coulomb, static = p[COULOMB + 2 * side + way], p[STATIC + 2 * side + way]
            result[side, way] = coulomb + (static - coulomb) * weight
            result[2 + side, way] = load_torque
    return result


@njit(cache=True)
def at_rest(force: Array, bound: Array, n: float) -> tuple[float, Array]:
    """Return by how much [N.m] friction could hold everything at rest, negative if it could not, and its torques (4,).

    The three speeds leave one of the four torques free; that of the left wheel is taken from the middle of what the
    limits allow.
    """
    # shaft l: -f0 - g/n, shaft r: -f1 + (f2 + g)/n, wheel l: g, wheel r: -f2 - g; each within [-forward, reverse]
    low = max(
        max(-bound[2, 0], -force[2] - bound[3, 1]),
        max(n * (-force[0] - bound[0, 1]), n * (force[1] - bound[1, 0]) - force[2]),
    )
    high = min(
        min(bound[2, 1], -force[2] + bound[3, 0]),
        min(n * (-force[0] + bound[0, 0]), n * (force[1] + bound[1, 1]) - force[2]),
    )
    g = 0.5 * (low + high)
    torques = np.array([-force[0] - g / n, -force[1] + (force[2] + g) / n, g, -force[2] - g])
    return high - low, torques


@njit(cache=True)
def accelerations(y: Array, p: Array, mode: Array) -> tuple[Array, Array, float]:
    """Return u' (3,), the contacts' friction torques (4,) and the smallest margin [N.m] to the limit of what sticks."""
    rows = contact_rows(p)
    matrix, force = equations(y, p)
    bound = limits(y, p)
    torques = np.zeros(4)
    if np.sum(mode == 0.0) > 2:  # three contacts at rest are all four
        margin, torques = at_rest(force, bound, p[GEAR])
        return np.zeros(3), torques, margin
    stuck = np.empty(2, np.int64)
    count = 0
    for c in range(4):
        if mode[c] == 0.0:
            stuck[count] = c
            count += 1
        else:
            torques[c] = -mode[c] * bound[c, 0 if mode[c] > 0.0 else 1]
            force += torques[c] * rows[c]
    inverse = inverted(matrix)
    free = times(inverse, force)
    if count == 1:
        row = rows[stuck[0]]
        response = times(inverse, row)
        torques[stuck[0]] = -dot(row, free) / dot(row, response)
        free += torques[stuck[0]] * response
    elif count == 2:
        first, second = rows[stuck[0]], rows[stuck[1]]
        response1, response2 = times(inverse, first), times(inverse, second)
        a11, a12, a22 = dot(first, response1), dot(first, response2), dot(second, response2)
        b1, b2 = -dot(first, free), -dot(second, free)
        determinant = a11 * a22 - a12 * a12
        torques[stuck[0]] = (a22 * b1 - a12 * b2) / determinant
        torques[stuck[1]] = (a11 * b2 - a12 * b1) / determinant
        free += torques[stuck[0]] * response1 + torques[stuck[1]] * response2
    margin = inf
    for c in stuck[:count]:
        margin = min(margin, min(bound[c, 1] - torques[c], torques[c] + bound[c, 0]))
    return free, torques, margin


@njit(cache=True)
def inverted(m: Array) -> Array:
    """Return the inverse of a symmetric matrix (3, 3), by cofactors."""
    result = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            a, b, c, d = (i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3
            result[j, i] = m[a, c] * m[b, d] - m[a, d] * m[b, c]
    return result / (m[0, 0] * result[0, 0] + m[0, 1] * result[1, 0] + m[0, 2] * result[2, 0])


@njit(cache=True)
def derivative(y: Array, p: Array, mode: Array, voltage: Array) -> Array:
    """Return y' in a mode, with both voltages (2,) [V] held."""
    result = np.empty(8)
    result[LEFT : RATE + 1] = accelerations(y, p, mode)[0]
    result[PITCH] = y[RATE]
    result[YAW] = p[RADIUS] / p[TRACK] * (y[RIGHT] - y[LEFT]) / p[GEAR]
    result[WHEEL] = 0.5 * (y[LEFT] + y[RIGHT]) / p[GEAR] + y[RATE]
    for side in range(2):
        drop = p[BACK_EMF] * y[LEFT + side] + p[RESISTANCE] * y[CURRENT + side]
        result[CURRENT + side] = (voltage[side] - drop) / p[INDUCTANCE]
    return result


@njit(cache=True)
def runge_kutta(y: Array, p: Array, mode: Array, voltage: Array, h: float) -> Array:
    """Return the state a step h [s] later, without leaving the mode."""
    k1 = derivative(y, p, mode, voltage)
    k2 = derivative(y + 0.5 * h * k1, p, mode, voltage)
    k3 = derivative(y + 0.5 * h * k2, p, mode, voltage)
    k4 = derivative(y + h * k3, p, mode, voltage)
    return y + h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)


@njit(cache=True)
def left_by(y: Array, p: Array, mode: Array) -> int:
    """Return the contact that has turned back (0 to 3), 4 if what sticks exceeds its limit, or -1: still in the mode.

    1e-11 rad/s is the rounding of a contact that has just begun to slide.
    """
    rows = contact_rows(p)
    for c in range(4):
        if mode[c] != 0.0 and mode[c] * dot(rows[c], y[LEFT : RATE + 1]) < -1e-11:
            return c
    if np.any(mode == 0.0) and accelerations(y, p, mode)[2] < 0.0:
        return 4
    return -1


@njit(cache=True)
def next_mode(y: Array, p: Array, mode: Array, resting: Array) -> Array:
    """Return the mode that agrees with itself if the `resting` contacts (4,) may stick or begin to slide."""
    rows = contact_rows(p)
    best = mode.copy()
    smallest = inf
    if np.all(resting):
        still = np.zeros(4)
        if accelerations(y, p, still)[2] >= 0.0:
            return still
    scale = np.array([1.0, 1.0, p[GEAR], p[GEAR]])  # wheel rates as shaft speeds
    for code in range(81):
        trial = mode.copy()
        digits = code
        fits = True
        for c in range(4):
            choice = digits % 3 - 1.0
            digits //= 3
            if resting[c]:
                trial[c] = choice
            elif choice != 0.0:
                fits = False  # count each mode once
        if not fits or np.sum(trial == 0.0) > 2:
            continue
        u, _, margin = accelerations(y, p, trial)
        wrong = max(0.0, -margin) / 1e-6  # roughly as an acceleration of the shaft
        for c in range(4):
            if resting[c] and trial[c] != 0.0:
                wrong = max(wrong, -trial[c] * scale[c] * dot(rows[c], u))
        if wrong < smallest:
            smallest = wrong
            best = trial
    return best


@njit(cache=True)
def advance(y: Array, p: Array, mode: Array, voltage: Array, h: float) -> int:
    """Move `y` and `mode` by h [s], event by event; return how many events there were, -1 if there was no end."""
    rows = contact_rows(p)
    remaining = h
    for events in range(200):
        new = runge_kutta(y, p, mode, voltage, remaining)
        if left_by(new, p, mode) < 0:
            y[:] = new
            return events
        low, high = 0.0, remaining
        for _ in range(60):
            middle = 0.5 * (low + high)
            if left_by(runge_kutta(y, p, mode, voltage, middle), p, mode) < 0:
                low = middle
            else:
                high = middle
        new = runge_kutta(y, p, mode, voltage, high)
        which = left_by(new, p, mode)
        y[:] = new
        remaining -= high
        resting = mode == 0.0
        if 0 <= which < 4:
            resting[which] = True
        stop(y, p, rows, resting)
        # other contacts may come to rest at the same instant, as symmetric ones do
        for c in range(4):
            resting[c] = resting[c] or mode[c] * dot(rows[c], y[LEFT : RATE + 1]) <= 1e-11
        stop(y, p, rows, resting)
        mode[:] = next_mode(y, p, mode, resting)
    return -1


@njit(cache=True)
def stop(y: Array, p: Array, rows: Array, resting: Array) -> None:
    """Make the speeds of `resting` contacts exactly zero: a shift of the order of rounding."""
    if np.sum(resting) > 2:
        y[LEFT : RATE + 1] = 0.0
        return
    inverse = inverted(equations(y, p)[0])
    for _ in range(3):
        for c in range(4):
            if resting[c]:
                response = times(inverse, rows[c])
                y[LEFT : RATE + 1] -= dot(rows[c], y[LEFT : RATE + 1]) / dot(rows[c], response) * response


@njit(cache=True)
def record(y: Array, p: Array, mode: Array, voltage: Array, h: float, steps: int, every: int, rows: Array) -> int:
    """Do steps of h [s], keep every `every`-th state in `rows`; return the number of events, -1 after a failure."""
    total = 0
    for k in range(steps):
        events = advance(y, p, mode, voltage, h)
        if events < 0:
            return -1
        total += events
        if (k + 1) % every == 0:
            rows[k // every] = y
    return total


def energy(y: Array, p: Array) -> float:
    """Return kinetic and potential energy [J], windings included."""
    u = y[LEFT : RATE + 1]
    windings = 0.5 * p[INDUCTANCE] * float(y[CURRENT] * y[CURRENT] + y[CURRENT + 1] * y[CURRENT + 1])
    height = p[MASS] * p[GRAVITY] * p[HEIGHT] * cos(y[PITCH])
    return 0.5 * float(u @ equations(y, p)[0] @ u) + height + windings


def power_balance(y: Array, p: Array, mode: Array, voltage: Array) -> float:
    """Return the power [W] that the supply gives, less what friction and resistance take."""
    torques = accelerations(y, p, mode)[1]
    contacts = contact_rows(p) @ y[LEFT : RATE + 1]
    power = float(torques @ contacts)
    for side in range(2):
        s, i = y[LEFT + side], y[CURRENT + side]
        power += (
            float(voltage[side] * i - p[RESISTANCE] * i * i) - s * s * p[VISCOUS + 2 * side + (0 if s > 0.0 else 1)]
        )
    return power
