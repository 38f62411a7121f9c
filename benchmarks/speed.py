"""Measures how fast the robot's co-simulation runs, with and without a log.

    python benchmarks/speed.py                 build the FMUs in a temporary folder and measure
    python benchmarks/speed.py --built DIR     use the system that `twip build --out DIR` has built

The stand-up of 10 s runs on one processor, warm (one run before does not count), by turns with and without log. Takes
about half a minute. A run's time is that of stepping and recording; on a machine with other work the best is the one
to go by. The exit status is 1 when the best run with log is below 20 times real time.
"""

import argparse
import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from statistics import median

from twip.cosim import Runtime, load, simulate
from twip.cosim.model.system import System
from twip.cosim.run.results import Result
from twip.cosim.sinks.mcap_log import McapLog
from twip.fmi.build import build_all

DURATION = 10.0
"""Simulated time of a run in s."""
REPETITIONS = 7
REQUIRED = 20.0
"""Real-time factor that the best run with log must reach."""
KINDS = ("with log", "without log")


@contextmanager
def one_processor() -> Iterator[None]:
    """Keep the process to one of the processors it may use, where the system can do that."""
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    allowed = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(allowed)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, allowed)


def one_run(system: System, kind: str, log: Path) -> Result:
    """Run once, to its end, and return how it went."""
    sinks = [McapLog(log, system.channels, system.provenance())] if kind == "with log" else []
    return simulate(system, stop_time=DURATION, sinks=sinks, runtime=Runtime(loop="compiled"))


def measure(ssp: Path, log: Path, repetitions: int = REPETITIONS) -> dict[str, list[Result]]:
    """Return the runs that count, by kind."""
    runs: dict[str, list[Result]] = {kind: [] for kind in KINDS}
    with load(ssp) as system, one_processor():
        for kind in KINDS:
            one_run(system, kind, log)
        for _ in range(repetitions):
            for kind in KINDS:
                runs[kind].append(one_run(system, kind, log))
    return runs


def report(runs: dict[str, list[Result]]) -> float:
    """Print the best and the median of each kind; return the best real-time factor with log."""
    print(f"{'':<12} {'best':>26} {'median':>26}")
    for kind, results in runs.items():
        steps = [r.wall_time / r.steps for r in results]
        factors = [r.real_time_factor for r in results]
        cells = ((min(steps), max(factors)), (median(steps), median(factors)))
        print(f"{kind:<12} {' '.join(f'{1e6 * s:9.1f} µs/step {f:6.1f} ×' for s, f in cells)}")
    return max(r.real_time_factor for r in runs["with log"])


def main() -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--built", type=Path, metavar="DIR", help="folder with ssp/twip.ssp; default: build it")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        if arguments.built is None:
            build_all(folder)
        best = report(measure((arguments.built or folder) / "ssp" / "twip.ssp", folder / "log.mcap"))
    print(f"best with log: {best:.1f} × real time, required: {REQUIRED:g}")
    return 0 if best >= REQUIRED else 1


if __name__ == "__main__":
    sys.exit(main())
