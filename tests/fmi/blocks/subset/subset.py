"""A block that uses every construct of the kernel subset, for the translator to C."""

import math
from math import copysign, fabs, floor, frexp, isfinite, ldexp, sqrt
from typing import Any, NamedTuple

from twip.fmi.declare import Block, Variable, input, output, state
from twip.robot.kernel import kernel

LIMIT = 3.25
COUNT = 7
TABLE = (0.5, -1.25, 3.0, 1e-3)
OUTPUTS = (
    "arithmetic", "signs", "chosen", "looped", "counted", "whole", "divided", "tuples", "swapped", "extremes", "table",
    "scaled", "split", "named", "nested", "early", "reserved", "chain", "logic", "writer", "walked",
)  # fmt: skip


@kernel
def pair(a: float, b: float) -> tuple[float, float]:
    """Return both the other way round. A comment's end, */, must not end it in C."""
    return b, a


class Ends(NamedTuple):
    """Fields with names."""

    low: float
    high: float
    spans: tuple[float, int]


@kernel
def ends(a: float, b: float) -> Ends:
    """Return both in order, and what is between them."""
    if a > b:
        return ends_of(b, a)
    return Ends(a, b, (b - a, 1))


@kernel
def ends_of(low: float, high: float) -> Ends:
    """Return both as they are."""
    return Ends(low, high, (high - low, COUNT))


@kernel
def middle(e: Ends) -> float:
    """Return what is between the ends, which are read by name and by position."""
    low, _, _ = e
    return low + 0.5 * (e.high - e[0]) * e.spans[1]


@kernel
def nested(a: float, b: float) -> tuple[tuple[float, float], bool, int]:
    """Return a tuple in a tuple, a truth and a number of truths."""
    return (a - b, a + b), a < b, (a < b) + (a == a) + (b > LIMIT)


@kernel
def early(a: float) -> float:
    """Return in the middle of loops and branches."""
    for i in range(COUNT):
        if a > 10.0 * i:
            continue
        if i > 3:
            return 1.0 * i
        break
    while a > 1.0:
        a *= 0.25
        if a < 2.0:
            break
    return a


@kernel
def reserved(double: float, register: float) -> float:
    """Names that are C's own stay possible."""
    int64_t = double - register
    twip_floor = int64_t * 2.0
    t1 = twip_floor + 1.0
    t1 += int64_t
    return t1


@kernel
def walk(v: Any, by: float) -> float:
    """Write a value, and return it."""
    v.place += by
    return v.place


@kernel
def initialize(v: Any, time: float) -> None:
    """Begin at the time."""
    v.place = time
    step(v, time, 0.0)


@kernel
def step(v: Any, time: float, step_size: float) -> None:
    """Use everything once."""
    a, b, c = v.a, v.b, v.c
    v.arithmetic = (a + b) * c - a / (1.0 + b * b) - (b - (c - a))
    v.signs = -(-a) + +b - -c * -1.0  # noqa: B002
    v.chosen = 1.0 if a < b else (-1.0 if a > b else 0.0)
    total, count = 0.0, 0
    for i in range(COUNT):
        total += a * i
        for _ in range(2, 4):
            count += 1
    v.looped = total
    v.counted = float(count % 5 - count // 3) + float(-count // 4) + float(-count % 5)
    whole = -floor(a / 3.0)
    if whole < 1:
        whole = 1
    v.whole = b / whole + float(-floor(c)) + float(floor(a) + floor(b) - 1)
    v.divided = 7 / 2 + 1 / COUNT + float(int(c * 1e-3) if fabs(c) < 1e15 else 0)
    first, second = pair(a, b)
    v.tuples = first * 2.0 - second
    first, second = second, first
    v.swapped, v.place = first - 2.0 * second, v.place + step_size
    v.extremes = max(a, b) + min(a, max(b, c, 0.5)) * math.pi
    v.table = TABLE[count % 4] * TABLE[-1]
    fraction, twos = frexp(a)
    v.split = fraction * 0.25 + twos
    v.scaled = ldexp(b, twos // 2 - 1100) + ldexp(fraction, 3)
    found = ends(a, b)
    v.named = middle(found) + found.spans[0] - found.low
    both, less, truths = nested(a, b)
    other = (both[0], both[1])
    v.nested = both[1] / (1.0 + fabs(pair(both[0], c)[0])) + (1.0 if both == other else 0.0) + truths
    v.early = early(a)
    v.reserved = reserved(a, b)
    v.chain = 1.0 if (-1.0 < a <= b < LIMIT and not less) or c != 0.0 else 0.0
    # a comment above a statement stays
    v.logic = 1.0 if (a > 0.0 or b > 0.0) and (less or isfinite(c)) == True else copysign(2.0, c)  # noqa: E712
    by = walk(v, sqrt(fabs(a)))
    v.walked = by
    walk(v, time)
    if a > 100.0:
        v.writer = 1.0
    elif a > 0.0:
        v.writer = 2.0
    else:
        v.writer = v.place
        return
    v.writer += 1.0


def check(v: Any) -> list[str]:
    """Tell sentences with numbers in all formats."""
    found = []
    for name, limit in (("low", 1.0), ("high", 2)):
        if getattr(v, f"{name}_limit") > limit:
            found.append(f"{name}_limit = {getattr(v, f'{name}_limit'):g} is above {limit:.3g}: “100 %”")
    text, least = f"{v.low_limit:.10g} and {v.high_limit:.3g}", 0.5 * (v.low_limit + v.high_limit)
    if v.high_limit < v.low_limit:
        found.append(f"{text}: the mean is {least:.17g}")
    return found


BLOCK = Block(
    name="subset",
    description="Every construct of the kernel subset",
    variables=(
        *(input(name, None, "a number", start=0.5) for name in "abc"),
        *(output(name, None, "a result") for name in OUTPUTS),
        Variable("low_limit", "parameter", "tunable", start=0.0, description="a limit"),
        Variable("high_limit", "parameter", "tunable", start=0.0, description="another limit"),
        state("place"),
    ),
    initialize=initialize,
    step=step,
    check=check,
)  # fmt: skip
