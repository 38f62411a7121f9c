"""What sinks that write files share."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from ..log.log_extra import ExtraChannel
from ..log.log_file import Attachment
from ..model.signals import Channel


@dataclass(frozen=True)
class RunDetails:
    """What a sink may know of a run before its first row."""

    channels: Sequence[Channel]
    """The columns of the rows: the components and their signals."""
    metadata: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    """Where the run comes from, as record name → key → text."""
    attachments: Sequence[Attachment] = ()
    """Files that the run reads."""
    start_time: float = 0.0
    """In s."""
    extras: Sequence[ExtraChannel] = ()
    """Channels of the caller, made of the rows."""


class FileSink(ABC):
    """A `Sink` that writes a file, whose ending says what it is."""

    endings: ClassVar[tuple[str, ...]]
    """In lower case, with the point."""

    @classmethod
    @abstractmethod
    def open(cls, path: Path, run: RunDetails) -> Self:
        """Open `path` for the rows of a run; an existing file is replaced by the first of them.

        Raises `TwipError` when it cannot be written.
        """

    @abstractmethod
    def write(self, times: NDArray[np.float64], rows: NDArray[np.float64]) -> None:
        """Take finished rows: `times` (n,) in s and `rows` (n, columns), columns in the order of the channels."""

    @abstractmethod
    def event(self, time: float, level: str, source: str, message: str) -> None:
        """Take a message of a component or of the master; `level` is `debug`, `info`, `warning`, `error` or `fatal`."""

    @abstractmethod
    def close(self) -> None:
        """Finish; everything taken so far is complete and readable afterwards, however the run ended."""
