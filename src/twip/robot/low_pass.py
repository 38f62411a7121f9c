"""Low-pass filters for sampled signals."""

from math import pi, sqrt

from .elementary import tan
from .kernel import kernel


@kernel
def second_order(
    value: float, first: float, second: float, bandwidth: float, sample_time: float
) -> tuple[float, float, float]:
    """Return output and both memories of a second-order Butterworth low-pass for one sample (paper, section 4.4).

        H(s) = 1 / (s^2 + sqrt(2) s + 1), s in units of 2 pi bandwidth, made discrete by the bilinear transform so
        that the gain at `bandwidth` is exactly 1 / sqrt(2); transposed direct form II: y = b0 x + d1,   d1 := b1 x -
        a1 y + d2,   d2 := b2 x - a2 y

    value x in any unit, first d1 and second d2 in the same; bandwidth in Hz, below half the sampling rate;
    sample_time in s.
    """
    k = tan(pi * bandwidth * sample_time)
    scale = 1.0 / (1.0 + sqrt(2.0) * k + k * k)
    b0 = k * k * scale
    a1 = 2.0 * (k * k - 1.0) * scale
    a2 = (1.0 - sqrt(2.0) * k + k * k) * scale
    y = b0 * value + first
    return y, 2.0 * b0 * value - a1 * y + second, b0 * value - a2 * y


@kernel
def second_order_rest(value: float, bandwidth: float, sample_time: float) -> tuple[float, float]:
    """Return the memories with which `second_order` has held the constant input `value` for ever."""
    k = tan(pi * bandwidth * sample_time)
    scale = 1.0 / (1.0 + sqrt(2.0) * k + k * k)
    b0 = k * k * scale
    a2 = (1.0 - sqrt(2.0) * k + k * k) * scale
    return value - b0 * value, b0 * value - a2 * value


@kernel
def first_order(value: float, memory: float, time_constant: float, elapsed: float) -> float:
    """Return the output of a first-order low-pass, y + (x - y) h / (tau + h) (backward Euler); tau = 0 passes all.

    value x and memory y (the last output) in one unit; time_constant tau >= 0 and elapsed h > 0 in s.
    """
    return memory + (value - memory) * elapsed / (time_constant + elapsed)
