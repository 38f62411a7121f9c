"""Random numbers whose whole memory is six floats, identical in plain and compiled Python.

The generator is MRG32k3a: two recurrences of order three with integer values, exact in double arithmetic because
every product stays below 2**53 (P. L'Ecuyer, "Good parameters and implementations for combined multiple recursive
random number generators", Operations Research 47(1), 1999). Its period is about 2**191.

Seeds are scattered over the period by a keyed chain of cubes modulo the prime `M1`. A cube is a one-to-one map there
(3 does not divide M1 - 1) and is not linear, so neighbouring seeds get unrelated states; states that differ by a
linear rule would give sequences that differ by the same rule. Two seeds of one stream never share a state's first
word, and for states spread like chance the probability that any two of a million sequences of 2**40 numbers overlap
is below 1e-30.
"""

from math import floor, pi, sqrt

from .elementary import log, sin_cos
from .kernel import kernel

M1 = 4294967087.0
M2 = 4294944443.0
NORM = 1.0 / 4294967088.0
"""1 / (M1 + 1): uniform numbers lie inside (0, 1) and never touch its ends."""


@kernel
def remainder(value: float, modulus: float) -> float:
    """Return value mod modulus in [0, modulus), exactly, for whole numbers with |value| <= 2**53 - modulus."""
    rest = value - floor(value / modulus) * modulus
    if rest < 0.0:
        rest += modulus
    elif rest >= modulus:
        rest -= modulus
    return rest


@kernel
def product(a: float, b: float, modulus: float) -> float:
    """Return a b mod modulus, exactly, for whole 0 <= a, b < modulus < 2**32: `a` is split into 16-bit halves."""
    high = floor(a / 65536.0)
    low = a - 65536.0 * high
    return remainder(65536.0 * remainder(high * b, modulus) + low * b, modulus)


@kernel
def next_state(
    x1: float, x2: float, x3: float, y1: float, y2: float, y3: float
) -> tuple[float, float, float, float, float, float]:
    """Advance the generator by one number.

    x_n = (1403580 x_(n-2) - 810728 x_(n-3)) mod M1,  y_n = (527612 y_(n-1) - 1370589 y_(n-3)) mod M2

    The oldest number comes first: x1 = x_(n-3), x3 = x_(n-1).
    """
    x = remainder(1403580.0 * x2 - 810728.0 * x1, M1)
    y = remainder(527612.0 * y3 - 1370589.0 * y1, M2)
    return x2, x3, x, y2, y3, y


@kernel
def uniform(x3: float, y3: float) -> float:
    """Return the uniform number in (0, 1) that belongs to a state, from the newest number of each recurrence."""
    difference = x3 - y3
    if difference <= 0.0:
        difference += M1
    return difference * NORM


@kernel
def normal_pair(
    x1: float, x2: float, x3: float, y1: float, y2: float, y3: float
) -> tuple[float, float, float, float, float, float, float, float]:
    """Return two independent standard normal numbers and the six floats of the state after them.

    r = sqrt(-2 ln u1),  n1 = r cos(2 pi u2),  n2 = r sin(2 pi u2)   (Box and Muller 1958)

    No number is kept back, so the six floats are the whole memory.
    """
    x1, x2, x3, y1, y2, y3 = next_state(x1, x2, x3, y1, y2, y3)
    radius = sqrt(-2.0 * log(uniform(x3, y3)))
    x1, x2, x3, y1, y2, y3 = next_state(x1, x2, x3, y1, y2, y3)
    sine, cosine = sin_cos(2.0 * pi * uniform(x3, y3))
    return radius * cosine, radius * sine, x1, x2, x3, y1, y2, y3


@kernel
def scatter(word: float, key: float, rounds: int) -> float:
    """Return `word` after `rounds` of w := (w + key + round)**3 mod M1, one-to-one in `word` for a given key."""
    for i in range(rounds):
        word = remainder(word + key + i, M1)
        word = product(word, product(word, word, M1), M1)
    return word


@kernel
def seeded(seed: float, stream: float) -> tuple[float, float, float, float, float, float]:
    """Return the generator's state for an integer seed in [0, 2**31) and an integer stream in [0, 2**20).

    Every block that draws numbers has a stream of its own, so blocks with the same seed draw independent numbers.
    """
    key = scatter(remainder(1013904223.0 + stream, M1), 1.0, 8)
    x1 = scatter(seed, key, 12)
    x2 = scatter(x1, key, 4)
    x3 = scatter(x2, key, 4)
    y1 = scatter(x3, key, 4)
    y2 = scatter(y1, key, 4)
    y3 = scatter(y2, key, 4)
    y1, y2, y3 = remainder(y1, M2), remainder(y2, M2), remainder(y3, M2)
    if x1 == 0.0 and x2 == 0.0 and x3 == 0.0:
        x3 = 1.0
    if y1 == 0.0 and y2 == 0.0 and y3 == 0.0:
        y3 = 1.0
    return x1, x2, x3, y1, y2, y3
