"""Ctrl-C and the like as a flag: an exception raised inside an FMU's Python code would reach the master as a failure of
the FMU, and a process that dies at once leaves incomplete results.
"""

import signal
import threading
from collections.abc import Callable
from types import FrameType

import numpy as np
from numpy.typing import NDArray

from ...platform import END_SIGNALS


class InterruptFlag:
    """While entered in the main thread, the first SIGINT, SIGTERM or SIGHUP only sets the flag; a second one does what
    it did before. SIGTERM and SIGHUP stay ignored where they were (`nohup`).
    """

    def __init__(self) -> None:
        self.array: NDArray[np.bool_] = np.zeros(1, np.bool_)
        """The flag (1,), for loops that do not come back to Python often."""
        self.signal: int | None = None
        """Number of the signal that set the flag."""
        self._previous: dict[int, Callable[[int, FrameType | None], object] | int] = {}

    def __bool__(self) -> bool:
        return bool(self.array[0])

    def _handle(self, number: int, _frame: FrameType | None) -> None:
        self.signal = number
        self.array[0] = True
        self._restore()

    def _restore(self) -> None:
        while self._previous:
            signal.signal(*self._previous.popitem())

    def __enter__(self) -> "InterruptFlag":
        if threading.current_thread() is threading.main_thread():
            for number in END_SIGNALS:
                previous = signal.getsignal(number)
                # None: a handler that is not Python's, which could not be restored
                if previous is not None and (number == signal.SIGINT or previous != signal.SIG_IGN):
                    self._previous[number] = previous
                    signal.signal(number, self._handle)
        return self

    def __exit__(self, *_: object) -> None:
        self._restore()
