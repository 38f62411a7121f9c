"""The plain loop: executes a schedule step by step over fmpy's functions. It is the oracle for any faster loop."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from twip.cosim.component import Instance
from twip.cosim.ports import Ports, Vector
from twip.cosim.schedule import Schedule
from twip.errors import TwipError


class PythonLoop:
    """Runs the steps of a schedule; the value vector holds the row of the last finished step."""

    def __init__(
        self,
        schedule: Schedule,
        instances: list[Instance],
        ports: list[Ports],
        values: Vector,
        driven: NDArray[np.int32],
    ):
        copies = list(
            zip(
                schedule.destination.tolist(),
                schedule.source.tolist(),
                schedule.factor.tolist(),
                schedule.offset.tolist(),
                strict=True,
            )
        )
        self._stages = [
            (
                copies[schedule.stage_copies[s] : schedule.stage_copies[s + 1]],
                [ports[i] for i in schedule.order[schedule.stage_order[s] : schedule.stage_order[s + 1]]],
            )
            for s in range(len(schedule.stage_order) - 1)
        ]
        self._instances = instances
        self._values = values
        self._row = np.ctypeslib.as_array(values)
        self._driven = driven.tolist()

    def run(
        self,
        times: NDArray[np.float64],
        step_size: float,
        inputs: NDArray[np.float64],
        rows: NDArray[np.float64],
        stop: Callable[[], bool],
    ) -> tuple[int, TwipError | None]:
        """Do one step from each of `times` (n + 1,) but the last, filling `rows` (n, columns).

        `inputs` (n, driven) are the driven values at the beginning of each step. Returns the number of finished steps,
        fewer than n if `stop` became true or a component failed, and the failure.
        """
        values = self._values
        for k in range(len(rows)):
            if stop():
                return k, None
            time, reached = float(times[k]), float(times[k + 1])
            for column, value in zip(self._driven, inputs[k].tolist(), strict=True):
                values[column] = value
            try:
                for copies, ports in self._stages:
                    for destination, source, factor, offset in copies:
                        values[destination] = factor * values[source] + offset
                    for port in ports:
                        port.instance.time = time
                        port.set_inputs()
                        port.step(time, step_size)
                        port.instance.time = reached
                        port.get_outputs()
            except TwipError as failure:
                return k, failure
            rows[k] = self._row
        return len(rows), None
