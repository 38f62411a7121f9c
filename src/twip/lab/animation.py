"""The moving robot as an animated picture (GIF, WebP or APNG) for pages that show pictures only."""

from collections.abc import Iterator
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from ..cosim.playback import Playback
from ..errors import TwipError
from .drawing import GREY, INK, ORANGE, RED, STYLE, robot
from .endings import check_ending
from .metrics import is_robot

FORMATS = (".gif", ".webp", ".png")
LAST = 1.0
"""How long the last frame stays, in s."""
SIZE = (6.4, 3.2)
"""In inches, at 100 dots each."""
COLOURS = 128


def animate(
    log: Playback, path: Path, start: float | None, stop: float | None, rate: float = 20.0, speed: float = 1.0
) -> Path:
    """Draw the robot of a log from `start` to `stop` (s; None: the log's) at `rate` frames per s, and return the path.

    Raises TwipError when it is not the robot's log, there is nothing between the times, or the file cannot be written.
    """
    check_ending(path, FORMATS)
    if not is_robot(list(log.signals)) or not len(log.times):
        raise TwipError(f"log {str(log.path)!r} does not show the robot")
    first, last = (
        float(log.times[0] if start is None else max(start, log.times[0])),
        float(log.times[-1] if stop is None else min(stop, log.times[-1])),
    )
    if not (last > first and rate > 0.0 and speed > 0.0):
        raise TwipError(f"{path}: from {first:g} s to {last:g} s at {rate:g} frames per s there is nothing to draw")
    times = first + np.arange(round((last - first) * rate / speed) + 1) * speed / rate
    frames = list(_frames(log, times))
    palette = frames[0].quantize(COLOURS)
    pictures = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    shown = [round(1000.0 / rate)] * (len(pictures) - 1) + [round(1000.0 * LAST)]
    if path.suffix.lower() != ".gif":
        pictures = [picture.convert("RGB") for picture in pictures]
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        pictures[0].save(
            path, save_all=True, append_images=pictures[1:], duration=shown, loop=0, optimize=True, lossless=True
        )
    except OSError as error:
        raise TwipError(f"{path}: the picture cannot be written ({error.strerror})") from None
    return path


def _frames(log: Playback, times: np.ndarray) -> Iterator[Image.Image]:
    """Yield the pictures: the robot on its way above, the pitch so far below."""
    pitch, x, wheel = (np.interp(times, log.times, log[f"plant.{name}"]) for name in ("pitch", "x", "wheel_angle"))
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=SIZE, dpi=100, facecolor="white")
        canvas = FigureCanvasAgg(figure)
        scene, plot = figure.add_axes((0.02, 0.46, 0.96, 0.52)), figure.add_axes((0.09, 0.14, 0.88, 0.28))
        middle = 0.5 * (float(np.min(x)) + float(np.max(x)))
        reach = max(0.62, 0.5 * float(np.ptp(x)) + 0.25)
        scene.set(xlim=(middle - reach, middle + reach), aspect="equal", ylim=(-0.03, 0.29))
        scene.axis("off")
        scene.axhline(0.0, color=GREY, linewidth=1.2)
        for mark in np.arange(np.floor(10.0 * (middle - 2.0 * reach)), 10.0 * (middle + 2.0 * reach)) / 10.0:
            scene.plot([mark, mark - 0.008], [0.0, -0.014], color=GREY, linewidth=0.8)
        degrees = np.degrees(pitch)
        plot.plot(times, degrees, color="#d5d5d5", linewidth=1.4)
        plot.axhline(0.0, color=GREY, linewidth=0.5)
        plot.set(xlim=(times[0], times[-1]), ylabel="pitch [°]", xlabel="time [s]")
        plot.margins(y=0.12)
        (line,) = plot.plot([], [], color=INK, linewidth=1.8)
        (dot,) = plot.plot([], [], "o", color=RED, markersize=4)
        label = scene.text(0.01, 0.97, "", transform=scene.transAxes, va="top", fontsize=10, color=INK)
        push = np.interp(times, log.times, log["plant.push_force"])
        for i, time in enumerate(times):
            drawn: list[Artist] = robot(scene, float(x[i]), float(pitch[i]), float(wheel[i]))
            if push[i]:
                tail = float(x[i]) - np.sign(push[i]) * 0.2
                style = {"arrowstyle": "->", "color": ORANGE, "linewidth": 2.0}
                drawn.append(scene.annotate("", (tail + np.sign(push[i]) * 0.13, 0.2), (tail, 0.2), arrowprops=style))
            line.set_data(times[: i + 1], degrees[: i + 1])
            dot.set_data([time], [degrees[i]])
            label.set_text(f"{time:.2f} s   {degrees[i]:.1f}°")
            canvas.draw()  # type: ignore[no-untyped-call]
            pixels = np.asarray(canvas.buffer_rgba())  # type: ignore[no-untyped-call]
            yield Image.fromarray(pixels).convert("RGB")
            for artist in drawn:
                artist.remove()
