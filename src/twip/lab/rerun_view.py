"""A log as a Rerun recording that opens laid out: the robot in 3D beside plots, on a timeline of durations.

Needs rerun-sdk (extra `view`). Rerun plots fields of the log's messages as they are, so angles are in rad.
"""

import csv
import io
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from ..cosim.log_schema import unique_identifiers
from ..cosim.playback import Playback
from ..errors import TwipError
from .drawing import INK, PALETTE, look
from .endings import check_ending
from .panels import panels
from .scene import SIGNALS

APPLICATION = "twip"
"""Recording and blueprint belong together by this id."""
FORMATS = (".rrd",)
MOST_PLOTS = 6
DARK = {INK: "#f2f2f2", PALETTE[0]: PALETTE[5], PALETTE[1]: "#ff7a1a"}
"""Colours that would not show on Rerun's dark ground, and what stands for them."""
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


def recording(log: Playback, path: Path) -> Path:
    """Write a log as Rerun recording with its layout to `path` (.rrd), and return it; raises TwipError."""
    check_ending(path, FORMATS)
    program = rerun()
    options = ("--application-id", APPLICATION, "--timeline-type", "duration")
    with tempfile.TemporaryDirectory(prefix="twip-view-") as folder:
        raw, layout = Path(folder) / "raw.rrd", Path(folder) / "layout.rbl"
        _run([program, "mcap", "convert", *options, "-o", str(raw), str(log.path)])
        blueprint(log).save(APPLICATION, str(layout))
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise TwipError(f"{path}: the recording cannot be written ({error.strerror})") from None
        _run([program, "rrd", "merge", str(raw), str(layout), "-o", str(path)])
    return path


def rerun() -> str:
    """Return the path of Rerun's program; raises TwipError when it is not installed."""
    beside = shutil.which("rerun", path=str(Path(sys.executable).parent))
    program = beside or shutil.which("rerun")
    if program is None or find_spec("rerun") is None:
        raise TwipError("Rerun is not installed: pip install 'twip[view]'")
    return program


def blueprint(log: Playback) -> Any:
    """Return the layout for a log."""
    layout: Any = import_module("rerun.blueprint")
    sdk: Any = import_module("rerun")
    found = places(log)
    plots: list[Any] = []
    for panel in panels(log):
        drawable = [line for line in panel.lines if line.source in found]
        lines = [line for line in drawable if log.unit(line.source) == log.unit(drawable[0].source)]
        if not lines or len(plots) == MOST_PLOTS:
            continue
        unit = log.unit(lines[0].source)
        overrides: dict[str, list[Any]] = {}
        for position, line in enumerate(lines):
            place, looks = found[line.source], look(line.role, position, 0, 1)
            color = DARK.get(looks.color, looks.color)
            red_green_blue = [int(color[i : i + 2], 16) for i in (1, 3, 5)]
            width = WIDTHS.get(line.role, looks.width)
            series = sdk.SeriesLines(names=[line.label], colors=[red_green_blue], widths=[width])
            mapping = layout.encodings.VisualizerComponentMapping(
                target="Scalars:scalars",
                source_kind=layout.encodings.ComponentSourceKind.SourceComponent,
                source_component=place.component,
                selector=f".{place.field}",
            )
            overrides.setdefault(place.entity, []).append(series.visualizer(mappings=[mapping]))
        name = f"{panel.title} [{unit}]" if unit else panel.title
        legend = layout.PlotLegend(layout.Corner2D.RightTop, visible=len(lines) > 1)
        plots.append(
            layout.TimeSeriesView(
                origin="/", contents=list(overrides), name=name, overrides=overrides, plot_legend=legend
            )
        )
    columns: list[Any] = [layout.Vertical(*plots)] if plots else []
    if all(name in log.signals for name in SIGNALS):
        robot = layout.Spatial3DView(
            origin="/",
            name="robot",
            contents=["+ /**"],
            line_grid=layout.LineGrid3D(visible=True, spacing=0.1),
            spatial_information=layout.SpatialInformation(target_frame="world"),
            eye_controls=layout.EyeControls3D(position=EYE, look_target=TARGET, eye_up=(0.0, 0.0, 1.0)),
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
