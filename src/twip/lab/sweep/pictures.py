"""The pictures of a sweep: a map over two axes, the success rate along one, and the ranking of the axes."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.patches import Rectangle

from ...errors import TwipError
from ..drawing import BLUE, GREY, INK, ORANGE, PALETTE, picture
from .classes import Classes, cell_counts, cell_means, groups
from .known import SUCCESS, Known, refuse
from .parquet import Results
from .statistics import CONFIDENCE, Array, Influence, Rate, rank_regression, sobol_indices

_COLOURS = (*PALETTE, INK)
FAILS, BETWEEN, PASSES = "#d55e00", "#f6e8c3", "#0072b2"
"""Colours of a share that passes: of 0, 1/2 and 1. Vermilion and blue stay apart for everybody's eyes."""
NO_RUN, NO_NUMBER = ("////", "no run"), ("....", "no finite number")
"""Hatches of cells that have no colour, and what they mean."""
_PASSES = LinearSegmentedColormap.from_list("passes", (FAILS, BETWEEN, PASSES))


def draw_map(results: Results, x: str, y: str, what: str, path: Path, title: str = "") -> None:
    """Draw `what` (a metric, or `success`: the share of runs that pass) over two axes, one panel per parameter set.

    What other axes and repetitions vary is averaged; a cell without a finite number stays empty. Raises `TwipError` for
    unknown columns and where the picture cannot be written.
    """
    known = Known.of_results(results)
    refuse([*known.axis_problems((x, y)), *known.metric_problems(what)])
    across, down = Classes(results, x), Classes(results, y)
    values = results.numbers(what)
    panels = list(groups(results, {x, y}))
    cells = [cell_means(values, chosen, across, down) for _, chosen in panels]
    shown = np.concatenate([c[np.isfinite(c)] for c in cells])
    if not shown.size:
        raise TwipError(f"{what} is finite in no run")
    low, high = (0.0, 1.0) if what == SUCCESS else (float(np.min(shown)), float(np.max(shown)))
    width = 1.9 + 3.6 * len(panels)
    named = "Share that passes" if what == SUCCESS else what
    with picture(path, title or f"{named} over {x} and {y}", [3.8], width, len(panels)) as given:
        grid = given if len(panels) == 1 else list(given[0])
        empty: dict[str, Artist] = {}
        for (label, chosen), means, axes in zip(panels, cells, grid, strict=True):
            image = axes.pcolormesh(
                np.ma.masked_invalid(means), cmap=_PASSES if what == SUCCESS else "viridis", vmin=low, vmax=high,
                edgecolors="white", linewidth=0.5,
            )  # fmt: skip
            counts = cell_counts(chosen, across, down)
            for row, column in np.argwhere(~np.isfinite(means)):
                hatch, meaning = NO_NUMBER if counts[row, column] else NO_RUN
                cell = Rectangle((column, row), 1.0, 1.0, linewidth=0.0, hatch=hatch, label=meaning)
                cell.set(facecolor="white", edgecolor=GREY)
                empty[meaning] = axes.add_patch(cell)
            axes.set_title(label)
            across.label(axes.xaxis)
            down.label(axes.yaxis)
        figure = grid[0].figure
        figure.colorbar(image, ax=grid, label="share that passes" if what == SUCCESS else results.titled(what))
        if empty:
            figure.legend(handles=list(empty.values()), loc="outside lower right", ncols=2, frameon=False)


def draw_rate(results: Results, along: Sequence[str], path: Path, title: str = "") -> None:
    """Draw the success rate with its interval along each of some axes, one line per parameter set.

    Raises `TwipError` for unknown columns, a sweep without conditions, and where the picture cannot be written.
    """
    known = Known.of_results(results)
    refuse([*known.axis_problems(along), *known.metric_problems(SUCCESS)])
    success = results.numbers("success")
    with picture(path, title or f"Success rate over {', '.join(along)}", [2.6] * len(along), width=7.0) as panels:
        for x, axes in zip(along, panels, strict=True):
            classes = Classes(results, x)
            for (label, chosen), colour in zip(groups(results, {x}), _cycle(), strict=False):
                rates = [_rate(success[chosen & (classes.index == i)]) for i in range(classes.count)]
                _line(axes, [i + 0.5 for i in range(classes.count)], rates, colour, label)
            classes.label(axes.xaxis)
            axes.set(xlim=(0.0, classes.count), ylim=(-0.03, 1.03))
            axes.set_ylabel(f"share that passes, {CONFIDENCE:.0%} interval")
        if "parameters" in results.columns and along[0] != "parameters":
            panels[0].legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=4)


def draw_sensitivity(results: Results, metric: str, path: Path, title: str = "") -> list[str]:
    """Draw how much the metric depends on each axis, and return the lines that say it in words. Raises `TwipError`."""
    refuse(Known.of_results(results).ranking_problems(metric))
    if results.description["design"] == "indices":
        first, total = sobol_indices(results, metric)
        bars = [("with interactions", BLUE, total), ("alone", ORANGE, first)]
        label = f"share of the variance of {metric}"
        lines = [
            f"{t.axis}: {f.value:.2f} alone, {t.value:.2f} with interactions ({t.low:.2f} to {t.high:.2f})"
            for f, t in sorted(zip(first, total, strict=True), key=lambda pair: -pair[1].value)
        ]
    else:
        ranked, explained = rank_regression(results, metric)
        bars = [("", BLUE, ranked)]
        label = f"rank regression coefficient of {metric}, R² = {explained:.2f}"
        lines = [f"{i.axis}: {i.value:+.2f} ({i.low:+.2f} to {i.high:+.2f})" for i in ranked]
        lines.append(f"R² of the ranks: {explained:.2f}")
    order = [i.axis for i in sorted(bars[0][2], key=lambda i: abs(i.value))]
    with picture(path, title or f"What {metric} depends on", [0.5 + 0.35 * len(order) * len(bars)], width=7.0) as (
        axes,
    ):
        for n, (name, colour, influences) in enumerate(bars):
            _bars(axes, influences, order, (n + 0.5) / len(bars) - 0.5, 0.8 / len(bars), colour, name)
        axes.axvline(0.0, color=GREY, linewidth=0.8)
        axes.set_yticks(range(len(order)), order)
        axes.set_xlabel(f"{label}, {CONFIDENCE:.0%} interval")
        if len(bars) > 1:
            axes.legend(loc="lower right")
    return lines


def _rate(success: Array) -> Rate:
    return Rate(int(np.sum(success > 0.5)), len(success))


def _bars(
    axes: Axes, found: Sequence[Influence], order: list[str], shift: float, height: float, colour: str, name: str
) -> None:
    places = [order.index(i.axis) - shift for i in found]
    values = [i.value for i in found]
    errors = [[max(0.0, i.value - i.low) for i in found], [max(0.0, i.high - i.value) for i in found]]
    axes.barh(places, values, height, color=colour, alpha=0.75, label=name or None)
    axes.errorbar(values, places, xerr=errors, fmt="none", ecolor=INK, elinewidth=1.0, capsize=2.5)


def _line(axes: Axes, places: list[float], rates: list[Rate], colour: str, label: str) -> None:
    shown = [(p, r) for p, r in zip(places, rates, strict=True) if r.runs]
    shares = [r.share for _, r in shown]
    low = [r.share - r.interval[0] for _, r in shown]
    high = [r.interval[1] - r.share for _, r in shown]
    axes.errorbar(
        [p for p, _ in shown], shares, yerr=[low, high], color=colour, label=label, marker="o", markersize=4,
        capsize=3, linewidth=1.4,
    )  # fmt: skip


def _cycle() -> Iterator[str]:
    while True:
        yield from _COLOURS
