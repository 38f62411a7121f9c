"""Our master: `compiled` (its default), `fmi` (compiled, but native functions left aside), `python` (plain loop)."""

import sys

from protocol import STEP_SIZE, arguments, serve

from twip.cosim import compiled_loop, load, simulate
from twip.cosim.log import McapLog
from twip.cosim.native import NOT_NATIVE

kind = sys.argv[4]
ssp, _, logs = arguments()
system = load(ssp)
if kind == "fmi":
    compiled_loop.native_access = lambda _: NOT_NATIVE


def run(steps: int) -> float:
    """Run from the start; what stepping and recording took."""
    sinks = [] if logs is None else [McapLog(logs / f"{kind}.mcap", system.channels, system.provenance())]
    loop = "python" if kind == "python" else "compiled"
    return simulate(system, stop_time=steps * STEP_SIZE, step_size=STEP_SIZE, sinks=sinks, loop=loop).wall_time


serve(run)
