"""What a run records: a table of rows whose columns are grouped by component, and the sinks that take it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

TIME = "time"
"""Name of the independent variable, the first column of tables."""


@dataclass(frozen=True)
class Signal:
    """One recorded variable of a component.

    In the float64 table, integers and Booleans are what they are, a String is the number that `texts.text_of` takes.
    """

    name: str
    """Name in the model description, dots included."""
    type: str
    """One of `scalar_types.TYPES`."""
    unit: str | None
    causality: str
    """`input` or `output`."""
    description: str = ""


@dataclass(frozen=True)
class Channel:
    """The recorded variables of one component, consecutive columns of the table in this order."""

    component: str
    """Name in the system, nested systems dotted; empty for the connectors of the system itself."""
    signals: tuple[Signal, ...]


class Sink(Protocol):
    """Takes the rows of a run as it goes: a log, a CSV file, a table in memory."""

    def write(self, times: NDArray[np.float64], rows: NDArray[np.float64]) -> None:
        """Take finished rows: `times` (n,) in s and `rows` (n, columns), columns in the order of the channels."""

    def event(self, time: float, level: str, source: str, message: str) -> None:
        """Take a message of a component or of the master; `level` is `debug`, `info`, `warning`, `error` or `fatal`."""

    def close(self) -> None:
        """Finish; everything taken so far is complete and readable afterwards, however the run ended."""


@runtime_checkable
class TimedSink(Sink, Protocol):
    """A sink that cannot keep every time."""

    def check_times(self, start: float, stop: float, step_size: float) -> None:
        """Refuse a run from `start` to `stop` by steps of `step_size`, of which they are the first if they vary, in s.

        Called before anything is instantiated; raises `TwipError` with a line per problem.
        """


def columns(channels: Sequence[Channel]) -> list[str]:
    """Return the column names `component.variable` (a system connector by its bare name)."""
    return [f"{c.component}.{s.name}" if c.component else s.name for c in channels for s in c.signals]
