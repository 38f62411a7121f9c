"""What a component or the master says during a run."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Message:
    """A message of a component, or of the master (its `source` is empty)."""

    time: float
    """Simulated time in s at which it was received; in a log exact to the nanosecond."""
    level: str
    """`debug`, `info`, `warning`, `error` or `fatal`."""
    source: str
    text: str
