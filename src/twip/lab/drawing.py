"""How the pictures look: the real quantity is a broad dark line, every estimate a thin coloured one."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon

from ..outputs import replacing

INK, GREY, BLUE, RED, ORANGE, GREEN = "#222222", "#9a9a9a", "#1f6fb4", "#d1495b", "#e08e2b", "#3a8f5c"
REAL: dict[str, Any] = {"color": INK, "linewidth": 2.4, "alpha": 0.85}
"""Line of a real quantity."""
THIN: dict[str, Any] = {"linewidth": 1.1}
"""Line of an estimate; it takes a colour of its own."""
BROAD: dict[str, Any] = {"linewidth": 1.8}
"""Line of one of several real quantities that are compared."""
WHEEL, HEIGHT, WIDTH = 0.05, 0.20, 0.07
"""Drawn sizes of the robot in m."""
PALETTE = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
"""Colours of lines that have no role, and of logs that are compared: blue, vermilion, green, purple, orange and sky
blue, which colour-blind people tell apart too (M. Okabe and K. Ito, Color Universal Design, 2008).
"""


@dataclass(frozen=True)
class Look:
    """How a line is drawn: width in points, dashes and gaps in line widths."""

    color: str
    width: float
    alpha: float = 1.0
    dash: tuple[float, ...] = ()


LOOKS = {
    "real": Look(INK, 3.0, 0.75),
    "estimate": Look(PALETTE[1], 1.1),
    "reference": Look(PALETTE[0], 1.3, 1.0, (5.0, 3.0)),
    "limit": Look(GREY, 1.0, 1.0, (2.0, 3.0)),
    "left": Look(PALETTE[0], 1.8),
    "right": Look(PALETTE[1], 1.1),
}
"""Looks of the roles of `panels.Line`; the role `other` takes the next colour of `PALETTE`."""
COMPARED = {
    "real": Look("", 1.8),
    "estimate": Look("", 1.0, 0.55),
    "reference": Look("", 1.2, 0.8, (5.0, 3.0)),
    "limit": Look(GREY, 1.0, 1.0, (2.0, 3.0)),
    "left": Look("", 1.5),
    "right": Look("", 1.2, 0.75, (4.0, 2.0)),
}
"""Looks where logs are compared: the colour is the log's."""
BESIDE, MOST_BESIDE = 1.1, 3.3
"""How much broader a line is than that of the next log, so that one shows beside the other where they coincide; at
most.
"""


def look(role: str, position: int, log: int, logs: int) -> Look:
    """Return how a line looks that is at `position` of its panel and from number `log` of so many logs."""
    if logs > 1:
        found = COMPARED.get(role, Look("", 1.3, 1.0, ((), (5.0, 2.0), (2.0, 2.0))[position % 3]))
        broader = 0.0 if found.dash or role == "estimate" else min(MOST_BESIDE, BESIDE * (logs - 1 - log))
        return replace(found, color=found.color or PALETTE[log % len(PALETTE)], width=found.width + broader)
    return LOOKS.get(role, Look(PALETTE[position % len(PALETTE)], 1.3))


UNDATED = {".png": {"Software": None}, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}}
"""What a format would write about time and place; the same picture has the same bytes."""
STYLE: dict[Any, Any] = {
    "svg.hashsalt": "twip",
    "svg.fonttype": "none",
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": GREY,
    "axes.titlesize": 9.5,
    "axes.titlelocation": "left",
    "legend.frameon": False,
    "legend.handlelength": 1.6,
    "legend.columnspacing": 1.4,
}


@contextmanager
def picture(path: Path, title: str, heights: Sequence[float], width: float = 9.0, columns: int = 1) -> Iterator[Any]:
    """Give the axes of a picture with rows of these `heights` in inches, and write it at the end, as its ending says.

    With one column a list of axes, with more an array (rows, columns). Raises TwipError when it cannot be written.
    """
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(width, sum(heights) + 0.5), layout="constrained")
        figure.get_layout_engine().set(hspace=0.06, wspace=0.06)  # type: ignore[union-attr, call-arg]
        axes = figure.subplots(len(heights), columns, height_ratios=list(heights), squeeze=False)
        figure.suptitle(title, x=0.01, ha="left", fontsize=11, color=INK)
        yield list(axes[:, 0]) if columns == 1 else axes
        ending = path.suffix.lower()
        with replacing(path) as stream:
            figure.savefig(stream, format=ending[1:], dpi=130, metadata=UNDATED.get(ending))


def legend(axes: Axes, columns: int = 5) -> None:
    """Put the legend above the axes, where it hides no data."""
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 0.98), ncols=columns, borderaxespad=0.2)


def label(axes: Axes, vertical: str, horizontal: str | None = "time [s]") -> None:
    """Name both axes, and draw the line of zero."""
    axes.set_ylabel(vertical)
    if horizontal is not None:
        axes.set_xlabel(horizontal)
    axes.axhline(0.0, color=GREY, linewidth=0.5, zorder=0)


def robot(
    axes: Axes, centre: float, pitch: float, turned_by: float | None = None, color: str | None = None
) -> list[Artist]:
    """Draw the robot with its axle at `centre` m, seen from its right so that forward is to the right; pitch in rad.

    The wheel gets spokes `turned_by` an angle in rad, if one is given. One of several robots has a `color`, through
    which the others show. Returns what was drawn.
    """
    edge, rim = (BLUE, INK) if color is None else (color, color)
    body, wheel = ("#dfe9f3", "white") if color is None else (to_rgba(color, 0.2), (1.0, 1.0, 1.0, 0.5))
    sine, cosine = np.sin(pitch), np.cos(pitch)
    corners = np.array([(-0.5, 0.1), (0.5, 0.1), (0.5, 1.0), (-0.5, 1.0)]) * (WIDTH, HEIGHT)
    turned = corners @ np.array([(cosine, -sine), (sine, cosine)]) + (centre, WHEEL)
    drawn: list[Artist] = [
        axes.add_patch(Polygon(turned, closed=True, facecolor=body, edgecolor=edge, linewidth=1.2, zorder=2)),
        axes.add_patch(Circle((centre, WHEEL), WHEEL, facecolor=wheel, edgecolor=rim, linewidth=1.6, zorder=3)),
        axes.add_patch(Circle((centre, WHEEL), 0.006, facecolor=INK, zorder=4)),
    ]
    for angle in () if turned_by is None else (turned_by + k * np.pi / 3.0 for k in range(3)):
        along = 0.86 * WHEEL * np.array([np.cos(angle), -np.sin(angle)])
        x, y = np.array([centre, WHEEL])[:, None] + np.stack([along, -along], axis=1)
        drawn += axes.plot(x, y, color=GREY, linewidth=0.8, zorder=3)
    return drawn
