"""What a bench or robot has recorded, in SI units, whatever file it came from."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...errors import TwipError
from .quantization import mean_error

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Recording:
    """One motor's time series: `time` [s], `current` [A], and `angle` [rad] or `speed` [rad/s] of its shaft, all (n,).

    `angle_step` [rad] is the encoder's count; the angle is what the counts say, known to one count. Positive values
    mean forward. `offset_error` [A] is the standard error of the current's zero, which is common to all its samples.
    """

    name: str
    time: Array
    current: Array
    angle: Array | None = None
    speed: Array | None = None
    angle_step: float = 0.0
    offset_error: float = 0.0
    rounding: float | None = None
    """The `rounding_error`, where it is known from elsewhere."""

    @cached_property
    def rounding_error(self) -> float:
        """What the steps of the current's converter leave in the mean of a stretch, a standard error in A."""
        return mean_error(self.current) if self.rounding is None else self.rounding

    @property
    def interval(self) -> float:
        """Median time between samples, in s."""
        return float(np.median(np.diff(self.time)))

    def zeroed(self, duration: float) -> "Recording":
        """Return the recording with its mean current over the first `duration` s, motor switched off, subtracted.

        Raises TwipError if the shaft turns meanwhile or there are less than 20 samples.
        """
        off = self.time - self.time[0] < duration
        if np.count_nonzero(off) < 20:
            raise TwipError(f"{self.name}: the first {duration:g} s hold less than 20 samples to zero the current with")
        moved = np.ptp(self.angle[off]) if self.angle is not None else 0.0
        fastest = np.max(np.abs(self.speed[off])) if self.speed is not None else 0.0
        if moved > 2.0 * self.angle_step or (self.speed is not None and fastest > 0.05 * np.max(np.abs(self.speed))):
            raise TwipError(f"{self.name}: the shaft turns in the first {duration:g} s, so its current is no zero")
        batches = np.array([part.mean() for part in np.array_split(self.current[off], 20)])
        scatter = float(np.std(batches, ddof=1) / np.sqrt(20))
        error = float(np.hypot(scatter, self.rounding_error))
        return replace(self, current=self.current - float(np.mean(self.current[off])), offset_error=error)


def read_by_one_sensor(recordings: Sequence[Recording]) -> list[Recording]:
    """Return recordings with the largest rounding error of any of them, in the zero of their current too.

    One whose currents happen to lie far from the edges between two steps shows no noise, but is no more exact.
    """
    worst = max((recording.rounding_error for recording in recordings), default=0.0)
    return [
        replace(r, rounding=worst, offset_error=float(np.sqrt(r.offset_error**2 + worst**2 - r.rounding_error**2)))
        for r in recordings
    ]
