"""The stability study as pictures and tables."""

from collections.abc import Callable, Sequence
from operator import attrgetter
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.patches import Patch, Rectangle

from ..cosim import Result
from ..fmi import build_all
from ..outputs import make_writable
from ..robot import value
from .drawing import BLUE, GREEN, GREY, INK, ORANGE, RED, label, legend, picture
from .stability import DRIFT_TIME, DRIFTS, LOOPS, RELEASE, Loop, Mismatch, Study, Trial, run, study

KINDS = (
    ("falls, or does not reach the surface; condition not met", "#e9a3a0"),
    ("falls although the condition is met", "#222222"),
    ("stands; condition not met", "#c6dbef"),
    ("stands; condition ε > c sup|Δ| met", "#4292c6"),
)
"""Kind and colour of a trial; its number is 2 `stands` + 1 `condition met`."""
COLOURS = (RED, ORANGE, GREEN, BLUE)
"""Of the long runs."""


def draw_map(axes: Axes, loop: Loop, mismatch: Mismatch, trials: Sequence[Trial]) -> None:
    """Draw one mismatch: a cell per factor and epsilon, with c sup|Delta| where the loop stands."""
    factors, epsilons = mismatch.factors, loop.epsilons
    kinds = np.zeros((len(epsilons), len(factors)))
    for trial in trials:
        row, column = epsilons.index(trial.epsilon), factors.index(trial.factor)
        kinds[row, column] = 2 * trial.stands + trial.meets()
        if trial.stands:
            colour = "white" if trial.meets() else INK
            axes.text(column, row, f"{trial.disturbance:.0f}", ha="center", va="center", fontsize=7, color=colour)
    palette = ListedColormap([colour for _, colour in KINDS])
    axes.imshow(kinds, origin="lower", aspect="auto", cmap=palette, vmin=-0.5, vmax=3.5)
    axes.set_xticks(range(len(factors)), [f"{f:g}" for f in factors])
    axes.set_yticks(range(len(epsilons)), [f"{e:g}" for e in epsilons])
    axes.set_xticks(np.arange(len(factors) - 1) + 0.5, minor=True)
    axes.set_yticks(np.arange(len(epsilons) - 1) + 0.5, minor=True)
    axes.grid(which="minor", color="white", linewidth=1.2)
    axes.tick_params(which="both", length=0)
    for side in axes.spines.values():
        side.set_visible(False)
    nominal = epsilons.index(value(loop.epsilon)), factors.index(1.0)
    axes.add_patch(Rectangle((nominal[1] - 0.5, nominal[0] - 0.5), 1, 1, fill=False, edgecolor=INK, lw=2))
    axes.set_title(f"{loop.name}: {mismatch.title}")
    axes.set_xlabel("robot over the controller's model [1]")
    axes.set_ylabel(f"{'ε₁' if loop.epsilon == 'epsilon1' else 'ε₂'} [rad/s²]")


def map_picture(found: Study, path: Path) -> None:
    """Draw all mismatches as a PNG at `path`; raises TwipError when it cannot be written."""
    title = (
        "Where the sliding-mode loops stand on a robot that differs from their model\n"
        "numbers: c sup|Δ| of the run in rad/s²; frame: nominal"
    )
    with picture(path, title, (3.6, 3.6), 11.0, 3) as axes:
        panels = iter(axes.T.flat)
        for loop in LOOPS:
            for mismatch in loop.mismatches:
                draw_map(next(panels), loop, mismatch, found[loop.name, mismatch.title])
        patches = [Patch(facecolor=colour, label=text) for text, colour in KINDS]
        axes[0, 0].figure.legend(handles=patches, loc="outside lower center", ncols=2)


def drift_picture(runs: Sequence[tuple[str, Result]], path: Path) -> None:
    """Draw pitch and speed of the long runs as a PNG at `path`; raises TwipError when it cannot be written."""
    with picture(path, "The conditions keep the pitch, not the wheels", (2.4, 2.6)) as (pitch, speed):
        for (title, table), colour in zip(runs, COLOURS, strict=True):
            times = table.times - RELEASE
            chosen = (times >= 0.0) & (table["plant.fallen"] < 0.5)
            moved = value("wheel_radius") * table["plant.wheel_rate"][chosen]
            pitch.plot(
                times[chosen], np.degrees(table["plant.pitch"][chosen]), color=colour, linewidth=1.2, label=title
            )
            speed.plot(times[chosen], moved, color=colour, linewidth=1.6)
            if table["plant.fallen"][-1] > 0.5:
                end = float(times[chosen][-1]), float(moved[-1])
                speed.plot(*end, "x", color=colour, markersize=9, markeredgewidth=2)
                place = {"xytext": (8, -16), "textcoords": "offset points"}
                speed.annotate(f"fell at {end[0]:.1f} s", end, color=colour, **place)
        top = value("supply_voltage") / value("back_emf_constant") / value("gear_ratio") * value("wheel_radius")
        speed.axhline(top, color=GREY, linewidth=1, linestyle=":")
        speed.text(0.1, top - 0.3, f"{value('supply_voltage'):g} V, no load", color=GREY)
        pitch.set_ylim(-12, 30)
        label(pitch, "pitch [°]", None)
        legend(pitch, 2)
        label(speed, "speed [m/s]", "time after the release [s]")
        for axes in (pitch, speed):
            axes.set_xlim(0.0, DRIFT_TIME)


def smallest(trials: Sequence[Trial], factor: float, good: Callable[[Trial], bool]) -> float | None:
    """Return the smallest epsilon [rad/s2] with a good trial, None if there is none."""
    return min((t.epsilon for t in trials if t.factor == factor and good(t)), default=None)


def tables(found: Study) -> list[str]:
    """Return the lines of one Markdown table per mismatch: from which epsilon on it stands, and meets its condition."""
    questions = (("stands from epsilon =", attrgetter("stands")), ("condition met from epsilon =", Trial.meets))
    lines = []
    for (loop, title), trials in found.items():
        factors = sorted({t.factor for t in trials})
        rows = [[f"{loop}: {title}, × nominal", *(f"{f:g}" for f in factors)], ["---"] * (len(factors) + 1)]
        for question, good in questions:
            known = [smallest(trials, f, good) for f in factors]
            rows.append([question, *("none" if e is None else f"{e:g}" for e in known)])
        lines += [f"| {' | '.join(row)} |" for row in rows] + [""]
    return lines


def report(out: Path, progress: Callable[[float], None]) -> list[str]:
    """Run the study on freshly built FMUs, write `stability.png` and `stability_drift.png`, and return its tables.

    Raises TwipError, before anything runs, when nothing can be written to `out`.
    """
    make_writable(out)
    with TemporaryDirectory() as folder:
        build_all(Path(folder))
        ssp = Path(folder) / "ssp" / "twip.ssp"
        found = study(ssp, lambda share: progress(0.9 * share))
        map_picture(found, out / "stability.png")
        runs = []
        for drift in DRIFTS:
            runs.append((drift.title, run(ssp, drift.start_values, RELEASE + DRIFT_TIME)))
            progress(0.9 + 0.1 * len(runs) / len(DRIFTS))
        drift_picture(runs, out / "stability_drift.png")
    return tables(found)
