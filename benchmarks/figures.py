"""The picture of docs/performance.md."""

import re
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

COLOURS = ("#009e73", "#0072b2", "#d55e00", "#888888")


def draw(data: dict[str, Any], path: Path) -> None:
    """Draw bars of both contests, growth and work-precision into `path`."""
    figure = Figure(figsize=(12.0, 9.0), layout="constrained")
    panels = figure.subplots(3, 2, height_ratios=(1.25, 1.0, 1.0))
    for axes, (key, title) in zip(
        panels[0], (("robot", "The robot, six FMUs in Python"), ("chain", "A chain of six small C FMUs")), strict=True
    ):
        _bars(axes, data[key], title)
    for axes, (title, (sizes, costs)) in zip(panels.flat[2:5], data["growth"].items(), strict=True):
        axes.loglog(sizes, costs, "o-", color=COLOURS[1])
        subject, logging, unit = re.fullmatch(r"(.+), (with.* log) \[(.+)\]", title).groups()  # type: ignore[union-attr]
        axes.set_title(f"Growth: {subject}, {logging}", fontsize=10)
        axes.set_xlabel(f"{subject} [s]" if "time" in subject else subject)
        axes.set_ylabel("wall time [s]" if unit == "s" else unit)
        _plain_numbers(axes)
    axes = panels[2, 1]
    for (label, points), colour in zip(data["precision"].items(), ("#d55e00", "#0072b2", "#009e73"), strict=True):
        axes.loglog(
            [1e-3 * cost for cost, _ in points], [error for _, error in points], "o-", color=colour, label=label
        )
    axes.set_title("Work-precision, stand-up with a turn", fontsize=10)
    axes.set_xlabel("wall time per simulated second [ms]")
    axes.set_ylabel("pitch error [°]")
    axes.legend(fontsize=8)
    _plain_numbers(axes)
    figure.savefig(path, dpi=110)


def _plain_numbers(axes: Axes) -> None:
    """Label 1, 2, 5, 10, … on both logarithmic axes, and nothing between."""
    for axis in (axes.xaxis, axes.yaxis):
        first, last = sorted(axis.get_view_interval())
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if last < 200.0 * first else (1.0,)))
        axis.set_major_formatter(FuncFormatter(lambda number, _: f"{number:g}"))
        axis.set_minor_formatter(NullFormatter())
    axes.grid(alpha=0.3)


def _bars(axes: Axes, made: Any, title: str) -> None:
    """Draw what a step costs, with log where there is one."""
    shown = {c.name: c for c in made if not c.trouble and c.logging}
    shown |= {c.name: c for c in made if not c.trouble and c.name not in shown}
    ordered = sorted(shown.values(), key=lambda c: -c.median)
    for i, c in enumerate(ordered):
        first, last = c.spread
        colour = COLOURS[3] if "floor" in c.name else COLOURS[0] if "twip" in c.name else COLOURS[1]
        axes.barh(i, 1e6 * c.median, color=colour)
        axes.plot([1e6 * first, 1e6 * last], [i, i], color="black", linewidth=1)
        axes.text(1e6 * last * 1.15, i, f"{1e6 * c.median:.3g}", va="center", fontsize=8)
    axes.set_yticks(range(len(ordered)), [c.name + ("" if c.logging else " (no log)") for c in ordered], fontsize=8)
    axes.set_xscale("log")
    axes.set_xlim(right=1e6 * ordered[0].median * 6)
    axes.set_xlabel("µs per step of 1 ms, with log")
    axes.set_title(title, fontsize=10)
    axes.grid(axis="x", alpha=0.3)
