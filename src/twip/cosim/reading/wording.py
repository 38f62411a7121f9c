"""Lists and numbers of things in words."""

from collections.abc import Sequence


def counted(number: int, noun: str) -> str:
    """Return `1 input`, `2 inputs`; the plural takes an s."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


NAMED = 10
"""Most names that one line lists."""


def some_of(names: Sequence[str]) -> str:
    """Return the first names, and how many more there are."""
    more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
    return ", ".join(names[:NAMED]) + more
