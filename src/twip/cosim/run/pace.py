"""Real-time pacing: rows are delivered when the wall clock reaches their time.

A run in real time is cut into chunks of at most `PERIOD` of wall time. A chunk is due at

    deadline = begin + (time - start) / factor        begin: wall time at which the steps began, in s
                                                      time: simulated time at the end of the chunk, in s

so that a late chunk moves no later deadline: the run catches up, and never drifts.
"""

import math
import time
from dataclasses import dataclass
from typing import Protocol

from ...errors import TwipError
from .interrupt_flag import InterruptFlag

PERIOD = 0.01
"""Longest wall time between two deliveries, in s, unless one step takes longer."""
_NAP = 0.1
"""Longest sleep in s before the interrupt flag is looked at again."""


class Clock(Protocol):
    """What a pacer needs of a clock."""

    def now(self) -> float:
        """Return a time in s that never goes back."""

    def sleep(self, duration: float) -> None:
        """Return about `duration` s later."""


class WallClock:
    """The computer's clock."""

    def now(self) -> float:
        """Return the time in s since some moment."""
        return time.perf_counter()

    def sleep(self, duration: float) -> None:
        """Sleep for `duration` s."""
        time.sleep(duration)


@dataclass(frozen=True)
class RealTime:
    """How well a run kept pace with the wall clock."""

    factor: float
    """Simulated seconds per second, as asked for."""
    deadlines: int
    """One per chunk."""
    missed: int
    """Chunks that were not computed by their deadline."""
    worst_lateness: float
    """Most by which a chunk was late, in s; 0 if none was."""

    def __str__(self) -> str:
        kept = f"{self.missed} of {self.deadlines} deadlines missed" + (
            f", at worst by {1e3 * self.worst_lateness:.3g} ms" if self.missed else ""
        )
        return f"{kept} (factor {self.factor:g})"


class Pacer:
    """Holds a run back to `factor` simulated seconds per second of a clock."""

    def __init__(self, factor: float, clock: Clock | None = None):
        """Raise `TwipError` for a factor that is no positive number."""
        if not (math.isfinite(factor) and factor > 0.0):
            raise TwipError(f"real-time factor {factor!r} must be a positive number (simulated seconds per second)")
        self.factor = factor
        self._clock = clock or WallClock()
        self._start = self._begin = self._worst = 0.0
        self._deadlines = self._missed = 0

    def start(self, time: float) -> None:
        """Begin now with the simulated time `time` in s."""
        self._start, self._begin = time, self._clock.now()

    def chunk(self, step_size: float) -> int:
        """Return the most steps of `step_size` s between two deadlines, at least 1."""
        return max(1, int(min(PERIOD * self.factor / step_size, 2.0**31)))

    def wait(self, time: float, interrupted: InterruptFlag) -> None:
        """Return when the simulated `time` in s is due, at once if that has passed or as soon as interrupted."""
        deadline = self._begin + (time - self._start) / self.factor
        early = deadline - self._clock.now()
        self._deadlines += 1
        if early < 0.0:
            self._missed += 1
            self._worst = max(self._worst, -early)
        while early > 0.0 and not interrupted:
            self._clock.sleep(min(early, _NAP))
            early = deadline - self._clock.now()

    @property
    def report(self) -> RealTime:
        """How it went so far."""
        return RealTime(self.factor, self._deadlines, self._missed, self._worst)
