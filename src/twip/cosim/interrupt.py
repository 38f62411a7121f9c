"""Ctrl-C as a flag: an exception raised inside an FMU's Python code would reach the master as a failure of the FMU."""

import signal
import threading
from types import FrameType

import numpy as np
from numpy.typing import NDArray


class InterruptFlag:
    """While entered in the main thread, the first SIGINT only sets the flag; a second one does what it did before."""

    def __init__(self) -> None:
        self.array: NDArray[np.bool_] = np.zeros(1, np.bool_)
        """The flag (1,), for loops that do not come back to Python often."""
        self._previous: signal.Handlers | object = None

    def __bool__(self) -> bool:
        return bool(self.array[0])

    def _handle(self, _number: int, _frame: FrameType | None) -> None:
        self.array[0] = True
        self._restore()

    def _restore(self) -> None:
        if self._previous is not None:
            signal.signal(signal.SIGINT, self._previous)  # type: ignore[arg-type]
            self._previous = None

    def __enter__(self) -> "InterruptFlag":
        if threading.current_thread() is threading.main_thread():
            self._previous = signal.signal(signal.SIGINT, self._handle)
        return self

    def __exit__(self, *_: object) -> None:
        self._restore()
