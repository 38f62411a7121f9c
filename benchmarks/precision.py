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
    errors, costs = stored(), {}
    with tempfile.TemporaryDirectory() as name:
        system = true_state_robot(robot.parents[1], Path(name))
        for label, scheme in SCHEMES.items():
            for step_size in STEPS:
                runs = [cosimulate(system, SCENARIOS[SCENARIO], scheme, step_size) for _ in range(REPETITIONS)]
                costs[label, step_size] = median(run.wall_time / run.time for run in runs)
    data["precision"] = {
        label: [(1e6 * costs[label, h], errors[SCENARIO, label, h]) for h in STEPS] for label in SCHEMES
    }
    lines = ["| coupling | step | wall time per simulated second | pitch error |", "|---|---:|---:|---:|"]
    for label, points in data["precision"].items():
        for step_size, (cost, error) in zip(STEPS, points, strict=True):
            lines.append(f"| {label} | {1e3 * step_size:g} ms | {1e-3 * cost:.2f} ms | {error:.2g}° |")
    return [*lines, ""]
