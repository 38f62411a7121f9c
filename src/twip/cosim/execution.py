"""What the steps of a run work on: the plan, the values, and what is remembered from one step to the next."""

import ctypes
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from .face import PortsFace
from .schedule import Schedule

Vector = ctypes.Array[ctypes.c_double]


@dataclass
class Execution:
    """The plan and the values of a run, shared by every loop that may continue it."""

    schedule: Schedule
    ports: Sequence[PortsFace]
    """By component, in the order of the file."""
    values: Vector
    """The row of the last finished step."""
    driven: NDArray[np.int32]
    """Columns that the caller's inputs write."""
    clock: NDArray[np.float64]
    """Simulated time in s (1,), kept up to date for messages and failures."""
    previous: NDArray[np.float64] = field(init=False)
    """What each copy brought in the last step (copies); looking ahead needs it."""

    def __post_init__(self) -> None:
        plan = self.schedule
        self.previous = plan.factor * self.row[plan.source] + plan.offset

    @property
    def row(self) -> NDArray[np.float64]:
        """The values as an array on the same memory (columns,)."""
        return np.ctypeslib.as_array(self.values)


def vector(columns: int) -> Vector:
    """Return a value vector of zeros."""
    return (ctypes.c_double * columns)()
