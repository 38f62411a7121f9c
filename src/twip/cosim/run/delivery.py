"""Hands the rows and messages of a run to its sinks."""

import contextlib
import os
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from ...errors import TwipError
from ..model.message import Message
from ..model.signals import Sink


@contextlib.contextmanager
def writing() -> Iterator[None]:
    """Turn a failure to write results into a `TwipError`."""
    try:
        yield
    except OSError as error:
        raise TwipError(f"{error.filename or 'the results'}: cannot be written ({error.strerror or error})") from None


class Delivery:
    """The sinks of a run, and the messages that they have not got yet."""

    def __init__(self, sinks: Sequence[Sink]):
        self._sinks = sinks
        self._process = os.getpid()
        self.messages: list[Message] = []
        """To be told next, in this order."""

    def write(self, times: NDArray[np.float64], rows: NDArray[np.float64]) -> None:
        """Pass on finished rows (n, columns) at `times` (n,) in s, then what there is to tell."""
        self.end_copy()
        with writing():
            for sink in self._sinks:
                if len(times):
                    sink.write(times, rows)
        self.tell()

    def end_copy(self) -> None:
        """End the process, at once, if it is a copy that an FMU has made of the run's by `fork`.

        The FMU's function returns in both; the copy must neither write a file nor remove one.
        """
        if os.getpid() != self._process:
            text = (
                f"twip: an FMU has forked process {self._process}, which runs the system: the copy, process"
                f" {os.getpid()}, ends here\n"
            )
            with contextlib.suppress(OSError):
                os.write(2, text.encode())
            os._exit(1)

    def tell(self) -> None:
        """Pass on the messages."""
        self.end_copy()
        messages, self.messages[:] = list(self.messages), []
        with writing():
            for message in messages:
                for sink in self._sinks:
                    sink.event(message.time, message.level, message.source, message.text)
