"""What the steps of a run work on: the plan, the values, and what is remembered from one step to the next."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..fmus.protocols import AnyPorts
from ..model.message import Message
from ..model.schedule import Schedule
from ..model.time_grid import TimeGrid
from ..model.vector import Vector


@dataclass
class Execution:
    """The plan and the values of a run, shared by every loop that may continue it."""

    schedule: Schedule
    ports: Sequence[AnyPorts]
    """By component, in the order of the file."""
    values: Vector
    """The row of the last finished step."""
    driven: NDArray[np.int32]
    """Columns that the caller's inputs write."""
    clock: NDArray[np.float64]
    """Simulated time in s (1,), kept up to date for messages and failures."""
    messages: list[Message]
    """What the components have said and nobody has been told yet."""
    side_by_side: bool = False
    """Whether instances can work at the same time, each in a process of its own."""
    iterations: int = 0
    """How often iterated steps were done, in all."""
    turn: NDArray[np.int64] = field(init=False)
    """Finished communication steps (1,)."""
    reached: NDArray[np.float64] = field(init=False)
    """Position to which each component has come, in communication steps or in s (components + 1,); the last entry is
    that of the connectors, where a communication step begins.
    """
    since: NDArray[np.float64] = field(init=False)
    """Time in s to which each component has come (components,)."""
    samples: NDArray[np.float64] = field(init=False)
    """What each copy to the middle of a step brought last, the source's position then, and both for the last value
    before that position (4, copies).
    """

    def __post_init__(self) -> None:
        plan, components = self.schedule, len(self.ports)
        self.turn = np.zeros(1, np.int64)
        self.reached = np.zeros(components + 1)
        self.since = np.full(components, self.clock[0])
        with np.errstate(over="ignore", invalid="ignore"):  # the copy itself fails
            value = plan.factor * self.row[plan.source] + plan.offset
        self.samples = np.stack([value, np.zeros_like(value), value, np.full_like(value, -1.0)])

    def go_on(self, grid: TimeGrid, steps: int, samples: NDArray[np.float64]) -> None:
        """Be where `steps` communication steps of `grid` are finished."""
        self.turn[0] = self.reached[-1] = steps
        for i, every in enumerate(self.schedule.every.tolist()):
            self.reached[i] = steps - steps % every
            self.since[i] = grid.times(steps - steps % every, 0)[0]
        self.samples[:] = samples

    @property
    def driven_every(self) -> NDArray[np.int64]:
        """For each driven column, the communication steps in a step of its component; 1 for a connector (driven,)."""
        every = np.ones(self.schedule.columns, np.int64)
        for component, own in zip(self.schedule.components, self.schedule.every.tolist(), strict=True):
            for group in component.inputs:
                every[group.first : group.first + len(group.references)] = own
        return every[self.driven]

    @property
    def row(self) -> NDArray[np.float64]:
        """The values as an array on the same memory (columns,)."""
        return np.ctypeslib.as_array(self.values)
