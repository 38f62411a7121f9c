"""When an iterated step is accepted."""

from dataclasses import dataclass

TOLERANCE, ITERATIONS = 1e-8, 50
"""Defaults of `Iteration`."""


@dataclass(frozen=True)
class Iteration:
    """When an iterated step is accepted."""

    tolerance: float = TOLERANCE
    """Largest change of a coupling variable, relative to its magnitude or nominal value."""
    maximum: int = ITERATIONS
    """Most iterations of a step; more are a failure."""
