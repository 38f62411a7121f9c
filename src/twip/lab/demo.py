"""The demonstration: the robot is built, stands up from 27 degrees (paper, Fig 13) and is judged."""

from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import version
from math import degrees
from pathlib import Path

import numpy as np

from ..cosim.experiment import TimeGrid
from ..cosim.load import load
from ..cosim.log import Attachment, McapLog
from ..cosim.playback import Playback, read
from ..cosim.simulate import simulate
from ..fmi.build import build_all
from .picture import stand_up_picture

SETTLED_AFTER = 3.0
"""Time after the release from which the pitch must stay within `PITCH_LIMIT`, in s."""
PITCH_LIMIT = np.radians(1.0)
"""Largest pitch of a balanced robot, in rad."""


@dataclass(frozen=True)
class Verdict:
    """How a stand-up went; times in s since the start, angles in rad, voltages in V."""

    release: float
    fallen_at: float | None
    settled: bool
    peak_pitch_settled: float
    steady_state_error: float
    peak_voltage: float
    estimator_error: float

    @property
    def balanced(self) -> bool:
        """The robot stands and its pitch is within the limit from `SETTLED_AFTER` on."""
        return self.fallen_at is None and self.settled

    def sentence(self) -> str:
        """The verdict in words."""
        if self.fallen_at is not None:
            return f"fell at {self.fallen_at:.3f} s"
        verdict, relation = ("balanced", "<") if self.settled else ("stands, not settled", ">")
        limit = f"|pitch| {relation} {degrees(PITCH_LIMIT):.0f}° from {SETTLED_AFTER:g} s after release on"
        return f"{verdict}: {limit}, at most {degrees(self.peak_pitch_settled):.2f}°"


def judge(log: Playback) -> Verdict:
    """Judge a stand-up: steady state begins `SETTLED_AFTER`, its error is the magnitude of the mean pitch."""
    times, pitch = log.times, log["plant.pitch"]
    moving = np.flatnonzero(log["plant.pitch_rate"] != 0.0)
    release = float(times[moving[0] - 1]) if moving.size and moving[0] else float(times[0])
    fallen = np.flatnonzero(log["plant.fallen"] > 0.5)
    steady = pitch[times >= release + SETTLED_AFTER]
    if not steady.size:
        steady = pitch[-1:]
    voltage = np.maximum(np.abs(log["controller.left.voltage"]), np.abs(log["controller.right.voltage"]))
    error = np.abs(log["estimator.pitch"] - pitch)[times >= release]
    return Verdict(
        release=release,
        fallen_at=float(times[fallen[0]]) if fallen.size else None,
        settled=bool(times[-1] >= release + SETTLED_AFTER and np.max(np.abs(steady)) < PITCH_LIMIT),
        peak_pitch_settled=float(np.max(np.abs(steady))),
        steady_state_error=float(abs(np.mean(steady))),
        peak_voltage=float(np.max(voltage)),
        estimator_error=float(np.max(error)) if error.size else 0.0,
    )


@dataclass(frozen=True)
class Demo:
    """What the demonstration did."""

    balanced: bool
    interrupted: bool
    rows: tuple[tuple[str, str], ...]
    """Labels and what there is to say."""
    log: Path
    picture: Path


def demo(out: Path, progress: Callable[[float], None], notice: Callable[[str], None]) -> Demo:
    """Build everything below `out`, run `ssp/twip.ssp`, write `logs/demo.mcap` and `logs/demo.png`, and report.

    `progress` is called with the simulated time in s, `notice` with what takes a while.
    """
    build_all(out)
    ssp, path, picture = out / "ssp" / "twip.ssp", out / "logs" / "demo.mcap", out / "logs" / "demo.png"
    with load(ssp) as system:
        metadata = {**system.provenance(), "run": {"command": "twip demo", "twip": version("twip")}}

        def sinks(grid: TimeGrid) -> list[McapLog]:
            return [McapLog(path, system.channels, metadata, [Attachment.file(ssp)], start_time=grid.start)]

        result = simulate(system, sinks=sinks, progress=progress, notice=notice)
    if result.interrupted:
        return Demo(False, True, (("verdict", f"interrupted at {result.time:g} s"), ("log", str(path))), path, picture)
    log = read(path)
    verdict = judge(log)
    stand_up_picture(log, verdict.release, picture)
    start = degrees(log["plant.pitch"][0])
    rows = (
        ("verdict", verdict.sentence()),
        ("start", f"{start:.1f}°, released at {verdict.release:g} s"),
        ("steady-state error", f"{degrees(verdict.steady_state_error):.2f}°"),
        ("estimator error", f"at most {degrees(verdict.estimator_error):.2f}°"),
        ("peak voltage", f"{verdict.peak_voltage:.2f} V"),
        ("real-time factor", f"{result.real_time_factor:.1f} ({result.time:g} s in {result.wall_time:.2f} s)"),
        ("log", str(path)),
        ("picture", str(picture)),
    )
    return Demo(verdict.balanced, result.interrupted, rows, path, picture)
