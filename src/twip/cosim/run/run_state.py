"""What a run is made of, and how far it has come: what `starting`, `stepping` and `checkpointing` work on."""

import pathlib
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ...errors import TwipError
from ..coupling.algorithms import named
from ..coupling.coupling import INITIAL, Coupling
from ..coupling.execution import Execution
from ..coupling.scheduling import make_schedule
from ..coupling.variable_loop import VariableSteps
from ..fmus.isolation import Isolation
from ..fmus.pool import InstancePool
from ..fmus.protocols import AnyInstance
from ..model.message import Message
from ..model.schedule import Schedule
from ..model.system import System
from ..model.time_grid import TimeGrid
from ..model.vector import vector
from ..scenario.failing import Faults
from ..scenario.live_inputs import LiveInputs
from ..scenario.plan import Scenario
from .checkpoint import Checkpoint, InputDigest, Saving, identify
from .delivery import Delivery
from .interrupt_flag import InterruptFlag
from .pace import Pacer


class Loop(Protocol):
    """Executes the steps of a schedule."""

    def run(
        self,
        times: NDArray[np.float64],
        step_size: float,
        inputs: NDArray[np.float64],
        rows: NDArray[np.float64],
        stop: NDArray[np.bool_],
    ) -> tuple[int, TwipError | None]:
        """Do one step per row; see `PythonLoop.run`."""


@dataclass(frozen=True)
class LoopKind:
    """A way to execute a schedule."""

    make: Callable[[Execution], Loop]
    is_ready: Callable[[], bool]
    """Tells whether it begins at once; otherwise it is compiled first."""


@dataclass
class RunState:
    """What has been checked, and what a run changes; it serves one run."""

    system: System
    grid: TimeGrid
    coupling: Coupling
    scenario: Scenario
    delivery: Delivery
    interrupted: InterruptFlag
    loop: LoopKind
    saving: Saving | None
    resumed: Checkpoint | None
    pacer: Pacer | None
    progress: Callable[[float], None]
    notice: Callable[[str], None]
    time_limit: float | None
    """Longest that a call of an FMU may take, in s, each in a process of its own; None keeps all in this process."""
    pool: InstancePool
    live: LiveInputs | None = None
    """Inputs that are set from outside; what they refuse is told in the log."""
    instances: list[AnyInstance] = field(default_factory=list)
    dead: set[pathlib.Path] = field(default_factory=set)
    folders: dict[pathlib.Path, str] = field(default_factory=dict)
    """Unpacked FMUs that are used in this process, and whose they are."""

    def __post_init__(self) -> None:
        system, grid, self.inputs = self.system, self.grid, self.scenario.inputs
        self.first = self.steps = 0 if self.resumed is None else self.resumed.steps
        self.clock = np.array([grid.start])
        self.reached = self.time_of(self.steps)
        self.variable: VariableSteps | None = None
        driven = self.inputs.columns.tolist()
        plan = make_schedule(system, self.coupling, driven)
        in_order = self.coupling.algorithm is INITIAL.algorithm and not self.coupling.order
        self.first_pass = plan if in_order else make_schedule(system, INITIAL, driven)
        self.faults = Faults(self.scenario.faults, plan)
        self.schedule: Schedule = self.faults.schedule
        self.isolation = None if self.time_limit is None else Isolation(self.schedule, self.time_limit)
        self.values = vector(self.schedule.columns) if self.isolation is None else self.isolation.values
        self.warnings: list[str] = [*system.warnings, *self.scenario.warnings]
        if meaning := self.coupling.algorithm.in_a_loop:
            solves = named(lambda algorithm: not algorithm.in_a_loop)
            for loop in self.schedule.loops:
                self.warnings.append(
                    f"algebraic loop: {loop}; under {self.coupling.name} {meaning}"
                    f" ({solves} coupling solves it; an output that does not follow an input at once should say so by"
                    " its dependencies)"
                )
        types = [signal.type for channel in system.channels for signal in channel.signals]
        self.texts = [i for i, type_ in enumerate(types) if type_ == "String"]
        self.texts += self.faults.hidden(self.texts)
        self.delivered = self.completed = False
        self.ended = ""
        self.saved: int | None = None
        self.identity = identify(system, grid, self.coupling, self.scenario)
        self.digest = InputDigest(self.inputs, grid)

    def time_of(self, steps: int) -> float:
        """Return the time in s after so many communication steps."""
        return float(self.grid.times(steps, 0)[0])

    def say(self, level: str, text: str) -> None:
        """Have the master say something, at the time that is reached."""
        self.delivery.messages.append(Message(self.reached, level, "", text))

    def tell_refusals(self) -> None:
        """Warn of what live inputs have refused since the last time."""
        for text in () if self.live is None else self.live.refusals():
            self.say("warning", text)
