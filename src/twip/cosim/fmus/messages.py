"""Log messages of the FMUs: from the C callback to events with the simulated time.

fmpy's native proxy expands the printf arguments of a message and then calls the one Python function it was last given;
so a single function serves all instances and finds the right one by the component environment that comes with each
message.
"""

import ctypes
import itertools
from collections.abc import Callable

from fmpy import calloc, free
from fmpy.fmi2 import (
    fmi2CallbackAllocateMemoryTYPE,
    fmi2CallbackFreeMemoryTYPE,
    fmi2CallbackFunctions,
    fmi2CallbackLoggerTYPE,
)
from fmpy.logging import addLoggerProxy

LEVELS = ("info", "warning", "warning", "error", "fatal", "info")
"""Level of a message by its FMI status: ok, warning, discard, error, fatal, pending."""


_receivers: dict[int, Callable[[int, str], None]] = {}
_identity = itertools.count(1)


def _receive(environment: int | None, _name: bytes, status: int, _category: bytes, message: bytes | None) -> None:
    receiver = _receivers.get(environment or 0)
    if receiver is not None:
        receiver(status, (message or b"").decode("utf-8", "replace"))


_logger = fmi2CallbackLoggerTYPE(_receive)
_allocate = fmi2CallbackAllocateMemoryTYPE(calloc)
_free = fmi2CallbackFreeMemoryTYPE(free)


class Callbacks:
    """The callback struct of one instance; must live as long as the instance."""

    def __init__(self, receive: Callable[[int, str], None], formatted: bool):
        """Pass each message's status and text to `receive`; `formatted` says whether to expand printf arguments."""
        self._key = next(_identity)
        _receivers[self._key] = receive if formatted else lambda status, text: receive(status, text.replace("%%", "%"))
        self.struct = fmi2CallbackFunctions(
            logger=_logger, allocateMemory=_allocate, freeMemory=_free, componentEnvironment=self._key
        )
        if formatted:
            addLoggerProxy(ctypes.byref(self.struct))

    def close(self) -> None:
        """Forget the receiver; later messages are dropped."""
        _receivers.pop(self._key, None)
