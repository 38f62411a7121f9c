"""Our master: `compiled` (its default), `fmi` (compiled, but native functions left aside), `python` (plain loop).

A folder after that holds FMUs of the blocks in FMI 3.0, to take the place of those in the system.
"""

import sys
from pathlib import Path

from protocol import STEP_SIZE, arguments, serve

from twip.cosim import Runtime, load, simulate
from twip.cosim.coupling import compiled_loop
from twip.cosim.fmus.native import NOT_NATIVE
from twip.cosim.sinks.mcap_log import McapLog

kind = sys.argv[4]
ssp, _, logs = arguments()
system = load(ssp)
if len(sys.argv) > 5:
    blocks = {c.name: Path(sys.argv[5]) / f"{c.fmu.model_identifier}_fmi3.fmu" for c in system.components}
    system = load(ssp, swap=blocks)
if kind == "fmi":
    compiled_loop.native_access = lambda _: NOT_NATIVE


def run(steps: int) -> float:
    """Run from the start; what stepping and recording took."""
    sinks = [] if logs is None else [McapLog(logs / f"{kind}.mcap", system.channels, system.provenance())]
    loop = "python" if kind == "python" else "compiled"
    return simulate(
        system, stop_time=steps * STEP_SIZE, step_size=STEP_SIZE, sinks=sinks, runtime=Runtime(loop=loop)
    ).wall_time


serve(run)
