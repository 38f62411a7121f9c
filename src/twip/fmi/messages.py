"""What a block says to its host: warnings, and errors that are kept until they are healed."""

from dataclasses import dataclass
from typing import Any

WARNING, DISCARD, ERROR = 1, 2, 3
"""FMI status of a message."""

LOG_CATEGORIES = {
    "logStatusWarning": "the run goes on, but not as the numbers suggest",
    "logStatusDiscard": "a step is refused because of an earlier mistake",
    "logStatusError": "a value is refused, or a step has failed",
}
"""The categories of the FMI log, with their meanings."""

CATEGORY = dict(zip((WARNING, DISCARD, ERROR), LOG_CATEGORIES, strict=True))

KEPT_ERRORS = 20
"""Errors kept per instance; later ones are only logged."""


@dataclass
class Message:
    """One message, in the shape that the libraries of pythonfmu and pythonfmu3 read."""

    status: int
    category: str
    msg: str
    debug: bool = False


class Messages:
    """The messages of one instance; `queue` is the list that pythonfmu empties into the FMI log after each call."""

    def __init__(self, queue: list[Any], formats: bool) -> None:
        self.errors: list[str] = []
        self._queue = queue
        self._per_cent = "%%" if formats else "%"

    def fail(self, error: str) -> None:
        """Log an error and keep it."""
        if len(self.errors) < KEPT_ERRORS:
            self.errors.append(error)
        self.log(ERROR, error)

    def log(self, status: int, text: str) -> None:
        """Log a message; where the C side takes it as a format, per cent signs are doubled."""
        clean = text.encode("utf-8", "replace").decode().replace("\0", " ").replace("%", self._per_cent)
        self._queue.append(Message(status, CATEGORY[status], clean))
