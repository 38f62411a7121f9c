"""Ctrl-C as a flag: an exception raised inside an FMU's Python code would reach the master as a fatal failure of the
FMU.
"""

import signal
import threading
from types import FrameType


class InterruptFlag:
    """While entered in the main thread, the first SIGINT only sets the flag; a second one does what it did before."""

    def __init__(self) -> None:
        self.is_set = False
        self._previous: signal.Handlers | object = None

    def __call__(self) -> bool:
        """Tell whether SIGINT has come."""
        return self.is_set

    def _handle(self, _number: int, _frame: FrameType | None) -> None:
        self.is_set = True
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
