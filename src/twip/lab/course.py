"""The verdict on a run of the robot, formed while it runs: a sink that keeps no rows, however long the run is."""

from collections.abc import Sequence
from math import inf, isnan, nan

import numpy as np

from ..cosim import Channel, columns
from .metrics import PITCH_LIMIT, SETTLED_AFTER, Verdict
from .numbers import Array

SIGNALS = ("plant.pitch", "plant.pitch_rate", "plant.fallen")


class Course:
    """Takes the rows of the robot's run as they come; `verdict` is that of `metrics.judge` on all of them."""

    def __init__(self, channels: Sequence[Channel], continued: bool = False):
        """`continued`: the rows go on from a checkpoint instead of the run's start."""
        names = columns(channels)
        self._columns = [names.index(name) for name in SIGNALS]
        self._continued = continued
        self._last: tuple[Array, Array] | None = None
        """Time (1,) and signals (1, 3) of the last row, from which the next rows go on."""
        self._began = nan
        self._released_before = False
        self._release, self._fallen, self._settled, self._peak = nan, inf, nan, nan

    def write(self, times: Array, rows: Array) -> None:
        """Take rows."""
        if not len(times):
            return
        found = rows[:, self._columns]
        if self._last is None:
            self._began = float(times[0])
            self._released_before = self._continued and bool(found[0, 1] != 0.0)
        else:
            times, found = np.concatenate([self._last[0], times]), np.concatenate([self._last[1], found])
        self._last = times[-1:].copy(), found[-1:].copy()
        pitch, rate, fallen = found.T
        if self._fallen == inf and np.any(fallen > 0.5):
            self._fallen = float(times[np.argmax(fallen > 0.5)])
        if isnan(self._release) and not self._released_before and np.any(rate != 0.0):
            self._release = self._settled = float(times[max(int(np.argmax(rate != 0.0)) - 1, 0)])
        if not isnan(self._release):
            self._take_released(times, np.abs(pitch))

    def _take_released(self, times: Array, pitch: Array) -> None:
        """Follow the magnitude of the pitch from the release on."""
        outside = np.flatnonzero((pitch > PITCH_LIMIT) & (times >= self._release))
        if outside.size:
            after = int(outside[-1]) + 1
            self._settled = float(times[after]) if after < len(times) else inf
        steady = pitch[times >= self._release + SETTLED_AFTER]
        if steady.size:
            peak = float(np.max(steady))
            self._peak = peak if isnan(self._peak) else max(self._peak, peak)

    def event(self, time: float, level: str, source: str, message: str) -> None:
        """Messages do not enter the verdict."""

    def close(self) -> None:
        """Nothing is kept open."""

    def verdict(self) -> Verdict | None:
        """Return the verdict on the rows so far; None without rows. Its metrics are those that it rests on."""
        if self._last is None:
            return None
        fell = self._fallen < inf
        judged = not fell and not isnan(self._peak)
        metrics = {
            "balanced": nan if self._released_before and not fell else float(judged and self._peak < PITCH_LIMIT),
            "fallen_at": self._fallen,
            "release_time": self._release,
            "peak_pitch_settled": self._peak if judged else nan,
            "settling_time": self._settled - self._release if judged else nan,
        }
        return Verdict(metrics, self._began, float(self._last[0][0]), self._released_before)
