"""What a system's description proposes for a run."""

from dataclasses import dataclass, field

from .algorithm import Algorithm


@dataclass(frozen=True)
class Experiment:
    """What a file proposes for a run; None where it says nothing."""

    start_time: float | None = None
    stop_time: float | None = None
    algorithm: Algorithm = field(default_factory=Algorithm)
