"""The equations of motion against derivations that share nothing with them but the assumptions."""

import random
from typing import Any

import pytest
import sympy as sp
from plain import load, started

PLANT = load("plant").BLOCK

PARAMETERS = (
    "gravity", "gear_ratio", "wheel_radius", "wheel_mass", "wheel_inertia", "rotor_inertia", "gear_inertia",
    "track_width", "body_mass", "cog_height", "body_pitch_inertia", "body_yaw_inertia", "push_height",
)  # fmt: skip
INPUTS = ("left_drive_torque", "right_drive_torque", "push_force", "body_torque", "slope")
P = {name: sp.Symbol(name) for name in (*PARAMETERS, *INPUTS)}
T = sp.Symbol("t")
THETA, PSI, PHI = (sp.Function(name)(T) for name in ("theta", "psi", "phi"))
RATES = tuple(q.diff(T) for q in (THETA, PSI, PHI))
ACCELERATIONS = tuple(q.diff(T, 2) for q in (THETA, PSI, PHI))
LEFT_RATE = RATES[0] - P["track_width"] / (2 * P["wheel_radius"]) * RATES[2]
RIGHT_RATE = RATES[0] + P["track_width"] / (2 * P["wheel_radius"]) * RATES[2]


def rotor_part() -> list[sp.Expr]:
    """Inertial torques on theta, psi, phi of the rotors, counted at their speed relative to the body alone."""
    inertia = P["rotor_inertia"] + P["gear_inertia"]
    speeds = [P["gear_ratio"] * (wheel - RATES[1]) for wheel in (LEFT_RATE, RIGHT_RATE)]
    return [sum(inertia * speed.diff(T) * speed.diff(rate) for speed in speeds) for rate in RATES]


def drive_part() -> list[sp.Expr]:
    """Torques on theta, psi, phi of the drives, by their power."""
    power = P["gear_ratio"] * (
        P["left_drive_torque"] * (LEFT_RATE - RATES[1]) + P["right_drive_torque"] * (RIGHT_RATE - RATES[1])
    )
    return [sp.expand(power).diff(rate) for rate in RATES]


def flat_ground() -> list[sp.Expr]:
    """Jourdain's principle in the inertial frame: no Lagrangian, the constraint put in at the level of velocity.

    Every body contributes m a . dv/du + (I omega)' . domega/du - force . dv/du. The wheels' inertia about their own
    diameters is left out, it belongs to `body_yaw_inertia`.
    """
    g, radius, mass, wheel = (P[k] for k in ("gravity", "wheel_radius", "body_mass", "wheel_mass"))
    heading = sp.Matrix([sp.cos(PHI), sp.sin(PHI), 0])
    left = sp.Matrix([-sp.sin(PHI), sp.cos(PHI), 0])
    up = sp.Matrix([0, 0, 1])
    axle = radius * RATES[0] * heading

    def velocity(offset: sp.Matrix) -> sp.Matrix:
        return axle + offset.diff(T)

    lean = sp.cos(PSI) * up + sp.sin(PSI) * heading
    body_x = sp.cos(PSI) * heading - sp.sin(PSI) * up
    omega = RATES[2] * up + RATES[1] * left
    attitude = sp.Matrix.hstack(body_x, left, lean)
    inertia = attitude * sp.diag(P["body_yaw_inertia"], P["body_pitch_inertia"], P["body_yaw_inertia"]) * attitude.T
    push = velocity(P["push_height"] * lean)
    bodies = [(mass, velocity(P["cog_height"] * lean))]
    bodies += [(wheel, velocity(sign * P["track_width"] / 2 * left)) for sign in (1, -1)]
    result = []
    for i, rate in enumerate(RATES):
        row = sum(m * (v.diff(T) + g * up).dot(v.diff(rate)) for m, v in bodies)
        row += (inertia * omega).diff(T).dot(omega.diff(rate)) - P["body_torque"] * omega.dot(left).diff(rate)
        row += sum(P["wheel_inertia"] * w.diff(T) * w.diff(rate) for w in (LEFT_RATE, RIGHT_RATE))
        row -= P["push_force"] * heading.dot(push.diff(rate))
        result.append(row + rotor_part()[i] - drive_part()[i])
    return result


ALPHA, CURVATURE = sp.symbols("alpha curvature")


def curved_ground() -> list[sp.Expr]:
    """The same principle in the frame of the ground under the axle, which turns with yaw and slope."""
    along, normal = sp.Matrix([1, 0, 0]), sp.Matrix([0, 0, 1])
    left = sp.Matrix([0, 1, 0])
    slope = sp.Function("slope")(THETA)
    turning = RATES[2] * normal - slope.diff(T) * left

    def change(vector: sp.Matrix) -> sp.Matrix:
        return vector.diff(T) + turning.cross(vector)

    vertical = sp.Matrix([sp.sin(slope), 0, sp.cos(slope)])
    horizontal = sp.Matrix([sp.cos(slope), 0, -sp.sin(slope)])
    lean = sp.cos(PSI) * vertical + sp.sin(PSI) * horizontal
    omega = RATES[2] * normal + RATES[1] * left
    axle = P["wheel_radius"] * RATES[0] * along
    centre = axle + P["cog_height"] * omega.cross(lean)
    push = axle + P["push_height"] * omega.cross(lean)
    bodies = [(P["body_mass"], centre)]
    bodies += [
        (P["wheel_mass"], axle + sign * P["track_width"] / 2 * (RATES[2] * normal).cross(left)) for sign in (1, -1)
    ]
    inertia = sp.diag(P["body_yaw_inertia"], P["body_pitch_inertia"], P["body_yaw_inertia"])
    result = []
    for i, rate in enumerate(RATES):
        row = sum(m * (change(v) + P["gravity"] * vertical).dot(v.diff(rate)) for m, v in bodies)
        row += change(inertia * omega).dot(omega.diff(rate)) - P["body_torque"] * omega.dot(left).diff(rate)
        row += sum(P["wheel_inertia"] * w.diff(T) * w.diff(rate) for w in (LEFT_RATE, RIGHT_RATE))
        row -= P["push_force"] * horizontal.dot(push.diff(rate))
        result.append(row + rotor_part()[i] - drive_part()[i])
    return result


def planar_lagrangian() -> list[sp.Expr]:
    """Lagrange's equations on a curved path without yaw: the place of the axle enters through its path alone."""
    slope = sp.Function("slope")(THETA)
    radius, height = P["wheel_radius"], P["cog_height"]
    axle_x, axle_z = (radius * RATES[0] * f(slope) for f in (sp.cos, sp.sin))
    body_x = axle_x + height * RATES[1] * sp.cos(PSI)
    body_z = axle_z - height * RATES[1] * sp.sin(PSI)
    shaft = P["gear_ratio"] * (RATES[0] - RATES[1])
    kinetic = (
        P["body_mass"] * (body_x**2 + body_z**2) / 2 + P["wheel_mass"] * (axle_x**2 + axle_z**2)
        + P["wheel_inertia"] * RATES[0] ** 2 + P["body_pitch_inertia"] * RATES[1] ** 2 / 2
        + (P["rotor_inertia"] + P["gear_inertia"]) * shaft**2
    )  # fmt: skip
    weight = (P["body_mass"] + 2 * P["wheel_mass"]) * P["gravity"]
    on_theta = -weight * radius * sp.sin(slope) + P["push_force"] * radius * sp.cos(slope)
    on_psi = P["body_mass"] * P["gravity"] * height * sp.sin(PSI) + P["body_torque"]
    on_psi += P["push_force"] * P["push_height"] * sp.cos(PSI)
    rows = []
    for q, rate, force in ((THETA, RATES[0], on_theta), (PSI, RATES[1], on_psi)):
        rows.append(kinetic.diff(rate).diff(T) - kinetic.diff(q) - force)
    drive = [row.subs(PHI, 0).doit() for row in drive_part()]
    return [rows[0] - drive[0], rows[1] - drive[1]]


def evaluate(rows: list[sp.Expr], v: Any, slope: float, curvature: float) -> list[float]:
    """Return the residuals at the plant's state and accelerations, each over the sum of its terms' sizes."""
    symbols = {name: sp.Symbol(name) for name in ("th", "ps", "ph", "dth", "dps", "dph", "ath", "aps", "aph")}
    new = list(symbols.values())
    replaced = []
    for row in rows:
        row = row.doit()
        row = row.subs(sp.Function("slope")(THETA).diff(THETA), CURVATURE)
        row = row.subs(zip(ACCELERATIONS, new[6:], strict=True)).subs(zip(RATES, new[3:6], strict=True))
        row = row.subs(sp.Function("slope")(THETA), ALPHA).subs(zip((THETA, PSI, PHI), new[:3], strict=True))
        replaced.append(sp.expand(row))
    numbers = [v.wheel_angle, v.pitch, v.yaw, v.wheel_rate, v.pitch_rate, v.yaw_rate]
    numbers += [v.wheel_acceleration, v.pitch_acceleration, v.yaw_acceleration, slope, curvature]
    numbers += [getattr(v, name) for name in P]
    arguments = [*new, ALPHA, CURVATURE, *P.values()]
    residuals = []
    for row in replaced:
        terms = [sp.lambdify(arguments, term, "math")(*numbers) for term in sp.Add.make_args(row)]
        residuals.append(sum(terms) / sum(abs(term) for term in terms))
    return residuals


def random_state(seed: int, **values: float) -> Any:
    """Return a frictionless plant with random parameters (0.5 to 2 times nominal), state and inputs."""
    draw = random.Random(seed)
    block_values = {name: draw.uniform(0.5, 2.0) * getattr(started(PLANT), name) for name in PARAMETERS}
    return started(
        PLANT,
        **block_values
        | {
            "rolling_resistance": 0.0, "pitch_start": draw.uniform(-1.5, 1.5), "pitch_rate_start": draw.uniform(-5, 5),
            "wheel_rate_start": draw.uniform(-20, 20),
            "yaw_start": draw.uniform(-3, 3), "yaw_rate_start": draw.uniform(-5, 5),
            "left_drive_torque": draw.uniform(-0.05, 0.05), "right_drive_torque": draw.uniform(-0.05, 0.05),
            "push_force": draw.uniform(-20, 20), "body_torque": draw.uniform(-1, 1),
        }
        | values,
    )  # fmt: skip


# residuals are relative to the sum of the terms' magnitudes, so rounding alone stays within some 1e-15 of it
ROUNDING = 1e-12


@pytest.fixture(scope="module")
def flat() -> list[sp.Expr]:
    return flat_ground()


@pytest.mark.parametrize("seed", range(3))
def test_flat_ground_with_yaw(flat: list[sp.Expr], seed: int) -> None:
    residuals = evaluate(flat, random_state(seed), 0.0, 0.0)
    assert max(map(abs, residuals)) < ROUNDING


@pytest.mark.parametrize("seed", range(3))
def test_slope_and_bumps_without_yaw(seed: int) -> None:
    draw = random.Random(seed)
    v = random_state(
        seed, yaw_start=0.0, yaw_rate_start=0.0, slope=draw.uniform(-0.4, 0.4), bump_height=0.02, bump_start=0.0,
        wheel_angle_start=draw.uniform(0.1, 0.9) * 0.1 / 0.05,
    )  # fmt: skip
    v.right_drive_torque = v.left_drive_torque
    v.wheel_radius = 0.05
    PLANT.initialize(v, 0.0)
    slope, curvature = v.ground_slope, v.ground_slope_rate / v.wheel_rate
    assert curvature != 0.0
    residuals = evaluate(planar_lagrangian(), v, slope, curvature)
    assert max(map(abs, residuals)) < ROUNDING


@pytest.mark.parametrize("seed", range(3))
def test_slope_and_bumps_with_yaw(seed: int) -> None:
    draw = random.Random(seed)
    v = random_state(
        seed, slope=draw.uniform(-0.4, 0.4), bump_height=-0.02, bump_start=0.0,
        wheel_radius=0.05, wheel_angle_start=draw.uniform(0.1, 0.9) * 0.1 / 0.05,
    )  # fmt: skip
    residuals = evaluate(curved_ground(), v, v.ground_slope, v.ground_slope_rate / v.wheel_rate)
    assert max(map(abs, residuals)) < ROUNDING


def test_the_paper_lacks_two_terms(flat: list[sp.Expr]) -> None:
    """Lagrange's equations with phi as an ordinary coordinate, as in the paper, miss the terms that do no work."""
    v = random_state(5)
    term = v.body_mass * v.cog_height * v.wheel_radius * sp.sin(v.pitch)
    lagrange_row1 = flat[0] + term * RATES[2] ** 2
    lagrange_row3 = flat[2] - term * RATES[0] * RATES[2]
    row1, row3 = evaluate([lagrange_row1, lagrange_row3], v, 0.0, 0.0)
    assert abs(row1) > 1e-3
    assert abs(row3) > 1e-3
    power = -term * v.yaw_rate * v.yaw_rate * v.wheel_rate + term * v.wheel_rate * v.yaw_rate * v.yaw_rate
    assert power == pytest.approx(0.0, abs=1e-15)
