"""Communication steps whose size follows the error: step doubling with rollback.

A step of size h is done at once and, from the same state, in two halves. The difference of the outputs that are states
estimates the local error; the halves are what counts, and give a row each. With the weighted error

    e = max |y_halves - y_whole| / (tolerance * max(|y_halves|, nominal))

a step with e > 1 is taken back. The next one has the size h * 0.9 * e**(-1 / (order + 1)), within limits; the order is
that of the coupling, 2 where inputs are taken at mid-step and else 1. E. Hairer, S. P. Nørsett, G. Wanner, Solving
Ordinary Differential Equations I, section II.4 (there with the extrapolated result instead of the halves, and the
difference divided by 2**order - 1).
"""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ...errors import TwipError
from ..fmus.component import ComponentError
from ..model.system import System
from ..model.time_grid import TimeGrid
from ..values.types import family
from .coupling import Coupling
from .execution import Execution
from .iterated_step import IteratedStep
from .plain_step import PlainStep
from .rollback import Snapshot
from .scheduling import feedthrough_of

_SAFETY = 0.9
_SMALLEST, _LARGEST = 0.2, 4.0
"""Limits of the change of the size from one step to the next."""
_ROUNDING = 1e-9
"""Share of a step by which it may miss the next event and count as reaching it."""


class DrivenInputs(Protocol):
    """What the caller's inputs write at a time."""

    @property
    def columns(self) -> NDArray[np.int32]:
        """The columns that they write (columns,)."""

    def at(self, times: NDArray[np.float64], step_size: float) -> NDArray[np.float64]:
        """Return the values (len(times), columns) in the steps of `step_size` that begin at `times`, in s."""


def state_outputs(system: System, driven: NDArray[np.int32]) -> NDArray[np.int64]:
    """Return the columns of the continuous Real outputs that no connected or driven input changes at once; all
    continuous Real outputs if there are none.
    """
    fed = {copy.destination for copy in system.copies} | set(driven.tolist())
    states: list[int] = []
    others: list[int] = []
    for component in system.components:
        first = system.first_column[component.name]
        taken = {v.name for i, v in enumerate(component.inputs) if first + i in fed}
        for column, output in enumerate(component.outputs, first + len(component.inputs)):
            if family(output.recorded_type) == "Real" and output.variability == "continuous":
                at_once = feedthrough_of(component, output.name)
                (others if at_once & taken else states).append(column)
    return np.array(states or others, np.int64)


class VariableLoop:
    """Runs steps of variable size, each of them a plain or an iterated one."""

    def __init__(self, execution: Execution, grid: TimeGrid, coupling: Coupling, system: System, inputs: DrivenInputs):
        if coupling.control is None:
            raise ValueError("the coupling has no step control")
        self.time = grid.start
        """Time in s that is reached."""
        self.steps = VariableSteps()
        self._control = coupling.control
        self._exponent = -1.0 / (3.0 if coupling.mid_step else 2.0)
        self._size = min(grid.step_size, grid.stop - grid.start)
        self._execution = execution
        self._step = (IteratedStep if execution.schedule.cycles else PlainStep)(execution)
        self._inputs = inputs
        self._watched = state_outputs(system, inputs.columns)
        self._every = list(range(len(execution.ports)))
        execution.reached[:] = grid.start
        execution.samples[1], execution.samples[3] = grid.start, grid.start - self._size
        for port in execution.ports:
            port.instance.expect_rollback()

    def run(
        self, until: float, most: int, stop: NDArray[np.bool_]
    ) -> tuple[list[float], list[NDArray[np.float64]], TwipError | None]:
        """Go to the time `until` in s at most, exactly. Return the times and rows of at least one and about `most`
        communication steps, fewer if `stop` (1,) became true or a component failed, and the failure.
        """
        times: list[float] = []
        rows: list[NDArray[np.float64]] = []
        while self.time < until and len(times) < most and not stop[0]:
            try:
                taken = self._next(until)
            except TwipError as failure:
                return times, rows, failure
            for time, row in taken:
                self.steps.smallest = min(self.steps.smallest, time - self.time)
                self.steps.largest = max(self.steps.largest, time - self.time)
                self.time = time
                times.append(time)
                rows.append(row)
        return times, rows, None

    def _next(self, until: float) -> list[tuple[float, NDArray[np.float64]]]:
        """Do two halves of a step whose error is small enough; return the times and rows of their ends."""
        begin, execution = self.time, self._execution
        grown = _LARGEST
        while True:
            left = until - begin
            ends_there = self._size >= left * (1.0 - _ROUNDING)
            # two steps to the event rather than a long one and a tiny one
            size = left if ends_there else min(self._size, 0.5 * left)
            end = until if ends_there else begin + size
            kept = [a.copy() for a in (execution.row, execution.samples, execution.reached, execution.since)]
            iterations = execution.iterations
            snapshot = Snapshot(execution, self._every)
            refused: TwipError | None = None
            taken: list[tuple[float, NDArray[np.float64]]] = []
            try:
                try:
                    self._do(begin, end)
                    whole = execution.row[self._watched]
                    self._put_back(snapshot, kept)
                    middle = begin + 0.5 * (end - begin)
                    for first, last in ((begin, middle), (middle, end)):
                        self._do(first, last)
                        taken.append((last, execution.row.copy()))
                    error = self._error(whole)
                except TwipError as failure:
                    if isinstance(failure, ComponentError) and not failure.repeatable:
                        raise
                    error, refused = math.inf, failure
                if error <= 1.0:
                    proposed = size * min(grown, _SAFETY * max(error, 1e-12) ** self._exponent)
                    if size < self._size:  # cut short by an event, which says little of longer steps
                        proposed = max(proposed, self._size)
                    self._size = max(self._control.minimum, min(self._control.maximum, proposed))
                    return taken
                if size <= self._control.minimum:
                    raise refused or self._too_large(begin, end, error)
                self._put_back(snapshot, kept)
                execution.iterations = iterations
            finally:
                snapshot.free()
            change = 0.5 if math.isinf(error) else max(_SMALLEST, _SAFETY * error**self._exponent)
            self._size, grown = max(size * change, self._control.minimum), 1.0
            self.steps.taken_back += 1

    def _do(self, begin: float, end: float) -> None:
        driven = self._inputs.at(np.array([begin]), end - begin)[0].tolist()
        self._step.do(1, (begin, end), end - begin, driven, (begin, end))

    def _put_back(self, snapshot: Snapshot, kept: list[NDArray[np.float64]]) -> None:
        execution = self._execution
        execution.clock[0] = self.time
        snapshot.restore()
        for array, values in zip(
            (execution.row, execution.samples, execution.reached, execution.since), kept, strict=True
        ):
            array[:] = values

    def _error(self, whole: NDArray[np.float64]) -> float:
        """Return the largest weighted difference of the halves, which have just been done, from the whole step."""
        halves = self._execution.row[self._watched]
        return float(np.max(np.abs(halves - whole) / self._weights(halves), initial=0.0))

    def _weights(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        nominal = self._execution.schedule.nominal[self._watched]
        weights: NDArray[np.float64] = self._control.tolerance * np.maximum(np.abs(values), nominal)
        return weights

    def _too_large(self, begin: float, end: float, error: float) -> TwipError:
        return TwipError(
            f"the step from t = {begin:.12g} s cannot keep the tolerance {self._control.tolerance:g}: with the smallest"
            f" step, {end - begin:.3g} s, the error is {error:.3g} times as large (a jump in an output, or a tolerance"
            " below what the FMUs can do; a smaller minimum step or a larger tolerance may help)"
        )


@dataclass
class VariableSteps:
    """What the steps of a run were like."""

    smallest: float = math.inf
    """Smallest communication step in s; one that had to end at an event counts too."""
    largest: float = 0.0
    taken_back: int = 0
    """Steps that had to be repeated with a smaller size."""

    def __str__(self) -> str:
        return f"{self.smallest:.3g} s to {self.largest:.3g} s, {self.taken_back} taken back"
