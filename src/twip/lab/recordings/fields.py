"""Number and Boolean fields of a decoded message: mappings, sequences and what they hold.

A field is named by its path below the topic: `.angular_velocity.y`, `.position[0]`, or nothing for a bare number.
"""

import re
from collections.abc import Iterator
from typing import Any

import numpy as np

INDEX = re.compile(r"\[(\d{1,9})\](.*)", re.DOTALL)
DEEPEST_LISTED = 30
"""Levels below a topic that are listed."""
MOST_LISTED = 1000
"""Fields of a topic that are listed at most."""

Steps = tuple[str | int, ...]
"""Keys and indices that lead to a field."""


def number(value: Any) -> bool | int | float | None:
    """Return a number or Boolean as Python's own, None for anything else."""
    if isinstance(value, np.generic):
        value = value.item()
    return value if isinstance(value, bool | int | float) else None


def locate(message: Any, path: str) -> Steps | None:
    """Return the steps to the number at a path in a message, None if there is none; keys may contain dots."""
    if not path:
        return None if number(message) is None else ()
    if isinstance(message, dict) and path.startswith("."):
        for key, value in message.items():
            rest = path[1:].removeprefix(key)
            if path[1:].startswith(key) and rest[:1] in ("", ".", "["):
                found = locate(value, rest)
                if found is not None:
                    return (key, *found)
    elif isinstance(message, list | np.ndarray) and (match := INDEX.fullmatch(path)):
        index = int(match[1])
        found = locate(message[index], match[2]) if index < len(message) else None
        return None if found is None else (index, *found)
    return None


def pick(message: Any, steps: Steps) -> bool | int | float | None:
    """Return the number that the steps lead to, None where the message has none."""
    for step in steps:
        try:
            message = message[step]
        except (IndexError, KeyError, TypeError):
            return None
    return number(message)


def listed(message: Any, depth: int = 0) -> Iterator[str]:
    """Yield the paths of a message's numbers; an array by its first element: `.position[0…5]`."""
    if number(message) is not None:
        yield ""
    elif depth == DEEPEST_LISTED:
        return
    elif isinstance(message, dict):
        for key, value in message.items():
            for path in listed(value, depth + 1):
                yield f".{key}{path}"
    elif isinstance(message, list | np.ndarray) and len(message):
        last = len(message) - 1
        for path in listed(message[0], depth + 1):
            yield f"[0…{last}]{path}" if last else f"[0]{path}"
