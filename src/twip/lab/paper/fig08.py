"""Fig 8: pitch integrated from the gyro alone, eq (42), over 40 s."""

import numpy as np

from ...robot import value
from ..drawing import BLUE, GREY, REAL, RED, THIN, label, legend, picture
from .checks import Check, Result
from .laboratory import Array, Laboratory, Run
from .swing import RELEASE, SLOW_AMPLITUDE, SLOW_FREQUENCY, encoder_pitch, error, smooth_step, swung

END = RELEASE + 40.0
EARLY, LATE = (RELEASE, RELEASE + 10.0), (RELEASE + 20.0, END)
"""Intervals in s in which the drift is judged."""


def slowly(times: Array) -> Array:
    """Return the pitch: swings of 0.2 Hz from the release on."""
    angle = 2.0 * np.pi * SLOW_FREQUENCY * (times - RELEASE)
    return np.asarray(smooth_step(times, RELEASE, 1.0) * SLOW_AMPLITUDE * np.sin(angle))


def run(laboratory: Laboratory) -> Result:
    """Swing the body slowly for 40 s with the wheels locked."""
    experiment = swung(laboratory, "swing_40s.csv", slowly, END, 0.02)
    recorded = [laboratory.run(experiment, seed).sampled() for seed in range(1, laboratory.seeds + 1)]
    early, late = ([error(r, "pitch_gyro", interval) for r in recorded] for interval in (EARLY, LATE))
    kalman = [error(r, "pitch", LATE) for r in recorded]
    rates = [drift(r)[-1] / (END - RELEASE) for r in recorded]
    checks = (
        Check("Fig 8", "the integrated gyro is accurate only in the short term", "rms error in the first 10 s",
              early, 2.4, 3.4, "°", "prototype 2.9°: bias 0.5°/s, 0.5·10/√3", max(early) < 5.0),
        Check("Fig 8", "… and not over a long period", "rms error from 20 to 40 s",
              late, 12.5, 18.5, "°", "prototype 15.6°; bias 15.3°, its walk ±1°", min(late) > 10.0),
        Check("Fig 8", "the error increases because of gyro drift", "mean drift over 40 s",
              rates, 0.4, 0.6, "°/s", "bias 0.5°/s, random walk 0.01°/s/√s", min(rates) > 0.0),
        Check("Fig 8", "(for comparison) the Kalman filter does not drift",
              "rms error of the Kalman filter from 20 to 40 s",
              kalman, 0.0, 0.6, "°", "as in Fig 11"),
    )  # fmt: skip
    first = recorded[0]
    with picture(laboratory.out / "fig08.png", "Fig 8: pitch integrated from the gyro alone", (2.9, 2.0)) as (top, low):
        top.plot(first.times, np.degrees(encoder_pitch(first)), label="real (encoder)", **REAL)
        top.plot(first.times, first.degrees("estimator.pitch_gyro"), color=RED, label="gyro, integrated", **THIN)
        label(top, "pitch [°]")
        for other in recorded[1:]:
            low.plot(other.times, drift(other), color=GREY, linewidth=0.6, alpha=0.6)
        low.plot(first.times, drift(first), color=RED, label="error, seed 1", **THIN)
        low.plot([], [], color=GREY, linewidth=0.6, label="other seeds")
        bias = np.degrees(value("gyro_bias")) * (first.times - RELEASE).clip(0.0)
        low.plot(first.times, bias, color=BLUE, linestyle="--", label="bias 0.5°/s alone", **THIN)
        label(low, "error [°]")
        for axes in (top, low):
            axes.set_xlim(0.0, END)
            legend(axes)
    return Result("fig08", "Pitch by the gyro alone", checks, (experiment.command(),))


def drift(run: Run) -> Array:
    """Return what the integrated gyro differs from the encoder's pitch, in degrees, 0 at the release."""
    difference = run.degrees("estimator.pitch_gyro") - np.degrees(encoder_pitch(run))
    return np.asarray(difference - difference[np.searchsorted(run.times, RELEASE)])
