"""The picture of a stand-up: the robot at a row of instants, pitch, voltages and position."""

from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..cosim.playback import Playback
from ..errors import TwipError
from .drawing import BLUE, GREY, INK, RED, robot

SNAPSHOTS = (-0.3, 0.05, 0.1, 0.15, 0.2, 0.3, 0.5, 1.0, 3.0)
"""Instants of the drawn robots, in s after the release."""


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
    """Draw the stand-up in `log`, released at `release` s, as a PNG at `path`.

    Raises TwipError when it cannot be written.
    """
    with mpl.rc_context({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False, "axes.edgecolor": GREY}):
        figure = Figure(figsize=(9, 8), layout="constrained")
        robots, pitch, voltage, position = figure.subplots(4, 1, height_ratios=[1.4, 2.2, 1.4, 1.2])
        pitch.sharex(position)
        voltage.sharex(position)
        start = np.degrees(log["plant.pitch"][0])
        robots.set_title(f"Standing up from {start:.0f}°, time after release", loc="left", fontsize=11)
        _snapshots(robots, log, release)
        pitch.plot(log.times, np.degrees(log["plant.pitch"]), color=BLUE, linewidth=1.8, label="pitch")
        pitch.plot(log.times, np.degrees(log["estimator.pitch"]), color=RED, linewidth=0.9, label="Kalman estimate")
        pitch.axhspan(-1, 1, color=BLUE, alpha=0.08, linewidth=0)
        pitch.set_ylabel("pitch [°]")
        voltage.plot(log.times, log["controller.left.voltage"], color=BLUE, linewidth=0.9, label="left")
        voltage.plot(log.times, log["controller.right.voltage"], color=RED, linewidth=0.9, label="right", alpha=0.8)
        voltage.set_ylabel("voltage [V]")
        position.plot(log.times, log["plant.x"], color=INK, linewidth=1.4, label="position")
        position.set_ylabel("position [m]")
        position.set_xlabel("time [s]")
        for axes in (pitch, voltage, position):
            axes.axvline(release, color=GREY, linewidth=0.8, linestyle=":")
            axes.axhline(0.0, color=GREY, linewidth=0.5)
            axes.set_xlim(log.times[0], log.times[-1])
            axes.margins(y=0.12)
            axes.legend(loc="best", frameon=False, ncols=2)
        top = (release, pitch.get_ylim()[1])
        pitch.annotate("released", top, xytext=(4, -10), textcoords="offset points", color=GREY)
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            figure.savefig(path, dpi=130)
        except OSError as error:
            raise TwipError(f"{path}: the picture cannot be written ({error.strerror})") from None
