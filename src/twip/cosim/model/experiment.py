"""What a system's description proposes for a run."""

from dataclasses import dataclass, field

from .algorithm import Algorithm


@dataclass(frozen=True)
class Experiment:
    """What a file proposes for a run; None where it says nothing."""

    start_time: float | None = None
    stop_time: float | None = None
    step_size: float | None = None
    """Communication step in s; the first one if steps are variable."""
    algorithm: Algorithm = field(default_factory=Algorithm)
