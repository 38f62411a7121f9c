"""An angle as a number of quarter turns and a rest, exact enough for any double."""

from math import fabs, frexp, inf, ldexp, nan

from .elementary_constants import (
    HALF_PI,
    HALF_PI_FIRST,
    HALF_PI_REST,
    HALF_PI_SECOND,
    HALF_PI_THIRD,
    TWO_OVER_PI,
    TWO_OVER_PI_DIGITS,
)
from .exact import exact_product, exact_sum
from .kernel import kernel

ROUND = 6755399441055744.0
"""1.5 * 2^52: adding and subtracting it rounds |x| < 2^51 to a whole number."""
NEXT_DIGIT = 2.0**-24


@kernel
def reduced(x: float) -> tuple[float, float, float]:
    """Return quarter, rest, tail with x = quarter pi/2 + rest + tail up to whole turns.

    quarter is -2, -1, 0, 1 or 2, |rest| <= pi/4, |tail| is below the last place of rest; all nan for infinite x.
    """
    if -1e6 < x < 1e6:
        n = x * TWO_OVER_PI + ROUND - ROUND
        first = x - n * HALF_PI_FIRST  # exact, as is the next product: n has 20 bits
        second = n * HALF_PI_SECOND
        rest = first - second
        if rest > 2e-4 or rest < -2e-4:
            tail = (first - rest - second) - n * HALF_PI_THIRD
            base = rest + tail
            return n - 4.0 * (0.25 * n + ROUND - ROUND), base, rest - base + tail
    return reduced_exactly(x)


@kernel
def reduced_exactly(x: float) -> tuple[float, float, float]:
    """Return what `reduced` returns, for any x: the product of x and 2/pi to 130 bits behind the point.

    Whole multiples of 4 quarters are dropped from each partial product, all of which are exact.
    """
    if not fabs(x) < inf:
        return nan, nan, nan
    fraction, twos = frexp(x)
    high = fraction + 100663296.0 - 100663296.0  # 1.5 * 2^26: 26 bits remain
    low = fraction - high
    begin = (twos - 55) // 24  # digits before this one count whole turns only
    if begin < 0:
        begin = 0
    scale = ldexp(1.0, twos - 24 * begin - 24)
    total, middle, end = 0.0, 0.0, 0.0
    for k in range(9):
        digit = TWO_OVER_PI_DIGITS[begin + k] * scale
        total, error = exact_sum(total, modulo_four(high * digit))
        middle, error = exact_sum(middle, error)
        end += error
        total, error = exact_sum(total, modulo_four(low * digit))
        middle, error = exact_sum(middle, error)
        end += error
        scale *= NEXT_DIGIT
    quarter = total + ROUND - ROUND
    total, middle = exact_sum(total - quarter, middle)
    total, middle = exact_sum(total, middle + end)
    product, product_rest = exact_product(total, HALF_PI)
    rest, tail = exact_sum(product, product_rest + (total * HALF_PI_REST + middle * HALF_PI))
    return quarter - 4.0 * (0.25 * quarter + ROUND - ROUND), rest, tail


@kernel
def modulo_four(x: float) -> float:
    """Return x less a multiple of 4, exactly, at most 2 in magnitude; |x| < 2^78 with at most 53 bits."""
    x -= x + 1.8133887298441562e24 - 1.8133887298441562e24  # 1.5 * 2^80 leaves multiples of 2^28
    return x - (x + 27021597764222976.0 - 27021597764222976.0)  # 1.5 * 2^54 leaves multiples of 4
