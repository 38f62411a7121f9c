"""Start, stop and step of a run: from the caller, else from the system's description, else from the FMUs."""

import itertools
import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...errors import TwipError
from .system import System

_DIVIDES = 1e-9
"""Relative deviation of a whole number of steps from the interval that still counts as rounding."""
_MAXIMUM_STEPS = 2**40
_RESOLUTION = 4.0
"""Fewest distances between neighbouring floating-point times that a step may span."""


@dataclass(frozen=True)
class TimeGrid:
    """Equal steps from `start` to `stop`, in s."""

    start: float
    stop: float
    step_size: float
    steps: int
    varies: bool = False
    """Whether the steps are of variable size; then `step_size` is that of the first."""

    def times(self, first: int, count: int) -> NDArray[np.float64]:
        """Return the times of the points `first` to `first + count`: `start + k * step_size`, the last exactly
        `stop`.
        """
        times = self.start + np.arange(first, first + count + 1, dtype=np.float64) * self.step_size
        if first + count == self.steps:
            times[-1] = self.stop
        return times

    @property
    def resolution(self) -> float:
        """Shortest step in s that floating-point times of this interval can hold."""
        return _resolution(self.start, self.stop)

    def events(self, times: Iterable[float]) -> list[float]:
        """Return those of `times` in s that lie between start and stop, in order, and then the stop time. Of times
        closer than the resolution, such as 0.3 and 0.1 * 3, the last stands for all.
        """
        points = [*sorted(time for time in times if time < self.stop), self.stop]
        apart = [time for time, after in itertools.pairwise(points) if after - time >= self.resolution]
        return [*(time for time in apart if time - self.start >= self.resolution), self.stop]


def _resolution(start: float, stop: float) -> float:
    return _RESOLUTION * math.ulp(max(abs(start), abs(stop)))


def time_problems(start: float | None, stop: float | None, step_size: float | None) -> list[str]:
    """Return what is wrong with times and a step in s by themselves, of what is not None a line for each."""
    problems = []
    if stop is not None and start is not None:
        if not (math.isfinite(start) and math.isfinite(stop) and stop > start):
            problems.append(f"stop time {stop!r} s must be later than start time {start!r} s")
    else:
        for name, time in (("start", start), ("stop", stop)):
            if time is not None and not math.isfinite(time):
                problems.append(f"{name} time {time!r} s must be a finite number")
    if step_size is not None and not (math.isfinite(step_size) and step_size > 0.0):
        problems.append(f"step size {step_size!r} s must be a positive number")
    return problems


def time_grid(
    system: System,
    start: float | None,
    stop: float | None,
    step_size: float | None,
    tolerance: float | None = None,
) -> TimeGrid:
    """Complete and check the arguments. Raises `TwipError` that names the numbers, with a line per problem.

    With a `tolerance` above 0, given or proposed, steps are variable: `step_size` is that of the first, and need not
    divide the interval.
    """
    proposed = system.experiment
    start = next((float(t) for t in (start, proposed.start_time) if t is not None), 0.0)
    stop = next((float(t) for t in (stop, proposed.stop_time) if t is not None), None)
    problems = []
    if stop is None:
        problems.append(f"stop time is not given, and {system.file} has no DefaultExperiment with one")
    if step_size is None:
        fmu_steps = [c.fmu.step_size for c in system.components if c.fmu.step_size is not None]
        said = proposed.step_size
        step_size = said if said is not None else min(fmu_steps, default=None)
    if step_size is None:
        problems.append(f"step size is not given, and neither {system.file} nor any FMU proposes one")
    step_size = None if step_size is None else float(step_size)
    problems += time_problems(start, stop, step_size)
    if problems or stop is None or step_size is None:
        raise TwipError(problems)
    ratio = (stop - start) / step_size
    if ratio > _MAXIMUM_STEPS:
        raise TwipError(f"step size {step_size!r} s is too small for the interval from {start!r} s to {stop!r} s")
    if step_size < _resolution(start, stop):
        latest = max(abs(start), abs(stop))
        raise TwipError(
            f"step size {step_size!r} s is below the resolution of time near {latest!r} s ({math.ulp(latest):.2g} s)"
        )
    if tolerance if tolerance is not None else proposed.algorithm.tolerance:
        return TimeGrid(start, stop, step_size, max(1, math.ceil(ratio)), varies=True)
    steps = round(ratio)
    if steps < 1 or abs(steps * step_size - (stop - start)) > _DIVIDES * (stop - start):
        raise TwipError(
            f"step size {step_size!r} s does not divide the interval from {start!r} s to {stop!r} s ({ratio:.9g} steps)"
        )
    return TimeGrid(start, stop, step_size, steps)
