"""Fig 13: the robot stands up from 27 degrees, and from 30."""

import numpy as np

from ..drawing import BLUE, GREY, INK, REAL, RED, THIN, label, legend, picture, robot
from ..numbers import settling_time
from .checks import Check, Result
from .laboratory import Experiment, Laboratory, Run

RELEASE = 1.0
"""Time in s until which the robot is held and the drive is off."""
ANGLES = (27, 30)
INSTANTS = (-0.3, 0.05, 0.1, 0.15, 0.2, 0.3, 0.5, 1.0, 3.0)
"""Instants of the drawn robots, in s after the release."""
NO_AXLE_TERM = {
    "estimator.wheel_radius": 0.0025,
    "estimator.track_width": 0.01,
    "estimator.kalman_acceleration_scale": 0.025,
}
"""An estimator that sees a twentieth of the axle's acceleration, and otherwise the same robot."""


def run(laboratory: Laboratory) -> Result:
    """Release the robot at both angles, and once more from 27° without the axle's acceleration in the estimator."""
    experiments = {angle: Experiment(6.0, {"plant.pitch_start": np.radians(angle)}) for angle in ANGLES}
    checks, shown = [], {}
    for angle, experiment in experiments.items():
        runs = laboratory.runs(experiment)
        shown[angle] = runs[0]
        standing = sum(not r.fallen for r in runs)
        late = [float(np.max(np.abs(r.during(RELEASE + 3.0).degrees("plant.pitch")))) for r in runs]
        settled = [
            settling_time(p.times, p.degrees("plant.pitch"), 0.0, 1.0) for p in (r.during(RELEASE) for r in runs)
        ]
        errors = [estimator_error(r) for r in runs]
        said = (
            "the robot stands up from ψ = 27° and maintains its balance"
            if angle == 27
            else "… even when the initial pitch is nearly 30°"
        )
        checks += [
            Check("Fig 13", said, f"{angle}°: runs that stand", [standing], len(runs), len(runs), f"of {len(runs)}",
                  "prototype 20 of 20", standing == len(runs)),
            Check("Fig 13", "", f"{angle}°: largest pitch from 3 s after the release on", late, 0.0, 1.0, "°",
                  "balanced means within 1°", max(late) < 1.0),
            Check("Fig 13", "", f"{angle}°: time until the pitch stays within 1°", settled, 0.5, 3.0, "s",
                  "as above; video snapshots, no number in the paper"),
            Check("Fig 13", "the pitch is estimated precisely", f"{angle}°: largest estimator error", errors, 0.3, 0.63,
                  "°", "prototype ≤ 0.63°", max(errors) < 1.0),
        ]  # fmt: skip
    without = [
        estimator_error(r)
        for r in laboratory.runs(Experiment(6.0, {"plant.pitch_start": np.radians(27.0), **NO_AXLE_TERM}))
    ]
    checks.append(Check("Fig 13", "the estimator of the paper, without the axle's acceleration",
    "27°: largest estimator error", without,
                        4.5, 7.5, "°", "prototype up to 6.4°", max(without) < 1.0,
                        "eqs (43) and (44) lack the axle's acceleration"))  # fmt: skip
    draw(laboratory, shown)
    return Result("fig13", "Standing up", checks, [e.command() for e in experiments.values()])


def estimator_error(run: Run) -> float:
    """Return the largest difference in degrees between estimated and real pitch after the release."""
    part = run.during(RELEASE)
    return float(np.max(np.abs(part.degrees("estimator.pitch") - part.degrees("plant.pitch"))))


def draw(laboratory: Laboratory, shown: dict[int, Run]) -> None:
    """Draw a row of robots and the pitch for each starting angle."""
    with picture(laboratory.out / "fig13.png", "Fig 13: standing up, time after the release", (1.6, 1.6, 2.6)) as rows:
        for axes, (angle, run) in zip(rows[:2], shown.items(), strict=True):
            pitch = np.interp([RELEASE + t for t in INSTANTS], run.times, run["plant.pitch"])
            for column, (instant, lean) in enumerate(zip(INSTANTS, pitch, strict=True)):
                robot(axes, 0.33 * column, float(lean))
                words = "held" if instant < 0 else f"{instant:g} s"
                axes.text(
                    0.33 * column,
                    -0.03,
                    f"{words}\n{np.degrees(lean):.1f}°",
                    ha="center",
                    va="top",
                    fontsize=8,
                    color=INK,
                )
            axes.axhline(0.0, color=GREY, linewidth=1)
            axes.set(
                xlim=(-0.2, 0.33 * len(INSTANTS) - 0.13), ylim=(-0.14, 0.27), aspect="equal", title=f"from {angle}°"
            )
            axes.axis("off")
        axes = rows[2]
        for (angle, run), colour in zip(shown.items(), (RED, BLUE), strict=True):
            line = {**REAL, "alpha": 0.85 if angle == 27 else 0.4}
            axes.plot(run.times - RELEASE, run.degrees("plant.pitch"), label=f"real, from {angle}°", **line)
            axes.plot(
                run.times - RELEASE,
                run.degrees("estimator.pitch"),
                color=colour,
                label=f"estimate, from {angle}°",
                **THIN,
            )
        axes.axhspan(-1.0, 1.0, color=GREY, alpha=0.15, linewidth=0)
        axes.set_xlim(-0.3, 5.0)
        label(axes, "pitch [°]", "time after the release [s]")
        legend(axes)
