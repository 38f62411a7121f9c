"""Elementary functions whose results do not depend on the machine: sin, cos, tan, atan2, exp and log.

Every system's mathematical library rounds differently in the last bit, and the robot makes visible what begins there.
These functions are made of additions, multiplications and divisions of doubles only, each rounded once, in a fixed
order. So plain Python, numba and C99 (without contraction and fast-math) give the same bits on every machine with
IEEE 754 doubles. Errors are below 0.8 units in the last place (`tests/robot/test_elementary.py` measures them).

Besides the arithmetic they need three primitives of `math`, all exact: `frexp` splits a double into a fraction in
[0.5, 1) and a power of two, `ldexp` multiplies by a power of two (rounding once where the result is subnormal), and
`copysign` copies a sign bit. In C the three are operations on the bits of a double. Constants and tables (tuples
of floats with a whole, non-negative index) come from `elementary_constants`.

Nothing raises an exception: outside of their domain the functions return nan, at poles an infinity, as IEEE 754 has it.

Methods: reduction to [-pi/4, pi/4] after W. J. Cody and W. Waite, *Software Manual for the Elementary Functions*, 1980,
and where that is not exact enough after M. H. Payne and R. N. Hanek, *Radian reduction for trigonometric functions*
(SIGNUM Newsletter 18, 1983); tables for exp, log and atan after P. T. P. Tang (ACM TOMS 15, 1989 and 16, 1990); exact
sums and products after T. J. Dekker, *A floating-point technique for extending the available precision* (1971).
"""

from math import copysign, fabs, frexp, inf, ldexp, nan

from .angle_reduction import ROUND, reduced
from .elementary_constants import (
    ARC,
    ARC_REST,
    ATAN0,
    ATAN1,
    ATAN2,
    ATAN3,
    ATAN4,
    ATAN5,
    ATAN6,
    COS0,
    COS1,
    COS2,
    COS3,
    COS4,
    COS5,
    EXP0,
    EXP1,
    EXP2,
    EXP3,
    HALF_PI,
    HALF_PI_REST,
    INVERSE,
    INVERSE_LOG,
    INVERSE_LOG_REST,
    LN2_FIRST,
    LN2_SECOND,
    LOG0,
    LOG1,
    LOG2,
    LOG3,
    LOG4,
    LOG5,
    LOG6,
    PI,
    PI_REST,
    POWER,
    POWER_REST,
    SIN0,
    SIN1,
    SIN2,
    SIN3,
    SIN4,
    SIN5,
    STEP_FIRST,
    STEP_SECOND,
    STEPS_PER_UNIT,
)  # fmt: skip
from .exact import exact_product, exact_sum
from .kernel import kernel

EIGHTH_TURN = 0.7853981633974483
"""pi/4: up to here sin and cos need no reduction."""
UP, DOWN = 2.0**200, 2.0**-60


@kernel
def sin(x: float) -> float:
    """Return the sine of x in rad."""
    if -EIGHTH_TURN <= x <= EIGHTH_TURN:
        z = x * x
        if z < 1e-18:
            return x  # keeps the sign of 0
        return x + x * z * (SIN0 + z * (SIN1 + z * (SIN2 + z * (SIN3 + z * (SIN4 + z * SIN5)))))
    quarter, rest, tail = reduced(x)
    if quarter == 0.0:
        return sine(rest, tail)
    if quarter == 1.0:
        return cosine(rest, tail)
    if quarter == -1.0:
        return -cosine(rest, tail)
    return -sine(rest, tail)


@kernel
def cos(x: float) -> float:
    """Return the cosine of x in rad."""
    if -EIGHTH_TURN <= x <= EIGHTH_TURN:
        z = x * x
        half = 0.5 * z
        base = 1.0 - half
        p = z * z * (COS0 + z * (COS1 + z * (COS2 + z * (COS3 + z * (COS4 + z * COS5)))))
        return base + ((1.0 - base - half) + p)
    quarter, rest, tail = reduced(x)
    if quarter == 0.0:
        return cosine(rest, tail)
    if quarter == 1.0:
        return -sine(rest, tail)
    if quarter == -1.0:
        return sine(rest, tail)
    return -cosine(rest, tail)


@kernel
def sin_cos(x: float) -> tuple[float, float]:
    """Return sine and cosine of x in rad: the same bits as `sin` and `cos` in less time."""
    if -EIGHTH_TURN <= x <= EIGHTH_TURN:
        z = x * x
        half = 0.5 * z
        base = 1.0 - half
        p = z * z * (COS0 + z * (COS1 + z * (COS2 + z * (COS3 + z * (COS4 + z * COS5)))))
        along = base + ((1.0 - base - half) + p)
        if z < 1e-18:
            return x, along
        return x + x * z * (SIN0 + z * (SIN1 + z * (SIN2 + z * (SIN3 + z * (SIN4 + z * SIN5))))), along
    quarter, rest, tail = reduced(x)
    across, along = sine(rest, tail), cosine(rest, tail)
    if quarter == 0.0:
        return across, along
    if quarter == 1.0:
        return along, -across
    if quarter == -1.0:
        return -along, across
    return -across, -along


@kernel
def tan(x: float) -> float:
    """Return the tangent of x in rad."""
    quarter, rest, tail = 0.0, x, 0.0
    if not -EIGHTH_TURN <= x <= EIGHTH_TURN:
        quarter, rest, tail = reduced(x)
    z, z_rest = exact_product(rest, rest)
    if z < 1e-18 and quarter == 0.0:
        return rest
    cube, cube_rest = exact_product(rest, z)
    main, main_rest = exact_product(SIN0, cube)
    above, above_rest = exact_sum(rest, main)
    p = cube * z * (SIN1 + z * (SIN2 + z * (SIN3 + z * (SIN4 + z * SIN5))))
    p += SIN0 * (cube_rest + rest * z_rest) + tail * (1.0 - 0.5 * z)
    above, above_rest = exact_sum(above, above_rest + main_rest + p)
    p = z * z * (COS0 + z * (COS1 + z * (COS2 + z * (COS3 + z * (COS4 + z * COS5)))))
    base = 1.0 - 0.5 * z
    below, below_rest = exact_sum(base, (1.0 - base - 0.5 * z) + (p - 0.5 * z_rest - rest * tail))
    if quarter == 1.0 or quarter == -1.0:
        above, above_rest, below, below_rest = -below, -below_rest, above, above_rest
    quotient = above / below
    product, product_rest = exact_product(quotient, below)
    return quotient + ((above - product - product_rest + above_rest) - quotient * below_rest) / below


@kernel
def atan2(y: float, x: float) -> float:
    """Return the angle of the point (x, y) in rad, in [-pi, pi]; the signs of zeros count as in IEEE 754."""
    if x != x or y != y:
        return nan
    small, large = fabs(y), fabs(x)
    steep = small > large
    if steep:
        small, large = large, small
    left = copysign(1.0, x) < 0.0
    # angle = turn +- atan(small / large)
    turn, turn_rest = 0.0, 0.0
    if steep:
        turn, turn_rest = HALF_PI, HALF_PI_REST
    elif left:
        turn, turn_rest = PI, PI_REST
    sign = -1.0 if steep != left else 1.0
    if small == inf:
        small, large = 1.0, 1.0
    elif large == inf or small == 0.0:
        return copysign(turn, y)
    q = small / large
    if q < 1e-9:
        return copysign(turn + (turn_rest + sign * q), y)  # q^3 is too small to count
    if large > 1e290:
        small, large = small * DOWN, large * DOWN
    elif large < 1e-270:
        small, large = small * UP, large * UP
    product, product_rest = exact_product(q, large)
    missing = (small - product - product_rest) / large
    k = int(32.0 * q + 0.5)
    if k < 4:
        k = 0
    c = 0.03125 * k
    below = 1.0 + c * q
    d = (q - c) / below
    z = d * d
    p = d * z * (ATAN0 + z * (ATAN1 + z * (ATAN2 + z * (ATAN3 + z * (ATAN4 + z * (ATAN5 + z * ATAN6))))))
    first, first_rest = exact_sum(turn, sign * ARC[k])
    angle, angle_rest = exact_sum(first, sign * d)
    rest = first_rest + angle_rest + turn_rest + sign * (ARC_REST[k] + missing / below + p)
    return copysign(angle + rest, y)


@kernel
def exp(x: float) -> float:
    """Return e^x."""
    if not -746.0 < x < 709.782712893384:
        if x <= -746.0:
            return 0.0
        if x > 709.782712893384:
            return inf
        if x != x:
            return nan
    n = x * STEPS_PER_UNIT + ROUND - ROUND
    r = x - n * STEP_FIRST - n * STEP_SECOND
    k = int(n)
    twos = k // 64
    k -= 64 * twos
    p = r + r * r * (EXP0 + r * (EXP1 + r * (EXP2 + r * EXP3)))
    power = POWER[k]
    return ldexp(power + (POWER_REST[k] + power * p), twos)


@kernel
def log(x: float) -> float:
    """Return the natural logarithm of x."""
    if not 0.0 < x < inf:
        if x == 0.0:
            return -inf
        return inf if x > 0.0 else nan
    m, twos = frexp(x)
    if m < 0.7071067811865476:
        m += m
        twos -= 1
    k = int(64.0 * m + 0.5) - 45
    c = INVERSE[k]
    high = m + 201326592.0 - 201326592.0  # 1.5 * 2^27: 26 bits remain, so that both products are exact
    first = high * c - 1.0
    second = (m - high) * c
    r = first + second
    r_rest = first - r + second
    whole = twos * LN2_FIRST + INVERSE_LOG[k]
    result = whole + r
    rest = whole - result + r
    p = r * r * (LOG0 + r * (LOG1 + r * (LOG2 + r * (LOG3 + r * (LOG4 + r * (LOG5 + r * LOG6))))))
    return result + (rest + (r_rest + twos * LN2_SECOND + INVERSE_LOG_REST[k]) + p)


@kernel
def sine(x: float, tail: float) -> float:
    """Return sin(x + tail) for |x| <= pi/4, |tail| below the last place of x, and x not tiny."""
    z = x * x
    p = x * z * (SIN0 + z * (SIN1 + z * (SIN2 + z * (SIN3 + z * (SIN4 + z * SIN5)))))
    return x + (p + tail * (1.0 - 0.5 * z))


@kernel
def cosine(x: float, tail: float) -> float:
    """Return cos(x + tail) for |x| <= pi/4 and |tail| below the last place of x."""
    z = x * x
    half = 0.5 * z
    base = 1.0 - half
    p = z * z * (COS0 + z * (COS1 + z * (COS2 + z * (COS3 + z * (COS4 + z * COS5)))))
    return base + ((1.0 - base - half) + (p - x * tail))
