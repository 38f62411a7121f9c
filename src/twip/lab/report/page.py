"""Puts the report of logs together: panels and samples, tables, messages, and the scripts that show them."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...cosim import Playback
from ...errors import TwipError
from ..drawing import BLUE, PALETTE, look
from ..metrics import is_robot, judge
from ..panels import Line, panels
from ..run_parameters import number
from . import about
from .frame import filled, framed, write_page
from .messages import messages_table
from .samples import Samples

SCRIPTS = ("data.js", "plots.js", "robot.js", "player.js")
BEFORE_RELEASE = 0.2
"""How long before the robot is released the report begins, in s."""


def report(logs: Sequence[Playback], path: Path, names: Sequence[str] = ()) -> Path:
    """Write the report of one log, or of several that are compared, to `path`, and return it.

    `names` are signals (with `*` and `?`) that get panels besides the usual ones. Raises TwipError when a log has no
    rows, a name matches nothing, or the file cannot be written.
    """
    if empty := [str(log.path) for log in logs if not len(log.times)]:
        raise TwipError(f"log {name!r} has no rows to show" for name in empty)
    return write_page(page(logs, names), path)


def page(logs: Sequence[Playback], names: Sequence[str] = ()) -> str:
    """Return the report as HTML."""
    labels = short_names([log.path for log in logs])
    colors = [BLUE] if len(logs) == 1 else [PALETTE[i % len(PALETTE)] for i in range(len(logs))]
    robots = [is_robot(list(log.signals)) for log in logs]
    verdicts = [judge(log) if robot else None for log, robot in zip(logs, robots, strict=True)]
    samples = Samples([log.times for log in logs])
    drawn = _panels(logs, labels, names, samples)
    moving = [
        _robot(log, index, colors[index], samples)
        for index, (log, robot) in enumerate(zip(logs, robots, strict=True))
        if robot
    ]
    packed, packed_text = samples.packed()
    released = [verdict.release for verdict in verdicts if verdict and np.isfinite(verdict.release)]
    data: dict[str, Any] = {"panels": drawn, "robots": moving, "samples": packed}
    if released:
        data["begin"] = max(float(min(log.times[0] for log in logs)), min(released) - BEFORE_RELEASE)
    details = (
        about.table("Parameters that are not nominal", labels, about.parameters(logs)),
        about.table("Origin", labels, about.origin(logs)),
    )
    note = (
        "Every row of the log is in this file."
        if not packed["group"]
        else (f"Drawn from the smallest and the largest value of every {packed['group']:g} s; the log has them all.")
    )
    return framed(
        "run",
        " and ".join(labels),
        about.verdicts_line(labels, colors, verdicts) + about.remarks_line(labels, logs),
        filled(
            "run.html",
            summary=about.table("Summary", labels, about.summary(logs, verdicts)),
            about=messages_table(labels, logs) + "\n".join(details),
        ),
        note,
        data,
        SCRIPTS,
        packed_text,
    )


def short_names(paths: Sequence[Path]) -> list[str]:
    """Return a short name per log: the file's, with as many folders as tell equal ones apart."""
    for count in range(1, 1 + max((len(path.parts) for path in paths), default=0)):
        names = [os.path.join(*path.with_suffix("").parts[-count:]) for path in paths]
        if len(set(names)) == len(names):
            return names
    return [f"{path.stem} ({number})" for number, path in enumerate(paths, 1)]


def _panels(
    logs: Sequence[Playback], labels: Sequence[str], names: Sequence[str], samples: Samples
) -> list[dict[str, Any]]:
    """Return the panels of all logs as the script takes them; those of one title and unit become one."""
    alone = len(logs) == 1
    merged: dict[tuple[str, str], list[tuple[int, int, Line]]] = {}
    notes: dict[tuple[str, str], str] = {}
    for index, log in enumerate(logs):
        for panel in [*panels(log), *(panels(log, names) if names else [])]:
            lines = merged.setdefault((panel.title, panel.unit), [])
            notes[panel.title, panel.unit] = panel.note
            known = {(i, line.label) for i, _, line in lines}
            lines += [(index, k, line) for k, line in enumerate(panel.lines) if (index, line.label) not in known]
    result = []
    for (title, unit), lines in merged.items():
        drawn: list[dict[str, Any]] = []
        for index, position, line in sorted(lines, key=lambda item: item[1]):
            if line.role == "reference" and not np.any(line.values):
                continue  # nothing was asked for
            if line.role == "limit" and any(known["label"] == line.label for known in drawn):
                continue  # of another log
            looks = look(line.role, position, index, len(logs))
            drawn.append(
                {
                    "label": line.label if alone or line.role == "limit" else f"{line.label}, {labels[index]}",
                    "source": line.source,
                    "color": looks.color,
                    "width": looks.width,
                    "alpha": looks.alpha,
                    "dash": looks.dash,
                    "series": samples.add(index, line.values),
                }
            )
        result.append({"title": title, "unit": unit, "lines": drawn, "note": notes[title, unit]})
    return result


def _robot(log: Playback, index: int, color: str, samples: Samples) -> dict[str, Any]:
    """Return what moves the drawn robot: angles in degrees, the wheel's in rad."""

    def parameter(name: str) -> float:
        return number(log.metadata, "plant", name, str(log.path))

    series = {
        "pitch": np.degrees(log["plant.pitch"]),
        "yaw": np.degrees(log["plant.yaw"]),
        "wheel": log["plant.wheel_angle"],
        "x": log["plant.x"],
        "y": log["plant.y"],
        "slope": np.degrees(log["plant.ground_slope"]),
        "push": log["plant.push_force"],
    }
    for name in ("slope", "push"):
        if not np.any(series[name]):
            del series[name]
    return {
        "color": color,
        "series": {name: samples.add(index, values) for name, values in series.items()},
        **{name: parameter(name) for name in ("wheel_radius", "track_width", "push_height")},
        "height": 2.0 * parameter("cog_height"),
    }
