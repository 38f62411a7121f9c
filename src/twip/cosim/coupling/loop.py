"""The plain loop: executes a schedule step by step over fmpy's functions. It is the oracle for any faster loop."""

import numpy as np
from numpy.typing import NDArray

from ...errors import TwipError
from .execution import Execution
from .iterated_step import IteratedStep
from .plain_step import PlainStep


class PythonLoop:
    """Runs the steps of a schedule in plain Python."""

    def __init__(self, execution: Execution):
        self._execution = execution

    def run(
        self,
        times: NDArray[np.float64],
        step_size: float,
        inputs: NDArray[np.float64],
        rows: NDArray[np.float64],
        stop: NDArray[np.bool_],
    ) -> tuple[int, TwipError | None]:
        """Do one step from each of `times` (n + 1,) but the last, filling `rows` (n, columns).

        `inputs` (n, driven) are the driven values at the beginning of each step. Returns the number of finished steps,
        fewer than n if `stop` (1,) became true or a component failed, and the failure.
        """
        turn, row = self._execution.turn, self._execution.row
        kind = IteratedStep if self._execution.schedule.cycles else PlainStep
        step = kind(self._execution)  # anew: what the schedule says may have been changed since the last call
        for k in range(len(rows)):
            if stop[0]:
                return k, None
            before = int(turn[0])
            try:
                step.do(before + 1, (float(times[k]), float(times[k + 1])), step_size, inputs[k].tolist())
            except TwipError as failure:
                return k, failure
            turn[0] = before + 1
            rows[k] = row
        return len(rows), None
