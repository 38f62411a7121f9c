"""Work-precision: the error of each coupling and step over what a simulated second costs."""

import sys
import tempfile
from pathlib import Path
from statistics import median
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "tests" / folder) for folder in ("reference", "robot")]
from coupling_error import SCENARIOS, SCHEMES, STEPS, cosimulate, stored, true_state_robot  # noqa: E402

SCENARIO = "stand-up with a turn"
REPETITIONS = 5


def measure(robot: Path, data: dict[str, Any]) -> list[str]:
    """Return Markdown; errors are those that benchmarks/coupling.py has measured against the monolithic reference."""
    errors = stored()
    points = [(label, step_size) for label in SCHEMES for step_size in STEPS]
    times: dict[tuple[str, float], list[float]] = {point: [] for point in points}
    with tempfile.TemporaryDirectory() as name:
        system = true_state_robot(robot.parents[1], Path(name))
        cosimulate(system, SCENARIOS[SCENARIO], SCHEMES[points[0][0]], points[0][1])  # what is done once only
        for _ in range(REPETITIONS):  # in turns: a slow moment of the machine touches all alike
            for label, step_size in points:
                run = cosimulate(system, SCENARIOS[SCENARIO], SCHEMES[label], step_size)
                times[label, step_size].append(run.wall_time / run.time)
    data["precision"] = {
        label: [(1e6 * median(times[label, h]), errors[SCENARIO, label, h]) for h in STEPS] for label in SCHEMES
    }
    lines = ["| coupling | step | wall time per simulated second | pitch error |", "|---|---:|---:|---:|"]
    for label, found in data["precision"].items():
        for step_size, (cost, error) in zip(STEPS, found, strict=True):
            lines.append(f"| {label} | {1e3 * step_size:g} ms | {1e-3 * cost:.2f} ms | {error:.2g}° |")
    return [*lines, ""]
