"""The picture of a stand-up: the robot at a row of instants, pitch, voltages and place."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from ..cosim import Playback
from .drawing import BLUE, GREY, INK, picture, robot
from .panels import panels
from .plot import draw, finish

SNAPSHOTS = (-0.3, 0.05, 0.1, 0.15, 0.2, 0.3, 0.5, 1.0, 3.0)
"""Instants of the drawn robots, in s after the release."""
DRAWN = {"Pitch": 2.3, "Voltage": 1.6, "Place": 1.4}
"""Panels and their heights in inches."""


def _snapshots(axes: Axes, log: Playback, release: float) -> None:
    instants = [t for t in SNAPSHOTS if log.times[0] <= release + t <= log.times[-1]]
    pitch = np.interp([release + t for t in instants], log.times, log["plant.pitch"])
    for column, (instant, angle) in enumerate(zip(instants, pitch, strict=True)):
        centre = 0.33 * column
        robot(axes, centre, float(angle))
        label = "held" if instant < 0 else f"{instant:g} s"
        axes.text(centre, -0.03, f"{label}\n{np.degrees(angle):.1f}°", ha="center", va="top", fontsize=8, color=INK)
    axes.axhline(0.0, color=GREY, linewidth=1)
    axes.set(xlim=(-0.2, 0.33 * len(instants) - 0.13), ylim=(-0.13, 0.29), aspect="equal")
    axes.axis("off")


def stand_up_picture(log: Playback, release: float, path: Path) -> None:
    """Draw the stand-up in `log`, released at `release` s, to `path`; raises TwipError when it cannot be written."""
    chosen = [panel for panel in panels(log) if panel.title in DRAWN]
    title = f"Standing up from {np.degrees(log['plant.pitch'][0]):.0f}°, time after release"
    with picture(path, title, [1.3, *(DRAWN[panel.title] for panel in chosen)]) as (robots, *rows):
        _snapshots(robots, log, release)
        for axes, panel in zip(rows, chosen, strict=True):
            draw(axes, log.times, panel)
            finish(axes, panel.title, panel.unit, last=axes is rows[-1])
            axes.axvline(release, color=GREY, linewidth=0.8, linestyle=":")
            axes.set_xlim(log.times[0], log.times[-1])
        rows[0].axhspan(-1, 1, color=BLUE, alpha=0.08, linewidth=0)
        top = (release, rows[0].get_ylim()[1])
        rows[0].annotate("released", top, xytext=(4, -10), textcoords="offset points", color=GREY)
