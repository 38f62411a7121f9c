"""Fig 11: pitch by the Kalman filter from gyro and corrected accelerometer."""

import numpy as np

from ..drawing import RED, THIN, label, picture
from .checks import Check, Result
from .laboratory import Laboratory
from .swing import FAST, SLOW, STOP, draw_estimates, encoder_pitch, swings


def run(laboratory: Laboratory) -> Result:
    """Swing the body with the wheels locked: slowly, then fast."""
    swung = swings(laboratory)
    slow, fast = swung.errors("pitch", SLOW), swung.errors("pitch", FAST)
    checks = (
        Check("Fig 11", "the Kalman filter obtains the pitch precisely", "rms error, 0.2 Hz, 20°",
              slow, 0.2, 0.6, "°", "prototype 0.51°, all in all; the biases alone make 0.29°", max(slow) < 1.0),
        Check("Fig 11", "… even when the pitch changes very quickly", "rms error, 3 Hz, 12°",
              fast, 0.3, 0.6, "°", "prototype 0.51°", max(fast) < 1.0),
    )  # fmt: skip
    first = swung.runs[0]
    with picture(laboratory.out / "fig11.png", "Fig 11: pitch by the Kalman filter", (2.6, 1.4, 2.2)) as (
        top,
        low,
        zoom,
    ):
        for axes in (top, zoom):
            draw_estimates(axes, first, ("pitch", "Kalman filter", RED, "-"))
        difference = first.degrees("estimator.pitch") - np.degrees(encoder_pitch(first))
        low.plot(first.times, difference, color=RED, **THIN)
        label(low, "error [°]")
        low.set_ylim(-2.0, 2.0)
        for axes in (top, low):
            axes.set_xlim(0.0, STOP)
        zoom.set_xlim(FAST[0], FAST[0] + 2.0)
        zoom.set_title("the fast motion, enlarged")
    return Result("fig11", "Kalman filter", checks, (swung.experiment.command(),))
