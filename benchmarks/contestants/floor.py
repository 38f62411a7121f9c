"""The floor: the calls of a step with the inputs of a recorded run, every input set in every step, and nothing else.

`native` calls what our compiled loop calls, `fmi` the FMI functions alone.
"""

import sys
import time

from bare import BareCalls, bare_steps
from protocol import STEP_SIZE, arguments, serve

from twip.cosim import Runtime, load, simulate
from twip.cosim.coupling import compiled_loop

LONGEST = 20_000
"""Most steps of a run."""
ssp, _, _ = arguments()
system = load(ssp)
recorded = simulate(
    system, stop_time=LONGEST * STEP_SIZE, step_size=STEP_SIZE, runtime=Runtime(loop="compiled")
).table.values[1:]
taken = [0.0]


class Floor:
    """Takes the place of the compiled loop."""

    def __init__(self, execution):
        for port in execution.ports:
            port.instance.step(0.0, STEP_SIZE)  # a native function leaves what comes first after a change to FMI
        self._calls = BareCalls(execution, sys.argv[4] == "native")

    def run(self, times, step_size, _inputs, rows, _stop):
        """Do one step from each of `times` but the last."""
        first = round(times[0] / step_size)
        begin = time.perf_counter()
        bare_steps(times, step_size, recorded[first : first + len(rows)], *self._calls.tables)
        taken[0] += time.perf_counter() - begin
        return len(rows), None


compiled_loop.CompiledLoop = Floor


def run(steps: int) -> float:
    """Run from the start; compiling does not count."""
    taken[0] = 0.0
    simulate(system, stop_time=steps * STEP_SIZE, step_size=STEP_SIZE, runtime=Runtime(loop="compiled"))
    return taken[0]


serve(run)
