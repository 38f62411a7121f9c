"""The plain loop: executes a schedule step by step over fmpy's functions. It is the oracle for any faster loop."""

import numpy as np
from numpy.typing import NDArray

from ..errors import TwipError
from .execution import Execution


class PythonLoop:
    """Runs the steps of a schedule in plain Python."""

    def __init__(self, execution: Execution):
        self._execution = execution
        self._row = execution.row
        self._driven = execution.driven.tolist()

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
        values, previous, clock = self._execution.values, self._execution.previous, self._execution.clock
        plan, every = self._execution.schedule, self._execution.ports
        arrays = (plan.destination, plan.source, plan.factor, plan.offset, plan.lead)  # faults change them between runs
        planned = list(enumerate(zip(*(a.tolist() for a in arrays), strict=True)))
        stages = [
            (
                planned[plan.stage_copies[s] : plan.stage_copies[s + 1]],
                [every[i] for i in plan.order[plan.stage_order[s] : plan.stage_order[s + 1]]],
            )
            for s in range(len(plan.stage_order) - 1)
        ]
        mappings = plan.mappings
        for k in range(len(rows)):
            if stop[0]:
                return k, None
            time, reached = float(times[k]), float(times[k + 1])
            for column, value in zip(self._driven, inputs[k].tolist(), strict=True):
                values[column] = value
            try:
                for copies, ports in stages:
                    for index, (destination, source, factor, offset, lead) in copies:
                        value = factor * values[source] + offset
                        if index in mappings:
                            mapped = mappings[index](int(value))
                            if mapped is None:
                                raise self._execution.schedule.refusal(index, value, float(clock[0]))
                            value = float(mapped)
                        if lead != 0.0:
                            before, previous[index] = float(previous[index]), value
                            value = value + lead * (value - before)
                        values[destination] = value
                    for port in ports:
                        clock[0] = time
                        port.set_inputs()
                        port.instance.step(time, step_size)
                        clock[0] = reached
                        port.get_outputs()
            except TwipError as failure:
                return k, failure
            rows[k] = self._row
        return len(rows), None
