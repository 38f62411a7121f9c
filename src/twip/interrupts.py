"""Ctrl-C of the command line.

During imports it waits: extension modules may swallow an exception that comes while they initialize, or die of it.
"""

import signal
from collections.abc import Iterator
from contextlib import contextmanager

from .platform import blocked

INTERRUPTED = 130
"""Exit status after Ctrl-C: 128 + SIGINT."""


@contextmanager
def deferred_interrupt() -> Iterator[None]:
    """Let a SIGINT that comes while the block runs take effect at its end."""
    with blocked(signal.SIGINT):
        yield
