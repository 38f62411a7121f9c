"""The demonstration: the robot is built, stands up from 27 degrees (paper, Fig 13) and is judged."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib.metadata import version
from math import degrees
from pathlib import Path

from ..cosim import Attachment, McapLog, Observer, TimeGrid, load, read_log, simulate
from ..fmi import build_all
from .metrics import judge
from .picture import stand_up_picture
from .scene import scene


@dataclass(frozen=True)
class Demo:
    """What the demonstration did."""

    balanced: bool
    interrupted: bool
    rows: tuple[tuple[str, str], ...]
    """Labels and what there is to say."""
    log: Path
    picture: Path
    metrics: Mapping[str, float] = field(default_factory=dict)
    """As `metrics.measure` gives them."""


def demo(out: Path, progress: Callable[[float], None], notice: Callable[[str], None]) -> Demo:
    """Build everything below `out`, run `ssp/twip.ssp`, write `logs/demo.mcap` and `logs/demo.png`, and report.

    `progress` is called with the simulated time in s, `notice` with what takes a while.
    """
    build_all(out)
    ssp, path, picture = out / "ssp" / "twip.ssp", out / "logs" / "demo.mcap", out / "logs" / "demo.png"
    with load(ssp) as system:
        metadata = {**system.provenance(), "run": {"command": "twip demo", "twip": version("twip")}}

        def sinks(grid: TimeGrid) -> list[McapLog]:
            extras = scene(system.channels, metadata)
            return [McapLog(path, system.channels, metadata, [Attachment.file(ssp)], grid.start, extras=extras)]

        result = simulate(system, sinks=sinks, observer=Observer(progress=progress, notice=notice))
    if result.interrupted:
        told = [("verdict", f"interrupted at {result.time:g} s"), *([("log", str(path))] if result.values else [])]
        return Demo(False, True, tuple(told), path, picture)
    log = read_log(path)
    verdict = judge(log)
    stand_up_picture(log, verdict.release, picture)
    start = degrees(log["plant.pitch"][0])
    rows = (
        ("verdict", verdict.sentence()),
        ("start", f"{start:.1f}°, released at {verdict.release:g} s"),
        ("steady-state error", verdict.text("steady_state_error")),
        ("estimator error", f"at most {verdict.text('estimator_error')}"),
        ("peak voltage", verdict.text("peak_voltage")),
        ("real-time factor", f"{result.real_time_factor:.1f} ({result.time:g} s in {result.wall_time:.2f} s)"),
        ("log", str(path)),
        ("picture", str(picture)),
    )
    return Demo(verdict.balanced, result.interrupted, rows, path, picture, verdict.metrics)
