"""The moving robot as an animated picture (GIF, WebP or APNG) for pages that show pictures only."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from ..cosim import Playback
from ..errors import TwipError
from ..outputs import replacing
from .drawing import GREY, INK, ORANGE, PALETTE, RED, STYLE, robot
from .endings import check_ending
from .metrics import is_robot
from .numbers import Array
from .report.page import short_names

FORMATS = (".gif", ".webp", ".png")
LAST = 1.0
"""How long the last frame stays, in s."""
SIZE = (6.4, 3.2)
"""In inches, at 100 dots each."""
COLOURS = 128
APART = 0.25
"""Between the robots of several logs, in m: one that stands hides no other."""


def animate(
    logs: Sequence[Playback],
    path: Path,
    start: float | None,
    stop: float | None,
    rate: float = 20.0,
    speed: float = 1.0,
    apart: float = APART,
) -> Path:
    """Draw the robots of logs from `start` to `stop` (s; None: the logs') at `rate` frames per s, and return the path.

    Several robots have colours, and stand `apart` m from each other beside where they are. Raises TwipError when one is
    not the robot's log, there is nothing between the times, or the file cannot be written.
    """
    check_ending(path, FORMATS)
    if wrong := [str(log.path) for log in logs if not is_robot(list(log.signals)) or not len(log.times)]:
        raise TwipError(f"log {name!r} does not show the robot" for name in wrong)
    begin, end = min(float(log.times[0]) for log in logs), max(float(log.times[-1]) for log in logs)
    first, last = begin if start is None else max(start, begin), end if stop is None else min(stop, end)
    if not (last > first and rate > 0.0 and speed > 0.0):
        raise TwipError(f"{path}: from {first:g} s to {last:g} s at {rate:g} frames per s there is nothing to draw")
    times: Array = np.asarray(first + np.arange(round((last - first) * rate / speed) + 1) * speed / rate, np.float64)
    frames = list(_frames(logs, times, apart if len(logs) > 1 else 0.0))
    palette = frames[0].quantize(COLOURS)
    pictures = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    shown = [round(1000.0 / rate)] * (len(pictures) - 1) + [round(1000.0 * LAST)]
    if path.suffix.lower() != ".gif":
        pictures = [picture.convert("RGB") for picture in pictures]
    with replacing(path) as stream:
        pictures[0].save(
            stream,
            format=Image.registered_extensions()[path.suffix.lower()],
            save_all=True,
            append_images=pictures[1:],
            duration=shown,
            loop=0,
            optimize=True,
            lossless=True,
        )
    return path


@dataclass(frozen=True)
class Shown:
    """A robot at the times of the frames; nan where its log has no rows."""

    pitch: Array
    x: Array
    wheel: Array
    push: Array
    color: str | None
    """None where it is alone."""


def _shown(log: Playback, times: Array, place: float, color: str | None) -> Shown:
    """Return a log's robot, `place` m from where it is."""
    pitch, x, wheel, push = (
        np.interp(times, log.times, log[f"plant.{name}"], left=np.nan, right=np.nan)
        for name in ("pitch", "x", "wheel_angle", "push_force")
    )
    return Shown(pitch, x + place, wheel, push, color)


def _frames(logs: Sequence[Playback], times: Array, apart: float) -> Iterator[Image.Image]:
    """Yield the pictures: the robots on their way above, the pitch so far below."""
    several = len(logs) > 1
    robots = [
        _shown(log, times, (i - (len(logs) - 1) / 2) * apart, PALETTE[i % len(PALETTE)] if several else None)
        for i, log in enumerate(logs)
    ]
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=SIZE, dpi=100, facecolor="white")
        canvas = FigureCanvasAgg(figure)
        scene, plot = figure.add_axes((0.02, 0.46, 0.96, 0.52)), figure.add_axes((0.09, 0.14, 0.88, 0.28))
        low, high = min(np.nanmin(robot.x) for robot in robots), max(np.nanmax(robot.x) for robot in robots)
        middle, reach = 0.5 * float(low + high), max(0.62, 0.5 * float(high - low) + 0.25)
        scene.set(xlim=(middle - reach, middle + reach), aspect="equal", ylim=(-0.03, 0.34 if several else 0.29))
        scene.axis("off")
        scene.axhline(0.0, color=GREY, linewidth=1.2)
        for mark in np.arange(np.floor(10.0 * (middle - 2.0 * reach)), 10.0 * (middle + 2.0 * reach)) / 10.0:
            scene.plot([mark, mark - 0.008], [0.0, -0.014], color=GREY, linewidth=0.8)
        lines = []
        for one, name in zip(robots, short_names([log.path for log in logs]), strict=True):
            plot.plot(
                times, np.degrees(one.pitch), color=one.color or "#d5d5d5", linewidth=1.4, alpha=0.3 if several else 1
            )
            (line,) = plot.plot([], [], color=one.color or INK, linewidth=1.8, label=name)
            (dot,) = plot.plot([], [], "o", color=one.color or RED, markersize=4)
            lines.append((line, dot))
        if several:
            scene.legend(handles=[line for line, _ in lines], loc="upper right", ncols=len(lines), fontsize=8)
        plot.axhline(0.0, color=GREY, linewidth=0.5)
        plot.set(xlim=(times[0], times[-1]), ylabel="pitch [°]", xlabel="time [s]")
        plot.margins(y=0.12)
        label = scene.text(0.01, 0.97, "", transform=scene.transAxes, va="top", fontsize=10, color=INK)
        for i, time in enumerate(times):
            drawn: list[Artist] = []
            for one, (line, dot) in zip(robots, lines, strict=True):
                line.set_data(times[: i + 1], np.degrees(one.pitch[: i + 1]))
                dot.set_data([time], [np.degrees(one.pitch[i])])
                if np.isfinite(one.pitch[i]):
                    drawn += _robot(scene, one, i)
            alone = f"   {np.degrees(robots[0].pitch[i]):.1f}°" if not several else ""
            label.set_text(f"{time:.2f} s{alone}")
            canvas.draw()  # type: ignore[no-untyped-call]
            pixels = np.asarray(canvas.buffer_rgba())  # type: ignore[no-untyped-call]
            yield Image.fromarray(pixels).convert("RGB")
            for artist in drawn:
                artist.remove()


def _robot(scene: Axes, one: Shown, frame: int) -> list[Artist]:
    """Draw a robot and the push on it in a frame, and return what was drawn."""
    x, push = float(one.x[frame]), float(one.push[frame])
    drawn = robot(scene, x, float(one.pitch[frame]), float(one.wheel[frame]), one.color)
    if push:
        tail = x - np.sign(push) * 0.2
        style = {"arrowstyle": "->", "color": one.color or ORANGE, "linewidth": 2.0}
        drawn.append(scene.annotate("", (tail + np.sign(push) * 0.13, 0.2), (tail, 0.2), arrowprops=style))
    return drawn
