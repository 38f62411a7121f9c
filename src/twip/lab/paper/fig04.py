"""Fig 4: the inertia on the motor shaft from a run-up at constant current, against the estimate of eq (12)."""

import numpy as np

from ...robot import value
from ..drawing import BLUE, GREY, RED, THIN, label, legend, picture
from ..identification.experiments import ZERO_TIME
from ..identification.inertia import CurveFit, estimated_inertia, fit_curve, run_up_curve
from ..identification.recording import Recording
from .bench import Campaign, campaign
from .checks import Check, Result
from .laboratory import Array, Laboratory

SIDES = ("left", "right")
DURATION = 6.0
"""Time for which the current is on, in s."""
WINDOW = 5
"""Samples over which the drawn speed is taken from the encoder: 20 ms."""


def run(laboratory: Laboratory) -> Result:
    """Run both motors up at 70 mA, fit the curve of eq (10), and identify the inertia with all data."""
    found = {side: campaign(laboratory, side, False) for side in SIDES}
    errors = {side: c.errors("bench_inertia") or [np.inf] for side, c in found.items()}
    curves = {side: speeds(c.first_run_up) for side, c in found.items()}
    fits = {side: fit_curve(*curves[side]) for side in SIDES}
    truth = value("bench_inertia")
    by_curve = [100.0 * (fits[side].inertia(viscous(found[side])) / truth - 1.0) for side in SIDES]
    by_mass = estimated_inertia(
        *(value(n) for n in ("wheel_mass", "wheel_radius", "gear_ratio", "rotor_inertia", "gear_inertia"))
    )
    disc = value("wheel_inertia") / (value("wheel_mass") * value("wheel_radius") ** 2)
    apart = 100.0 * (truth / by_mass - 1.0)
    checks = (
        Check("Fig 4", "the inertia is identified from a run-up", "error of the inertia, left motor", errors["left"],
              -1.0, 1.0, "%", "required 1 %; prototype −0.03 to 0.14 %", max(map(abs, errors["left"])) < 1.0),
        Check("Fig 4", "", "error of the inertia, right motor", errors["right"], -1.0, 1.0, "%",
              "required 1 %; prototype −0.03 to 0.14 %", max(map(abs, errors["right"])) < 1.0),
        Check("Fig 4", "ω = a (1 − e^−bt), J = σ/b, eqs (10) and (11)",
              "error of the inertia by the curve alone, one run-up",
              by_curve, -2.0, 2.0, "%", "one run-up and one direction", max(map(abs, by_curve)) < 2.0, each="sides"),
        Check("Fig 4", "1.5450 and 1.3028 mg·m² are “approximately equal”, eq (12)",
              "identified over estimated inertia, difference",
              [apart], 18.0, 19.0, "%", "1.5450 / 1.3028", apart < 5.0, "18.6 % apart"),
        Check("Fig 4", "", "wheel's inertia over m R² that explains the difference", [disc], 0.67, 0.69, "",
              "a disc has 0.5"),
    )  # fmt: skip
    draw(laboratory, curves, fits)
    return Result("fig04", "Inertia from a run-up", checks, ("twip identify --bench logs/bench",))


def viscous(found: Campaign) -> float:
    """Return the identified viscous friction [N.m.s/rad], forward, of the first seed."""
    return found.found[0]["viscous_forward"].found()


def speeds(recording: Recording) -> tuple[Array, Array]:
    """Return times [s] since the current was switched on and speeds [rad/s] by the encoder, (n,) each."""
    on = np.searchsorted(recording.time, ZERO_TIME)
    end = np.searchsorted(recording.time, ZERO_TIME + DURATION)
    angles = np.zeros(0) if recording.angle is None else recording.angle
    time, angle = recording.time[on:end:WINDOW], angles[on:end:WINDOW]
    return 0.5 * (time[1:] + time[:-1]) - ZERO_TIME, np.diff(angle) / np.diff(time)


def draw(laboratory: Laboratory, curves: dict[str, tuple[Array, Array]], fits: dict[str, CurveFit]) -> None:
    """Draw measured speeds and fitted curves of both motors."""
    with picture(laboratory.out / "fig04.png", "Fig 4: run-up at 70 mA and fitted curve", (2.4, 2.4)) as rows:
        for axes, side in zip(rows, SIDES, strict=True):
            time, speed = curves[side]
            fit = fits[side]
            axes.plot(time, speed, color=BLUE, alpha=0.45, linewidth=4.0, label="speed by the encoder")
            axes.plot(time, run_up_curve(time, fit.a, fit.b), color=RED, linestyle="--", **{**THIN, "linewidth": 1.6},
                      label=f"{fit.a:.1f} rad/s (1 − exp(−{fit.b:.3f} t/s))")  # fmt: skip
            axes.axhline(fit.a, color=GREY, linestyle=":", linewidth=0.8)
            axes.set_title(f"{side} motor, forward")
            axes.set_xlim(0.0, DURATION)
            label(axes, "shaft speed [rad/s]", "time since the current is on [s]")
            legend(axes)
