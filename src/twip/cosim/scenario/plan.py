"""What is done to a system during a run, as plain data that has been checked: time series for its open inputs,
parameters that change, faults of its connections.

Everything takes effect in the steps that begin at or after its time: an event at time T at the first communication
point t with t + 1e-9 step ≥ T, the rule by which rows of input files count as reached.
"""

from dataclasses import dataclass

from ..model.time_grid import TimeGrid
from ..values.written import StartValue
from .faults.base import Fault
from .inputs import EARLY, NO_INPUTS, InputSeries


@dataclass(frozen=True)
class ParameterChange:
    """A parameter that gets a new value before the step `step`."""

    time: float
    """In s."""
    step: int
    component: int
    """Index in the order of the file."""
    name: str
    value: StartValue

    def __str__(self) -> str:
        unit = self.value.variable.unit
        return f"parameter {self.name} = {self.value.value}{f' {unit.name}' if unit else ''}"


@dataclass(frozen=True)
class Scenario:
    """What is done to a system during one run."""

    inputs: InputSeries = NO_INPUTS
    changes: tuple[ParameterChange, ...] = ()
    """By time, those of one time in the order of the file."""
    faults: tuple[Fault, ...] = ()
    """Those of one connection act one after the other, in this order."""
    warnings: tuple[str, ...] = ()

    def described(self) -> dict[str, str]:
        """Return each change and fault in words, for the comparison of two runs."""
        lines = {f"parameter change {i}": f"{change} at {change.time!r} s" for i, change in enumerate(self.changes)}
        for fault in self.faults:
            begin, end = (
                word if t is None else f"{t!r} s" for t, word in zip(fault.times, ("start", "end"), strict=True)
            )
            lines[fault.name] = f"{fault} from {begin} to {end}"
        return lines


def point_of(time: float, grid: TimeGrid) -> int:
    """Return the number of the communication point at which something with this `time` in s takes effect; the number of
    all steps if that would be at the stop time or later.
    """
    if time >= grid.stop:
        return grid.steps
    point = max(0, int((time - grid.start) / grid.step_size) - 1)
    while point < grid.steps and grid.times(point, 0)[0] + EARLY * grid.step_size < time:
        point += 1
    return point
