"""A log as a Rerun recording that opens laid out: the robot in 3D beside plots, on a timeline of durations.

Needs rerun-sdk (extra `view`). Rerun plots fields of the log's messages as they are, so angles are in rad.
"""

import csv
import io
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from ..cosim import Channel, McapLog, Playback, read_log
from ..cosim.log import unique_identifiers
from ..errors import TwipError
from ..extras import missing, optional
from ..outputs import replacing
from .drawing import INK, PALETTE, look
from .endings import check_ending
from .panels import Line, panels
from .report.page import short_names
from .scene import SIGNALS, One, scene

APPLICATION = "twip"
"""Recording and blueprint belong together by this id."""
FORMATS = (".rrd",)
MOST_PLOTS = 6
APART = 0.3
"""Between the robots of several logs, in m."""
DARK = {INK: "#f2f2f2", PALETTE[0]: PALETTE[5], PALETTE[1]: "#ff7a1a"}
"""Colours that would not show on Rerun's dark ground, and what stands for them."""
COMPARED = ("real", "left", "other")
"""Roles of the lines that are shown where logs are compared: one or two of each, for legends have room for few."""
WIDTHS = {"estimate": 4.0, "real": 1.3}
"""In points: Rerun draws entities by their names, so the estimator's lines lie below the plant's, and show beside them.
"""
EYE, TARGET = (0.55, -0.75, 0.40), (0.15, 0.0, 0.09)
"""Where the robot is looked at from, and what is looked at, in m."""


@dataclass(frozen=True)
class Place:
    """Where a signal lies in the recording."""

    entity: str
    component: str
    field: str


@dataclass(frozen=True)
class Shown:
    """A log in the recording: as it is, or one of several under a name of its own."""

    log: Playback
    places: Mapping[str, Place]
    name: str = ""


def recording(logs: Sequence[Playback], path: Path, apart: float = APART) -> Path:
    """Write logs as one Rerun recording with its layout to `path` (.rrd), and return it; raises TwipError.

    Several robots have colours, and stand `apart` m from each other beside where they are.
    """
    check_ending(path, FORMATS)
    program = rerun()
    # without --recover the log of a killed run, which has no summary, becomes an empty recording
    options = ("--application-id", APPLICATION, "--timeline-type", "duration", "--recover")
    with tempfile.TemporaryDirectory(prefix="twip-view-") as made:
        folder = Path(made)
        layout = folder / "layout.rbl"
        shown = [Shown(log, places(log)) for log in logs] if len(logs) == 1 else _named(logs, folder, apart)
        raws = []
        for i, one in enumerate(shown):
            raws.append(str(folder / f"{i}.rrd"))
            source = one.log.path if len(logs) == 1 else folder / f"{one.name}.mcap"
            same = () if len(logs) == 1 else ("--recording-id", APPLICATION)
            _run([program, "mcap", "convert", *options, *same, "-o", raws[-1], str(source)])
        blueprint(shown).save(APPLICATION, str(layout))
        merged = folder / "merged.rrd"
        _run([program, "rrd", "merge", *raws, str(layout), "-o", str(merged)])
        with replacing(path) as stream, merged.open("rb") as made_file:
            shutil.copyfileobj(made_file, stream)
    return path


def _on_dark(color: str) -> str:
    return DARK.get(color, color)


def _named(logs: Sequence[Playback], folder: Path, apart: float) -> list[Shown]:
    """Write the rows of several logs to `folder`, each below a topic of its own, and return where they lie."""
    shown = []
    names = unique_identifiers([name.replace("/", "_") for name in short_names([log.path for log in logs])])
    for i, (log, name) in enumerate(zip(logs, names, strict=True)):
        one = One(name, ((len(logs) - 1) / 2 - i) * apart, _on_dark(PALETTE[i % len(PALETTE)]))
        channels = [Channel(".".join(filter(None, (name, c.component))), c.signals) for c in log.channels]
        path = folder / f"{name}.mcap"
        with McapLog(path, channels, {}, (), log.start_time, extras=scene(log.channels, log.metadata, one)) as file:
            file.write(log.times, log.table())
        found = places(read_log(path))
        shown.append(Shown(log, {signal: found[f"{name}.{signal}"] for signal in log.signals}, name))
    return shown


def rerun() -> str:
    """Return the path of Rerun's program; raises TwipError when it is not installed."""
    beside = shutil.which("rerun", path=str(Path(sys.executable).parent))
    program = beside or shutil.which("rerun")
    if program is None or find_spec("rerun") is None:
        raise missing("rerun", "this view")
    return program


def blueprint(shown: Sequence[Shown]) -> Any:
    """Return the layout for logs."""
    layout = optional("rerun.blueprint", "this view")
    sdk = optional("rerun", "this view")
    merged: dict[str, list[tuple[int, int, Line]]] = {}
    for i, one in enumerate(shown):
        for panel in panels(one.log):
            kept = [line for line in panel.lines if len(shown) == 1 or line.role in COMPARED]
            merged.setdefault(panel.title, []).extend((i, k, line) for k, line in enumerate(kept))
    plots: list[Any] = []
    for title, of_all in merged.items():
        drawable = [item for item in of_all if item[2].source in shown[item[0]].places]
        units = [shown[i].log.unit(line.source) for i, _, line in drawable]
        lines = [item for item, unit in zip(drawable, units, strict=True) if unit == units[0]]
        if not lines or len(plots) == MOST_PLOTS:
            continue
        unit = units[0]
        overrides: dict[str, list[Any]] = {}
        for i, position, line in lines:
            place, looks = shown[i].places[line.source], look(line.role, position, i, len(shown))
            color = _on_dark(looks.color)
            red_green_blue = [int(color[i : i + 2], 16) for i in (1, 3, 5)]
            width = WIDTHS.get(line.role, looks.width) if len(shown) == 1 else looks.width
            label = ", ".join(filter(None, (line.label, shown[i].name)))
            series = sdk.SeriesLines(names=[label], colors=[red_green_blue], widths=[width])
            mapping = layout.encodings.VisualizerComponentMapping(
                target="Scalars:scalars",
                source_kind=layout.encodings.ComponentSourceKind.SourceComponent,
                source_component=place.component,
                selector=f".{place.field}",
            )
            overrides.setdefault(place.entity, []).append(series.visualizer(mappings=[mapping]))
        name = f"{title} [{unit}]" if unit else title
        legend = layout.PlotLegend(layout.Corner2D.RightTop, visible=len(lines) > 1)
        plots.append(
            layout.TimeSeriesView(
                origin="/", contents=list(overrides), name=name, overrides=overrides, plot_legend=legend
            )
        )
    columns: list[Any] = [layout.Vertical(*plots)] if plots else []
    if any(all(name in one.log.signals for name in SIGNALS) for one in shown):
        away = 1.0 + 0.35 * (len(shown) - 1)
        eye = [target + away * (at - target) for at, target in zip(EYE, TARGET, strict=True)]
        robot = layout.Spatial3DView(
            origin="/",
            name="robot",
            contents=["+ /**"],
            line_grid=layout.LineGrid3D(visible=True, spacing=0.1),
            spatial_information=layout.SpatialInformation(target_frame="world"),
            eye_controls=layout.EyeControls3D(position=eye, look_target=TARGET, eye_up=(0.0, 0.0, 1.0)),
        )
        columns.insert(0, robot)
    return layout.Blueprint(
        layout.Horizontal(*columns),
        layout.TimePanel(timeline="message_log_time", state="collapsed"),
        layout.BlueprintPanel(state="hidden"),
        layout.SelectionPanel(state="hidden"),
    )


def places(log: Playback) -> dict[str, Place]:
    """Return where each signal lies in the recording, as the table in the log tells."""
    table = next((item.data for item in log.attachments if item.name == "signals.csv"), b"")
    rows = list(csv.DictReader(io.StringIO(table.decode("utf-8", "replace"))))
    if any(None in row.values() or "topic" not in row for row in rows):
        raise TwipError(f"log {str(log.path)!r}: its table of signals is damaged")
    topics = list(dict.fromkeys(row["topic"] for row in rows))
    messages = dict(zip(topics, unique_identifiers([topic[1:] for topic in topics]), strict=True))
    return {
        f"{row['component']}.{row['variable']}" if row["component"] else row["variable"]: Place(
            row["topic"], f"twip.{messages[row['topic']]}:message", row["field"]
        )
        for row in rows
    }


def _run(command: Sequence[str]) -> None:
    """Run one of Rerun's tools; its exit codes are not to be trusted, so what it was to write must be there."""
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    if result.returncode or not Path(command[command.index("-o") + 1]).exists():
        said = [line for line in result.stderr.splitlines() if line.strip()] or ["no reason given"]
        raise TwipError(f"rerun {command[1]} {command[2]} failed: {said[-1]}")
