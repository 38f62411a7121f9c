"""The pictures of a sweep: a map over two axes, the success rate along one, and the ranking of the axes."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap

from ...errors import TwipError
from ..drawing import BLUE, GREEN, GREY, INK, ORANGE, RED, picture
from .classes import Classes, cell_means, groups
from .parquet import Results
from .statistics import CONFIDENCE, Array, Influence, Rate, rank_regression, sobol_indices

_COLOURS = (BLUE, RED, GREEN, ORANGE, INK, GREY)
_PASSES = ListedColormap(
    [tuple(np.array((0.82, 0.29, 0.36)) * (1 - s) + np.array((0.82, 0.91, 0.96)) * s) for s in np.linspace(0, 1, 64)]
)


def draw_map(results: Results, x: str, y: str, what: str, path: Path, title: str = "") -> None:
    """Draw `what` (a metric, or `success`: the share of runs that pass) over two axes, one panel per parameter set.

    What other axes and repetitions vary is averaged; a cell without a finite number stays empty. Raises `TwipError` for
    unknown columns and where the picture cannot be written.
    """
    _check_axes(results, (x, y))
    _check_judged(results, what)
    across, down = Classes(results, x), Classes(results, y)
    values = results.numbers(what)
    panels = list(groups(results, {x, y}))
    cells = [cell_means(values, chosen, across, down) for _, chosen in panels]
    shown = np.concatenate([c[np.isfinite(c)] for c in cells])
    if not shown.size:
        raise TwipError(f"{what} is finite in no run")
    low, high = (0.0, 1.0) if what == "success" else (float(np.min(shown)), float(np.max(shown)))
    width = 1.6 + 3.4 * len(panels)
    with picture(path, title or f"{what} over {x} and {y}", [3.4], width, len(panels)) as given:
        grid = given if len(panels) == 1 else list(given[0])
        for (label, _), means, axes in zip(panels, cells, grid, strict=True):
            image = axes.pcolormesh(
                np.ma.masked_invalid(means), cmap=_PASSES if what == "success" else "viridis", vmin=low, vmax=high,
                edgecolors="white", linewidth=0.5,
            )  # fmt: skip
            axes.set_title(label)
            across.label(axes.xaxis)
            down.label(axes.yaxis)
        grid[0].figure.colorbar(image, ax=grid, label="share that passes" if what == "success" else what)


def draw_rate(results: Results, along: Sequence[str], path: Path, title: str = "") -> None:
    """Draw the success rate with its interval along each of some axes, one line per parameter set.

    Raises `TwipError` for unknown columns, a sweep without conditions, and where the picture cannot be written.
    """
    _check_axes(results, along)
    _check_judged(results, "success")
    success = results.numbers("success")
    with picture(path, title or f"Success rate over {', '.join(along)}", [2.6] * len(along), width=7.0) as panels:
        for x, axes in zip(along, panels, strict=True):
            classes = Classes(results, x)
            for (label, chosen), colour in zip(groups(results, {x}), _cycle(), strict=False):
                rates = [_rate(success[chosen & (classes.index == i)]) for i in range(classes.count)]
                _line(axes, [i + 0.5 for i in range(classes.count)], rates, colour, label)
            classes.label(axes.xaxis)
            axes.set(xlim=(0.0, classes.count), ylim=(-0.03, 1.03))
            axes.set_ylabel(f"share that passes, {CONFIDENCE:.0%}")
        if "parameters" in results.columns and along[0] != "parameters":
            panels[0].legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=4)


def draw_sensitivity(results: Results, metric: str, path: Path, title: str = "") -> list[str]:
    """Draw how much the metric depends on each axis, and return the lines that say it in words. Raises `TwipError`."""
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


def _check_axes(results: Results, names: Sequence[str]) -> None:
    for name in names:
        if name not in results.axes:
            raise TwipError(f"{name} did not vary; there are {', '.join(results.axes)}")
    if len(set(names)) < len(names):
        raise TwipError(f"{', '.join(names)}: an axis is named twice")


def _check_judged(results: Results, what: str) -> None:
    if what == "success" and not results.judged:
        raise TwipError("the sweep has no conditions, so no run passes or fails")


def _cycle() -> Iterator[str]:
    while True:
        yield from _COLOURS
