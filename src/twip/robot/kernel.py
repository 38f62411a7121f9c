"""Marks the functions that run in every step."""

from collections.abc import Callable
from typing import TypeVar

Function = TypeVar("Function", bound=Callable[..., object])


def kernel(function: Function) -> Function:
    """Mark a scalar function as part of a block's step; it keeps to what plain and compiled Python compute identically.

    Allowed: float and integer arithmetic, comparisons, loops, tuples, attributes of the block's variables, and of `math` sin,
    cos, tan, exp, log, atan2, sqrt, floor, fabs, copysign, isfinite and constants. Not allowed, because plain and compiled
    results differ: powers (`x**2`), `hypot`, `sum`, `fsum`.
    """
    return function
