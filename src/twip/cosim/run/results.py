"""What a run did, as its caller gets it."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import TwipError
from ..coupling.variable_loop import VariableSteps
from ..model.message import Message
from ..sinks.table_sink import Table
from .pace import RealTime


@dataclass(frozen=True)
class Result:
    """What a run did, and all its rows if they went nowhere else: `result["plant.pitch"]` over `result.times`."""

    steps: int
    """Finished steps of this run; the sinks hold one row more, that of the time where it began."""
    start_time: float
    """Simulated time where this run began: the start time, or the time of the checkpoint that it resumed, in s."""
    time: float
    """Simulated time reached, in s."""
    step_size: float
    coupling: str
    wall_time: float
    """Time spent stepping and recording, in s."""
    setup_time: float
    """Time spent unpacking, instantiating, compiling and initializing, in s."""
    interrupted: bool
    """Whether a signal ended the run before its stop time."""
    ended: str
    """Which component ended the run before its stop time, and when; empty if none did."""
    values: dict[str, float | str]
    """The last row by column name; a String as its text."""
    warnings: tuple[str, ...] = ()
    checkpoint: Path | None = None
    """File that holds the state at the end, if one was asked for."""
    signal: int | None = None
    """Number of the signal that ended an interrupted run."""
    real_time: RealTime | None = None
    """Kept and missed deadlines of a run in real time."""
    iterations: int = 0
    """How often the steps of an iterated run were done, in all."""
    variable: VariableSteps | None = None
    """What variable steps were like; `step_size` is then the first."""
    table: Table | None = field(default=None, repr=False)
    """All rows and events of a run that was given no sinks."""

    @property
    def real_time_factor(self) -> float:
        """Simulated time over wall time."""
        return (self.time - self.start_time) / self.wall_time if self.wall_time > 0.0 else float("inf")

    @property
    def times(self) -> NDArray[np.float64]:
        """Times of the rows in s, (rows,); raises `TwipError` when the rows went to sinks."""
        return self._kept.times

    @property
    def continued(self) -> bool:
        """Whether the rows go on from a checkpoint instead of the run's start."""
        return self._kept.continued

    def __contains__(self, name: object) -> bool:
        """Tell whether there is a signal of this name."""
        return name in self._kept

    def __getitem__(self, name: str) -> NDArray[Any]:
        """Return the values of `component.variable`, (rows,)."""
        return self._kept[name]

    @property
    def events(self) -> list[Message]:
        """Messages of the components and of the master."""
        return self._kept.events

    def to_numpy(self) -> NDArray[np.void]:
        """Return all rows as a structured array; see `Table.to_numpy`."""
        return self._kept.to_numpy()

    @property
    def _kept(self) -> Table:
        if self.table is None:
            raise TwipError("the rows of this run went to its sinks, the result does not hold them")
        return self.table
