"""What a contestant does: prepare once, then run as many steps as each line of its standard input asks for.

    python contestants/NAME.py SYSTEM.ssp UNPACKED_FOLDER LOG_FOLDER      an empty LOG_FOLDER: no log

It answers `ready`, then the seconds that each run took, one number per line; starting up does not count.
"""

import sys
import time
from collections.abc import Callable
from pathlib import Path

STEP_SIZE = 0.001
LONG_ENOUGH = 0.1
"""Time in s that the steps of one measurement should take."""
MOST = 40_000
"""Most steps of one measurement."""


def arguments() -> tuple[Path, Path, Path | None]:
    """Return the archive, the folder it is unpacked in, and the folder for logs, None for no log."""
    return Path(sys.argv[1]), Path(sys.argv[2]), Path(sys.argv[3]) if sys.argv[3] else None


def timed(work: Callable[[], object]) -> float:
    """Return the seconds that `work` takes."""
    begin = time.perf_counter()
    work()
    return time.perf_counter() - begin


def serve(run: Callable[[int], float]) -> None:
    """Answer requests: `run` does that many steps and returns the seconds they took."""
    run(10)  # whatever is done once only
    print("ready", flush=True)
    for line in sys.stdin:
        print(repr(run(int(line))), flush=True)


def slope(whole: Callable[[int], float]) -> Callable[[int], float]:
    """Return a run without its start-up, for tools that start anew each time: the time of 2 n steps less that of n.

    n is so large that the difference is well above the start-up's scatter.
    """
    counted = [100]

    def run(steps: int) -> float:
        if steps < 100:
            return whole(steps)
        while True:
            n = counted[0]
            difference = whole(2 * n) - whole(n)
            if difference > LONG_ENOUGH or n >= MOST:
                return difference / n * steps
            counted[0] *= 4

    return run
