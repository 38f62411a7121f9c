"""How the cost grows with FMUs, signals and time, how much memory a long run takes, and how long a start takes."""

import os
import re
import subprocess
import sys
import time
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from chain import write_chain

from twip.cosim import Runtime, load, simulate
from twip.cosim.sinks.mcap_log import McapLog

FMUS = (2, 8, 32, 128)
SIGNALS = (10, 30, 100, 300, 1000)
TIMES = (1.0, 10.0, 100.0, 600.0, 3600.0)
STEP_SIZE = 0.001
MEMORY = """
import resource, sys
from twip.cosim import Runtime, load, simulate
from twip.cosim.sinks.mcap_log import McapLog
with load(sys.argv[1]) as system:
    log = McapLog(sys.argv[2], system.channels, system.provenance())
    simulate(system, stop_time=float(sys.argv[3]), sinks=[log], runtime=Runtime(loop="compiled"))
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
"""


def measure(robot: Path, folder: Path, data: dict[str, Any], quick: bool) -> list[str]:
    """Return Markdown: cost against size, with the line that fits and how well, memory and start-up."""
    by_fmus = [_chain(folder / f"fmus{n}", n, 1, logging=False) for n in FMUS]
    by_signals = [_chain(folder / f"signals{n}", 2, n // 4 or 1, logging=True) for n in SIGNALS]
    signals = [4 * (n // 4 or 1) for n in SIGNALS]
    times = TIMES[: 3 if quick else None]
    by_time = [_robot(robot, folder, t) for t in times]
    data["growth"] = {
        "FMUs in a chain, without log [µs per step]": (FMUS, [1e6 * t for t in by_fmus]),
        "signals of two FMUs, with log [µs per step]": (signals, [1e6 * t for t in by_signals]),
        "simulated time of the robot, with log [s]": (times, by_time),
    }
    lines = []
    for title, (sizes, costs) in data["growth"].items():
        slope, start, deviation = _line(sizes, costs)
        lines += [f"| {title} | {' | '.join(f'{n:g}' for n in sizes)} |", "|---" + "|---:" * len(sizes) + "|"]
        lines += [f"| measured | {' | '.join(f'{c:.3g}' for c in costs)} |"]
        lines += [f"| per unit | {' | '.join(f'{c / n:.3g}' for c, n in zip(costs, sizes, strict=True))} |", ""]
        lines += [f"Line: {start:.3g} + {slope:.3g} per unit; largest deviation {100 * deviation:.0f} %.", ""]
    short, long = (60.0, 120.0) if quick else (60.0, 600.0)
    memory = [_memory(robot, folder, t) for t in (short, long)]
    lines += [f"Memory of a run with log: {memory[0]:.0f} MB for {short:g} s, {memory[1]:.0f} MB for {long:g} s.", ""]
    cold, warm = _starts(robot, folder)
    lines += [
        f"From the command `twip run` to its first step: cold {cold:.1f} s (everything is compiled, once per build),"
        f" warm {warm:.2f} s.",
        "",
    ]
    return lines


def _chain(folder: Path, fmus: int, signals: int, logging: bool) -> float:
    """Return the median time per step in s of a chain."""
    folder.mkdir()
    with load(write_chain(folder, fmus, signals)) as system:
        found = []
        for _ in range(6):
            sinks = [McapLog(folder / "log.mcap", system.channels, system.provenance())] if logging else []
            run = simulate(system, stop_time=2.0, step_size=STEP_SIZE, sinks=sinks, runtime=Runtime(loop="compiled"))
            found.append(run.wall_time / run.steps)
    return median(found[1:])


def _robot(robot: Path, folder: Path, stop_time: float) -> float:
    """Return the median wall time in s of a run with its log."""
    with load(robot) as system:
        found = []
        for _ in range(3 if stop_time <= 100.0 else 1):
            log = McapLog(folder / "growth.mcap", system.channels, system.provenance())
            found.append(simulate(system, stop_time=stop_time, sinks=[log], runtime=Runtime(loop="compiled")).wall_time)
    (folder / "growth.mcap").unlink()
    return median(found)


def _line(sizes: Any, costs: Any) -> tuple[float, float, float]:
    """Return slope, start and largest relative deviation of the line with the least relative squares."""
    x, y = np.asarray(sizes, float), np.asarray(costs, float)
    matrix = np.stack([x, np.ones_like(x)], axis=1) / y[:, None]
    slope, start = np.linalg.lstsq(matrix, np.ones_like(y), rcond=None)[0]
    return float(slope), float(start), float(np.max(np.abs((slope * x + start) / y - 1.0)))


def _memory(robot: Path, folder: Path, stop_time: float) -> float:
    """Return the peak memory in MB of a run in a process of its own."""
    command = [sys.executable, "-c", MEMORY, str(robot), str(folder / "memory.mcap"), str(stop_time)]
    result = subprocess.run(command, capture_output=True, text=True, check=True)
    (folder / "memory.mcap").unlink()
    return float(result.stdout)


def _starts(robot: Path, folder: Path) -> tuple[float, float]:
    """Return the time in s from the command to the first step with an empty cache, and the median with a full one.

    Python keeps its bytecode, as it does unless told otherwise: without, every start compiles all modules again.
    """
    command = [sys.executable, "-m", "twip.cli", "run", str(robot), "--stop-time", "0.001", "--no-log"]
    environment = {**os.environ, "TWIP_CACHE": str(folder / "cache"), "NUMBA_CACHE_DIR": str(folder / "numba")}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    found = []
    for _ in range(6):
        begin = time.perf_counter()
        result = subprocess.run(command, env=environment, capture_output=True, text=True, check=True, cwd=folder)
        whole = time.perf_counter() - begin
        after = re.search(r"real-time factor.*\(([\d.]+) s\)", result.stdout)
        found.append(whole - float(after[1] if after else 0.0))
    return found[0], median(found[1:])
