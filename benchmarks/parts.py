"""What a step of the robot is made of: each component's set, step and get, by FMI and by native calls, and the log."""

import time
from pathlib import Path
from statistics import median
from typing import Any

import contestants_path  # noqa: F401
import numpy as np
from bare import BareCalls, bare_calls

from twip.cosim import Runtime, load, simulate
from twip.cosim.coupling import compiled_loop
from twip.cosim.sinks.mcap_log import McapLog

STEPS = 10_000
STEP_SIZE = 0.001
REPETITIONS = 7


class Calls:
    """Takes the place of the compiled loop: measures each kind of call of each component, and does no step."""

    native = False
    recorded = np.zeros((0, 0))
    found: dict[tuple[str, int], float] = {}  # noqa: RUF012

    def __init__(self, execution: Any):
        for port in execution.ports:
            port.instance.step(0.0, STEP_SIZE)
        self._calls = BareCalls(execution, self.native)
        self._names = [execution.schedule.components[i].name for i in execution.schedule.order]
        self.measured = False

    def run(self, _times: Any, step_size: float, _inputs: Any, rows: Any, _stop: Any) -> tuple[int, None]:
        """Measure once."""
        if len(rows) and not self.measured:
            self.measured = True
            grid = np.arange(STEPS + 1) * STEP_SIZE
            table, references, values = self._calls.tables
            for name, row in zip(self._names, table, strict=True):
                for what in range(3):
                    best = []
                    for _ in range(REPETITIONS):
                        begin = time.perf_counter()
                        bare_calls(what, grid, step_size, self.recorded, row, references, values)
                        best.append((time.perf_counter() - begin) / STEPS)
                    self.found[name, what] = median(best)
        return len(rows), None


def measure(robot: Path, folder: Path, data: dict[str, Any]) -> list[str]:
    """Return Markdown: microseconds per step by component and call, and what the log costs."""
    with load(robot) as system:
        result = simulate(system, stop_time=STEPS * STEP_SIZE, step_size=STEP_SIZE, runtime=Runtime(loop="compiled"))
        assert result.table is not None
        Calls.recorded = np.ascontiguousarray(result.table.values[1:])
        columns = len(system.columns)
        parts: dict[str, dict[tuple[str, int], float]] = {}
        loop = compiled_loop.CompiledLoop
        try:
            compiled_loop.CompiledLoop = Calls  # type: ignore[misc, assignment]
            for name, native in (("FMI", False), ("native", True)):
                Calls.native, Calls.found = native, {}
                simulate(system, stop_time=STEP_SIZE, step_size=STEP_SIZE, runtime=Runtime(loop="compiled"), sinks=[])
                parts[name] = Calls.found
        finally:
            compiled_loop.CompiledLoop = loop  # type: ignore[misc]
        runs: dict[bool, list[float]] = {False: [], True: []}
        for _ in range(REPETITIONS):
            for logging, times in runs.items():
                sinks = [McapLog(folder / "parts.mcap", system.channels, system.provenance())] if logging else []
                run = simulate(
                    system,
                    stop_time=STEPS * STEP_SIZE,
                    step_size=STEP_SIZE,
                    sinks=sinks,
                    runtime=Runtime(loop="compiled"),
                )
                times.append(run.wall_time / run.steps)
    log = median(runs[True]) - median(runs[False])
    lines = ["µs per step of 1 ms, medians; inputs are those of a recorded run, all of them set in every step:", ""]
    lines += ["| component | set, FMI | step, FMI | get, FMI | set, native | step, native | get, native |"]
    lines += ["|---|---:|---:|---:|---:|---:|---:|"]
    names = list(dict.fromkeys(name for name, _ in parts["FMI"]))
    for name in names:
        cells = [f"{1e6 * parts[kind][name, what]:.2f}" for kind in parts for what in range(3)]
        lines.append(f"| {name} | {' | '.join(cells)} |")
    sums = [f"{1e6 * sum(parts[kind][name, what] for name in names):.2f}" for kind in parts for what in range(3)]
    lines.append(f"| **all** | {' | '.join(sums)} |")
    lines += [
        "",
        f"The log takes {1e6 * log:.2f} µs per step of {columns} signals, {1e6 * log * 50 / columns:.2f} µs per 50.",
        "",
    ]
    data["parts"] = parts, log
    return lines
