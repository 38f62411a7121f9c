"""Plots of logs for papers: the panels of a log below each other, as PNG, SVG or PDF."""

from collections.abc import Sequence
from math import degrees
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from ..cosim import Playback, as_names
from ..errors import TwipError
from .drawing import label, legend, look, picture
from .endings import check_ending
from .metrics import is_robot
from .numbers import Array
from .panels import Panel, panels
from .report.page import short_names
from .report.samples import thinned, thinned_times

FORMATS = (".png", ".svg", ".pdf")
MOST_POINTS = 4000
"""Points of a line; of more rows the smallest and largest value of groups are drawn."""
WIDTH, HEIGHT = 7.0, 1.5
"""Of one panel, in inches."""


def plot(
    logs: Playback | Sequence[Playback], path: Path, names: str | Sequence[str] = (), in_degrees: bool = False
) -> Path:
    """Draw a log, or several laid over each other, to `path`, and return it.

    Without `names` (signals; `*` and `?` stand for any text and letter) the usual panels are drawn; with them, those
    signals in the log's units, or with rad `in_degrees`. Raises TwipError for a name that matches nothing, a log
    without rows, another format than `FORMATS` and a file that cannot be written.
    """
    check_ending(path, FORMATS)
    logs, names = [logs] if isinstance(logs, Playback) else logs, as_names("names", names)
    if empty := [str(log.path) for log in logs if not len(log.times)]:
        raise TwipError(f"log {name!r} has no rows to plot" for name in empty)
    drawn = [[_shown(panel, in_degrees) for panel in panels(log, names)] for log in logs]
    titles = list(dict.fromkeys((panel.title, panel.unit) for of_log in drawn for panel in of_log))
    labels = short_names([log.path for log in logs])
    beside = len(logs) > 1 or bool(names) or not all(is_robot(list(log.signals)) for log in logs)
    with picture(path, " and ".join(labels), [HEIGHT] * len(titles), WIDTH) as rows:
        for axes, key in zip(rows, titles, strict=True):
            for number, (log, of_log) in enumerate(zip(logs, drawn, strict=True)):
                for panel in of_log:
                    if (panel.title, panel.unit) == key:
                        draw(axes, log.times, panel, number, labels)
            finish(axes, *key, last=axes is rows[-1], beside=beside)
            axes.set_xlim(min(log.times[0] for log in logs), max(log.times[-1] for log in logs))
    return path


def draw(axes: Axes, times: Array, panel: Panel, log: int = 0, logs: Sequence[str] = ("",)) -> None:
    """Draw the lines of a panel, that of number `log` of `logs`."""
    group = -(-2 * len(times) // MOST_POINTS)
    across = thinned_times(times, group) if group > 1 else times
    for position, line in enumerate(panel.lines):
        if line.role == "reference" and not np.any(line.values):
            continue  # nothing was asked for
        looks = look(line.role, position, log, len(logs))
        if line.role == "limit" and log:
            continue
        axes.plot(
            across,
            thinned(line.values, group) if group > 1 else line.values,
            color=looks.color,
            linewidth=looks.width,
            alpha=looks.alpha,
            linestyle=(0, looks.dash) if looks.dash else "-",
            label=line.label if len(logs) == 1 or line.role == "limit" else f"{line.label}, {logs[log]}",
        )


def finish(axes: Axes, title: str, unit: str, last: bool, beside: bool = False) -> None:
    """Name the axes, and put the legend above or `beside` them."""
    axes.set_title(title)
    label(axes, f"[{unit}]" if unit else "", "time [s]" if last else None)
    axes.margins(y=0.08)
    axes.locator_params(axis="y", nbins=5)
    handles = axes.get_legend_handles_labels()[1]
    if beside:
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.05), fontsize=8, handlelength=1.2)
    elif len(handles) > 1:
        legend(axes)


def _shown(panel: Panel, in_degrees: bool) -> Panel:
    """Return a panel with rad as degrees, if they are wanted."""
    units = {"rad": "°", "rad/s": "°/s", "rad/s2": "°/s²"}
    if not in_degrees or panel.unit not in units:
        return panel
    lines = [type(line)(line.label, line.role, degrees(1.0) * line.values, line.source) for line in panel.lines]
    return Panel(panel.title, units[panel.unit], tuple(lines))
