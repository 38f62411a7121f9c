"""Sums and products with their rounding errors, after T. J. Dekker (Numerische Mathematik 18, 1971) and D. E. Knuth."""

from .kernel import kernel


@kernel
def exact_sum(a: float, b: float) -> tuple[float, float]:
    """Return s, e with s = a + b rounded and s + e = a + b exactly."""
    s = a + b
    part = s - a
    return s, (a - (s - part)) + (b - part)


@kernel
def exact_product(a: float, b: float) -> tuple[float, float]:
    """Return p, e with p = a b rounded and p + e = a b exactly, for |a|, |b| < 2^990 and |a b| > 2^-960."""
    p = a * b
    t = 134217729.0 * a  # 2^27 + 1
    a_high = t - (t - a)
    a_low = a - a_high
    t = 134217729.0 * b
    b_high = t - (t - b)
    b_low = b - b_high
    return p, a_low * b_low - (p - a_high * b_high - a_low * b_high - a_high * b_low)
