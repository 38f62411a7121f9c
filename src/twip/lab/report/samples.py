"""Packs the samples of a report: every row is kept where it fits, so that zooming in shows what was logged.

    code  = 1 + round((value - low) / step)   with step = (high - low) / LEVELS; 0 stands for no number
    bytes = the differences of neighbouring codes, all lowest bytes first, then the next ones; everything deflated

The error is at most half a step, 5e-7 of a signal's range. A log too long for `BUDGET` is thinned out: of every group
of rows the smallest and the largest value are kept, in their order.
"""

import zlib
from base64 import b64encode
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..numbers import Array

LEVELS = 1 << 20
TIME_LEVELS = (1 << 32) - 2
BUDGET = 5_500_000
"""Bytes of all samples packed; with BokehJS (1.4 MB) and base64 the file stays below 10 MB."""


@dataclass
class Samples:
    """The series of a report; `add` returns a series' index. `times` [s] (rows,) belong to a log, by its index."""

    times: Sequence[Array]
    _series: list[tuple[int, Array]] = field(default_factory=list)

    def add(self, log: int, values: Array) -> int:
        """Take the values (rows,) of a series of a log."""
        for index, (owner, known) in enumerate(self._series):
            if owner == log and known is values:
                return index
        self._series.append((log, values))
        return len(self._series) - 1

    def packed(self) -> tuple[dict[str, Any], str]:
        """Return what describes the samples, as JSON takes it, and the samples as base64 text."""
        rows = max((len(times) for times in self.times), default=0)
        group = 1
        while True:
            about, data = self._pack(group)
            if len(data) <= BUDGET or group >= rows:
                return about, b64encode(data).decode("ascii")
            group = max(group + 1, 2 * group, int(group * len(data) / BUDGET))

    def _pack(self, group: int) -> tuple[dict[str, Any], bytes]:
        planes: list[bytes] = []
        logs = []
        for times in self.times:
            kept = thinned_times(times, group) if group > 1 else times
            about: dict[str, Any] = {"count": len(kept), "start": 0.0, "step": 0.0}
            if len(kept):
                about["start"] = float(kept[0])
            if len(kept) > 1:
                step = float(kept[-1] - kept[0]) / (len(kept) - 1)
                if np.max(np.abs(kept[0] + step * np.arange(len(kept)) - kept)) < 1e-8:
                    about["step"] = step
                else:
                    about["coded"] = coded(kept, TIME_LEVELS, planes)
            logs.append(about)
        series = []
        for log, values in self._series:
            kept = thinned(values, group) if group > 1 else values
            series.append({"log": log, **coded(kept, LEVELS, planes)})
        interval = max((float(t[-1] - t[0]) / (len(t) - 1) for t in self.times if len(t) > 1), default=0.0)
        return {"logs": logs, "series": series, "group": group * interval if group > 1 else 0.0}, zlib.compress(
            b"".join(planes), 9 if group == 1 else 6
        )


def coded(values: Array, levels: int, planes: list[bytes]) -> dict[str, float]:
    """Append the four byte planes of the values to `planes`, and return what turns codes into values again."""
    finite = np.isfinite(values)
    some = values[finite]
    low = float(np.min(some)) if some.size else 0.0
    high = float(np.max(some)) if some.size else 0.0
    step = (high / levels - low / levels) or 1.0
    with np.errstate(invalid="ignore", over="ignore"):
        codes = np.where(finite, 1.0 + np.rint((values - low) / step), 0.0)
    whole = codes.astype(np.uint64).astype(np.uint32)
    differences = np.diff(whole, prepend=np.uint32(0)).astype("<u4")
    planes.append(differences.view(np.uint8).reshape(-1, 4).T.tobytes())
    return {"low": low, "step": step}


def thinned_times(times: Array, group: int) -> Array:
    """Return two times for every group of rows: its beginning and its middle."""
    return np.concatenate([pair for part in _groups(times, group) for pair in ([part[0]], [part[len(part) // 2]])])


def thinned(values: Array, group: int) -> Array:
    """Return the smallest and largest value of every group of rows, the earlier one first; NaN where none is finite."""
    whole = len(values) // group * group
    blocks = values[:whole].reshape(-1, group)
    pairs = [_extremes(blocks)] if whole else []
    if whole < len(values):
        pairs.append(_extremes(values[None, whole:]))
    return np.concatenate(pairs).reshape(-1) if pairs else np.zeros(0)


def _extremes(blocks: NDArray[np.float64]) -> NDArray[np.float64]:
    none = ~np.isfinite(blocks)
    low = np.argmin(np.where(none, np.inf, blocks), axis=1)
    high = np.argmax(np.where(none, -np.inf, blocks), axis=1)
    ends = np.sort(np.stack([low, high], axis=1), axis=1)
    return np.take_along_axis(blocks, ends, axis=1)


def _groups(values: Array, group: int) -> Iterator[Array]:
    return (values[i : i + group] for i in range(0, len(values), group))
