"""What a caller asks of a run, in groups that `simulate` takes; what is not given is left to defaults."""

import math
import os
from collections.abc import Callable
from dataclasses import dataclass

from ...errors import TwipError
from ..fmus.isolation import TIME_LIMIT
from ..fmus.pool import InstancePool
from ..scenario.live_inputs import LiveInputs

File = str | os.PathLike[str]


@dataclass(frozen=True)
class Inputs:
    """What drives open inputs and disturbs the run."""

    file: File | None = None
    """CSV file that drives open inputs."""
    scenario: File | None = None
    """TOML file with time series, parameter changes and faults (docs/scenarios.md)."""
    live: LiveInputs | None = None
    """Inputs that another thread sets during the run, except those that a file drives; no checkpoint can hold them."""


@dataclass(frozen=True)
class Runtime:
    """How the steps are executed, with the same results in any case."""

    loop: str | None = None
    """`compiled` or `python`; default: compiled where numba is installed and the run allows it."""
    isolate: bool = False
    """Whether each FMU runs in a process of its own, by the Python loop: one that crashes or takes longer than
    `time_limit` for a call ends the run like one that returns an error."""
    time_limit: float | None = None
    """Longest time that a call of an isolated FMU may take, in s; default: 10."""
    real_time: float | None = None
    """Simulated seconds per second to which the run is held back; the result reports missed deadlines."""
    pool: InstancePool | None = None
    """Keeps the instances for the next run of the system or of a variation of its start values."""

    def call_limit(self) -> float | None:
        """Return the longest time that a call may take in s; None where nothing could end it. Raises `TwipError`."""
        if not self.isolate:
            if self.time_limit is not None:
                raise TwipError(
                    "a time limit needs isolated FMUs (--isolate): a call in this process cannot be stopped"
                )
            return None
        limit = TIME_LIMIT if self.time_limit is None else self.time_limit
        if not (math.isfinite(limit) and limit > 0.0):
            raise TwipError(f"time limit {limit!r} s must be a positive number")
        return limit


@dataclass(frozen=True)
class Checkpoints:
    """Where the state of the whole run is saved, and where it comes from."""

    file: File | None = None
    """File that takes the state at the end of the run, also after Ctrl-C; a failed run leaves the last one."""
    every: float | None = None
    """Interval in simulated s at which the state is saved too."""
    resume: File | None = None
    """File of an earlier run, which is continued as if it had never stopped. Everything but the stop time and later
    values of the inputs must be the same; the first row is that of the checkpoint."""


@dataclass(frozen=True)
class Observer:
    """What is called while the run goes on."""

    progress: Callable[[float], None] | None = None
    """Called with the simulated time in s after each chunk."""
    notice: Callable[[str], None] | None = None
    """Called with a sentence before something that takes a while."""
