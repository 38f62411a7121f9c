"""Fig 15: the motors' voltages with and without friction compensation."""

import numpy as np

from ..drawing import BLUE, BROAD, RED, label, legend, picture
from .checks import Check, Result
from .laboratory import Laboratory
from .stand import RELEASE, stand_up, stand_ups, voltage

WINDOW = (RELEASE, RELEASE + 3.0)
"""Interval in s in which the voltage is judged; later it grows with the speed of the accelerating robot."""


def run(laboratory: Laboratory) -> Result:
    """Stand up from 27° under the pitch-only law, with and without compensation."""
    runs = {c: stand_ups(laboratory, 27.0, c) for c in (True, False)}
    peaks = {c: [float(np.max(voltage(r.during(*WINDOW)))) for r in some] for c, some in runs.items()}
    ratios = [b / a for a, b in zip(peaks[True], peaks[False], strict=True)]
    top = [float(np.max(voltage(r))) for r in runs[False]]
    checks = (
        Check("Fig 15", "the control voltage with compensation", "peak in 3 s, 27°", peaks[True], 3.0, 3.9, "V",
              "prototype 3.0–3.8 V"),
        Check("Fig 15", "the control voltage without compensation", "peak in 3 s, 27°", peaks[False], 4.8, 7.0, "V",
              "prototype 4.8–7.0 V"),
        Check("Fig 15", "compensation takes less voltage", "peak without over peak with", ratios, 1.3, 2.2, "",
              "prototype's ranges", min(ratios) > 1.0,
              "", "without it the robot leans more, accelerates more and needs the voltage for its back-EMF"),
        Check("Fig 15", "the supply is enough", "peak in 5 s without compensation", top, 0.0, 12.0, "V",
              "12 V supply; it grows with the speed", max(top) < 12.0),
    )  # fmt: skip
    with picture(laboratory.out / "fig15.png", "Fig 15: motor voltages, standing up from 27°", (2.4, 2.4)) as rows:
        for axes, side in zip(rows, ("left", "right"), strict=True):
            for compensation, colour, words in (
                (False, RED, "without compensation"),
                (True, BLUE, "with compensation"),
            ):
                first = runs[compensation][0]
                axes.plot(
                    first.times - RELEASE,
                    first[f"controller.{side}.voltage"],
                    color=colour,
                    label=words,
                    **{**BROAD, "linewidth": 1.2},
                )
            axes.set_title(f"{side} motor")
            axes.set_xlim(-0.2, 5.0)
            label(axes, "voltage [V]", "time after the release [s]")
            legend(axes)
    return Result("fig15", "Motor voltages", checks, [stand_up(27.0, c).command() for c in (True, False)])
