"""Steady samples: current and speed where the drive torque pays for friction alone (paper, section 2.1)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .motion import motion
from .recording import Array, Recording
from .stretches import Stretch, constant_stretches

WINDOW = 1.0
"""Length of the window that makes one sample, in s."""
DRIFT = 0.02
"""Largest change of speed within a window, relative to the speed; what remains of it is corrected by the inertia."""
UNCORRECTED_DRIFT = 0.002
"""The same where no inertia is known to correct it."""
FEWEST_COUNTS = 20
"""Fewest encoder counts in a window."""
BATCHES = 10


@dataclass(frozen=True)
class SteadySamples:
    """Means over windows, all (n,): `current` [A], `speed` [rad/s], standard errors of both, `acceleration` [rad/s2].

    `recording` says which recording a sample is from, `offset_error` (recordings,) [A] the standard error of the zero
    of its current. Without `known_errors` the errors are weights only: their common scale comes from the scatter about
    the fit.
    """

    current: Array
    speed: Array
    current_error: Array
    speed_error: Array
    acceleration: Array
    recording: NDArray[np.int64]
    offset_error: Array
    known_errors: bool = True

    def __len__(self) -> int:
        return len(self.current)

    def where(self, chosen: NDArray[np.bool_]) -> "SteadySamples":
        """Return some of the samples; recordings keep their numbers."""
        return SteadySamples(
            self.current[chosen], self.speed[chosen], self.current_error[chosen], self.speed_error[chosen],
            self.acceleration[chosen], self.recording[chosen], self.offset_error, self.known_errors,
        )  # fmt: skip

    def towards(self, direction: int) -> "SteadySamples":
        """Return the samples at positive (1) or negative (-1) speed."""
        return self.where(self.speed * direction > 0.0)

    def uncorrected(self) -> "SteadySamples":
        """Return the samples that need no correction of their acceleration."""
        return self.where(np.abs(self.acceleration) * WINDOW <= UNCORRECTED_DRIFT * np.abs(self.speed))


@dataclass(frozen=True)
class Window:
    """A steady window of a stretch: its samples, the mean current [A] and the variance of that mean."""

    begin: int
    end: int
    current: float
    variance: float
    speed: float
    speed_error: float
    acceleration: float


def steady_windows(recording: Recording, stretch: Stretch) -> list[Window]:
    """Return the steady windows of a stretch, the last first; they end where the speed was not steady yet."""
    length = max(round(WINDOW / recording.interval), 40)
    found = []
    end = stretch.end
    while end - length >= stretch.begin:
        begin = end - length
        window = _window(recording, begin, end)
        if window is None:
            break
        found.append(window)
        end = begin
    return found


def _window(recording: Recording, begin: int, end: int) -> Window | None:
    moved = motion(recording, begin, end)
    duration = float(recording.time[end - 1] - recording.time[begin])
    too_slow = abs(moved.speed) * duration < FEWEST_COUNTS * recording.angle_step or moved.speed == 0.0
    if too_slow or moved.spread > DRIFT * abs(moved.speed):
        return None
    current = recording.current[begin:end]
    batches = np.array([part.mean() for part in np.array_split(current, BATCHES)])
    variance = float(np.var(batches, ddof=1) / BATCHES)
    return Window(begin, end, float(current.mean()), variance, moved.speed, moved.speed_error, moved.acceleration)


def steady_samples(recordings: Sequence[Recording]) -> SteadySamples:
    """Return the steady samples of some recordings.

    The error of a mean current is that of the batch means within the windows, pooled over a recording: batches see
    correlated noise too, and pooling makes a weight that does not follow the noise. The converter's rounding shifts all
    windows of a stretch alike: each gets its error times the root of their number, so that their mean has it once.
    """
    rows: list[tuple[float, float, float, float, float, int]] = []
    for number, recording in enumerate(recordings):
        parts = [steady_windows(recording, stretch) for stretch in constant_stretches(recording)]
        windows = [w for part in parts for w in part]
        if not windows:
            continue
        rounding = [recording.rounding_error * np.sqrt(len(part)) for part in parts for _ in part]
        error = float(np.sqrt(np.mean([w.variance for w in windows])))
        error = max(error, 1e-6 * max(abs(w.current) for w in windows))  # a log without noise still needs a weight
        rows += [
            (w.current, w.speed, float(np.hypot(error, rounded)), w.speed_error, w.acceleration, number)
            for w, rounded in zip(windows, rounding, strict=True)
        ]
    table = np.array(rows, np.float64).reshape(len(rows), 6)
    return SteadySamples(
        table[:, 0], table[:, 1], table[:, 2], table[:, 3], table[:, 4], table[:, 5].astype(np.int64),
        np.array([r.offset_error for r in recordings], np.float64),
    )  # fmt: skip


def given_samples(current: Array, speed: Array) -> SteadySamples:
    """Return samples that somebody else has averaged: equal weights, errors from the scatter about the fit."""
    n = len(current)
    return SteadySamples(
        current, speed, np.ones(n), np.zeros(n), np.zeros(n), np.zeros(n, np.int64), np.zeros(1), known_errors=False
    )


def joined(parts: Sequence[SteadySamples]) -> SteadySamples:
    """Return the samples of several sources as one; errors are known only if they are in all of them."""
    known = all(part.known_errors for part in parts)
    firsts = np.cumsum([0, *(len(part.offset_error) for part in parts)])
    errors = [part.current_error if known else np.ones(len(part)) for part in parts]
    return SteadySamples(
        np.concatenate([p.current for p in parts]), np.concatenate([p.speed for p in parts]), np.concatenate(errors),
        np.concatenate([p.speed_error if known else np.zeros(len(p)) for p in parts]),
        np.concatenate([p.acceleration for p in parts]),
        np.concatenate([p.recording + first for p, first in zip(parts, firsts, strict=False)]),
        np.concatenate([p.offset_error for p in parts]), known,
    )  # fmt: skip
