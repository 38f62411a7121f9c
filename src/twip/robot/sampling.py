"""When a sampled block acts."""

from math import fabs, floor

from .kernel import kernel

EARLY = 1e-6
"""Share of a sample time by which a tick may come early."""
ROUNDING = 4.0 * 2.220446049250313e-16
"""Relative error that a few roundings leave in a time, four units in the last place."""


@kernel
def ticks_reached(time: float, start: float, sample_time: float, sample_offset: float) -> float:
    """Return how many of the ticks t_k = start + sample_offset + k sample_time, k = 0, 1, ..., have come at `time`.

    A block remembers the number that it has handled and acts in the communication step at whose end there are more.
    Ticks are counted from the start, never accumulated. A tick counts as reached from `EARLY` sample times and the
    rounding of the times before it, so that neither the rounding of `start + k h` nor that of a master that adds up
    its steps can postpone it by a step; nothing else may depend on when a run starts. A tick between two communication
    points is reached at the later one; several ticks within one step are reached together, at its end.

    time, start: instants in s; sample_time > 0, sample_offset >= 0: in s.
    """
    tolerance = EARLY * sample_time + ROUNDING * max(fabs(time), fabs(start))
    since = time - start - sample_offset + tolerance
    if since < 0.0:
        return 0.0
    return float(floor(since / sample_time)) + 1.0
