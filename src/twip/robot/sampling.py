"""When a sampled block acts."""

from math import fabs, floor

from .kernel import kernel


@kernel
def ticks_reached(time: float, start: float, sample_time: float, sample_offset: float) -> float:
    """Return how many of the ticks t_k = start + sample_offset + k sample_time, k = 0, 1, ..., have come at `time`.

    A block remembers the number that it has handled and acts in the communication step at whose end there are more.
    Ticks are counted from the start, never accumulated. A tick counts as reached from 1e-9 (relative to time and
    sample time) before it, so that the rounding of `start + k h` cannot postpone it by a step. A tick between two
    communication points is reached at the later one; several ticks within one step are reached together, at its end.

    time, start: instants in s; sample_time > 0, sample_offset >= 0: in s.
    """
    tolerance = 1e-9 * (sample_time + fabs(time))
    since = time - start - sample_offset + tolerance
    if since < 0.0:
        return 0.0
    return float(floor(since / sample_time)) + 1.0
