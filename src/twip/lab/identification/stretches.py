"""Finds the stretches of a recording in which the current is constant."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from .recording import Array, Recording

BATCH = 0.05
"""Time over which the current is averaged before it is compared, in s."""
JUMP = 6.0
"""A batch belongs to the next stretch from this many standard deviations of a batch's mean on."""
SMALLEST_JUMP = 1e-3
"""Smallest change that ends a stretch, relative to the largest current: what a current drive leaves."""
SHORTEST = 0.3
"""Shortest stretch of use, in s."""


@dataclass(frozen=True)
class Stretch:
    """Samples `begin` to `end` (exclusive) of a recording, all at one current."""

    begin: int
    end: int


def batch_size(recording: Recording) -> int:
    """Return the samples in a batch."""
    return max(round(BATCH / recording.interval), 4)


def batch_means(values: Array, size: int) -> Array:
    """Return the means over whole batches of `size` samples; the rest is left out."""
    count = len(values) // size
    return np.asarray(values[: count * size].reshape(count, size).mean(axis=1), np.float64)


def constant_stretches(recording: Recording) -> list[Stretch]:
    """Return the stretches of constant current, their first and last batch left out because a jump may be in them.

    The noise of a batch's mean is estimated from the differences of neighbours, by their median, so that jumps do not
    count. What a batch is too noisy to show is found in the means of many: see `_changes`.
    """
    size = batch_size(recording)
    means = batch_means(recording.current, size)
    if len(means) < 4:
        return []
    noise = 1.4826 * float(np.median(np.abs(np.diff(means)))) / np.sqrt(2.0)
    limit = max(JUMP * noise, SMALLEST_JUMP * float(np.max(np.abs(means))))
    edges, first, total = [0], 0, float(means[0])
    for index, mean in enumerate(means[1:].tolist(), 1):
        count = index - first
        if abs(mean - total / count) > limit * np.sqrt(1.0 + 1.0 / count):
            edges.append(index)
            first, total = index, 0.0
        total += mean
    edges.append(len(means))
    smallest = SMALLEST_JUMP * float(np.max(np.abs(means)))
    edges += [edge for begin, end in pairwise(edges) for edge in _changes(means, begin, end, noise, smallest)]
    edges.sort()
    shortest = SHORTEST / (size * recording.interval)
    return [
        Stretch((begin + 1) * size, (end - 1) * size) for begin, end in pairwise(edges) if end - begin - 2 >= shortest
    ]


def _changes(means: Array, begin: int, end: int, noise: float, smallest: float) -> list[int]:
    """Return where the level changes between the batches `begin` and `end` although no single batch shows it.

    The likeliest place of one change is where the mean before and the mean after differ most in standard deviations
    (maximum likelihood for white noise); from `JUMP` on and a difference of `smallest` it is one, and both sides are
    searched in turn. A coarse sensor's staircase is cut into its steps so, which would else pass as one current.
    """
    count = end - begin
    if count < 4:
        return []
    before = np.arange(1, count)
    sums = np.cumsum(means[begin:end])
    difference = np.abs(sums[:-1] / before - (sums[-1] - sums[:-1]) / (count - before))
    deviation = difference / np.sqrt(1.0 / before + 1.0 / (count - before))
    place = int(np.argmax(deviation))
    if deviation[place] <= JUMP * noise or difference[place] <= smallest:
        return []
    edge = begin + place + 1
    return [*_changes(means, begin, edge, noise, smallest), edge, *_changes(means, edge, end, noise, smallest)]
