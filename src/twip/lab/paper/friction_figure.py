"""Figs 2 and 3 with tables 1 to 4: friction of one side, by the Coulomb-plus-viscous and by the Stribeck model."""

import numpy as np
from matplotlib.axes import Axes
from scipy.optimize import curve_fit

from ...robot import value
from ..drawing import BLUE, GREEN, RED, label, picture
from ..identification.friction import Balance, balance
from .bench import COULOMB, STRIBECK_SPEED, WAYS, Campaign, campaign
from .checks import Check, Result
from .laboratory import Array, Laboratory

LIMIT = 1.0
"""Largest error in percent that counts as recovered."""


def friction_figure(laboratory: Laboratory, side: str, number: int, tables: tuple[int, int]) -> Result:
    """Identify one side's motor with nominal friction, and with Stribeck friction; `number` of the figure."""
    plain, slow = campaign(laboratory, side, False), campaign(laboratory, side, True)
    plain_name, stribeck_name = (f"Table {n}" for n in tables)
    checks = [
        Check(plain_name, "T_c and σ are identified from steady speeds" if not row else "", f"error of {symbol}, {way}",
              errors, -LIMIT, LIMIT, "%", "required 1 %; prototype 0.4 %", worst(errors) < LIMIT)
        for row, (symbol, kind, way) in enumerate((s, k, w) for s, k in (("T_c", "coulomb"), ("σ",
        "viscous")) for w in WAYS)
        for errors in [plain.errors(f"{kind}_{way}")]
    ]  # fmt: skip
    crossing = COULOMB[side]["coulomb"][0] / COULOMB[side]["viscous"][0]
    checks.append(
        Check(plain_name, "T_c < 0 beside σ > 0, as printed", "speed at which T_c + σω changes its sign", [crossing],
              250.0, 400.0, "rad/s", "|T_c|/σ: 383 rad/s left, 297 rad/s right", False,
              "friction would drive the motor", "second column: negative velocity; T_c as a magnitude")
    )  # fmt: skip
    names = [f"{kind}_{way}" for kind in ("static", "stribeck_speed") for way in WAYS]
    told = sum(slow.identified(name) for name in names)
    returned = [fitted_stribeck_speed(slow, start) for start in (STRIBECK_SPEED, 1.0)]
    forward = {name: slow.errors(name, slow=True) or [np.inf] for name in ("static_forward", "stribeck_speed_forward")}
    checks += [
        Check(stribeck_name, "T_s and v_s are identified from the same samples", "parameters told by the staircase",
              [told], 0, 0, "", "the samples lie above 40 rad/s: e^−(40/0.41)² = 0", told > 0,
              "not without samples at low speed"),
        Check(stribeck_name, "v_s = 0.4102 rad/s in all four columns", "v_s from a fit started at 0.4102 rad/s",
              returned[:1], STRIBECK_SPEED, STRIBECK_SPEED, "rad/s", "returns where it starts", False,
              "it is the starting value"),
        Check(stribeck_name, "", "v_s from a fit started at 1 rad/s", returned[1:], 1.0, 1.0, "rad/s",
              "returns where it starts"),
        Check(stribeck_name, "(with samples at low speed: a voltage staircase about the Stribeck speed)",
              "error of T_s, forward", forward["static_forward"], -3.0, 3.0, "%", "noise of the bench's instruments"),
        Check(stribeck_name, "", "error of v_s, forward", forward["stribeck_speed_forward"], -10.0, 10.0, "%",
              "noise of the bench's instruments", None, "",
              "T_s and T_c must differ: right in reverse they are 2 % apart and T_s cannot be told"),
    ]  # fmt: skip
    draw(laboratory, slow, side, number, tables[1])
    return Result(f"fig{number:02d}", f"Friction of the {side} drive mechanism", checks,
                  ("twip identify --bench logs/bench",))  # fmt: skip


def worst(errors: list[float]) -> float:
    """Return the largest magnitude."""
    return max(map(abs, errors), default=float("inf"))


def samples(found: Campaign, direction: int, slow: bool) -> Balance:
    """Return the friction samples of one direction in the first seed."""
    identification = (found.found_slow if slow else found.found)[0]
    inertia = identification.inertia.value or 0.0
    return balance(identification.samples, direction, value("torque_constant"), inertia)


def stribeck(speed: Array, coulomb: float, static: float, stribeck_speed: float, viscous: float) -> Array:
    """Return the friction torque's magnitude [N.m] at positive speeds [rad/s], eq (4) corrected."""
    return np.asarray(coulomb + (static - coulomb) * np.exp(-((speed / stribeck_speed) ** 2)) + viscous * speed)


def fitted_stribeck_speed(found: Campaign, start: float) -> float:
    """Return the Stribeck speed [rad/s] of a plain least-squares fit to the staircase's samples, started at `start`."""
    data = samples(found, 1, slow=False)
    scale = 1e-4  # a torque in 0.1 mN.m, a viscous coefficient in 1e-7 N.m.s/rad: numbers about 1
    begin = (7.0, 6.0, start, 0.02)
    values, _ = curve_fit(
        stribeck, data.speed, data.torque / scale, p0=begin, method="trf", x_scale=(1.0, 1.0, 1.0, 0.01)
    )
    return float(values[2])


def draw(laboratory: Laboratory, found: Campaign, side: str, number: int, table: int) -> None:
    """Draw samples and both fits over the whole range of speed, and about the Stribeck speed."""
    title = f"Fig {number}: friction of the {side} drive mechanism (simulated with the friction of table {table})"
    with picture(laboratory.out / f"fig{number:02d}.png", title, (3.2,), columns=2) as rows:
        whole, enlarged = rows[0]
        for direction in (1, -1):
            draw_direction(whole, found, direction, slow=False, end=float(samples(found, direction, False).speed.max()))
            draw_direction(enlarged, found, direction, slow=True, end=3.0)
        whole.set_title("staircase of currents")
        enlarged.set_title("low speeds, enlarged")
        for panel in (whole, enlarged):
            label(panel, "friction torque [mN·m]", "shaft speed [rad/s]")
        whole.set_ylim(-2.1, 2.1)
        enlarged.set_ylim(-1.0, 1.0)
        whole.legend(loc="upper left")


def draw_direction(axes: Axes, found: Campaign, direction: int, slow: bool, end: float) -> None:
    """Draw the samples of one direction up to a speed `end` [rad/s], and both models as they were fitted."""
    way = WAYS[0 if direction > 0 else 1]
    names: list[str | None] = ["raw samples", "Coulomb plus viscous", "Stribeck, with low speeds"]
    if direction < 0:
        names = [None, None, None]
    data, plain, best = samples(found, direction, slow), found.found[0], found.found_slow[0]
    fine = np.linspace(1e-3, end, 400)
    shown = data.speed <= end
    speed, torque = direction * data.speed[shown], 1e3 * direction * data.torque[shown]
    axes.plot(speed, torque, "*", color=BLUE, markersize=6, label=names[0])
    line = plain[f"coulomb_{way}"].found() + plain[f"viscous_{way}"].found() * fine
    axes.plot(direction * fine, 1e3 * direction * line, "--", color=GREEN, linewidth=1.4, label=names[1])
    parameters = [best[f"{kind}_{way}"].value for kind in ("coulomb", "static", "stribeck_speed", "viscous")]
    known = [p for p in parameters if p is not None]
    if len(known) == len(parameters):
        curve = stribeck(fine, *known)
        axes.plot(direction * fine, 1e3 * direction * curve, ":", color=RED, linewidth=2.0, label=names[2])
