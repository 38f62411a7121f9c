"""Lists and numbers of things in words, and names that somebody may have meant."""

import difflib
from collections.abc import Iterable, Sequence


def counted(number: int, noun: str) -> str:
    """Return `1 input`, `2 inputs`; the plural takes an s."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


NAMED = 10
"""Most names that one line lists."""


def some_of(names: Sequence[str]) -> str:
    """Return the first names, and how many more there are."""
    more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
    return ", ".join(names[:NAMED]) + more


def nearest(name: str, known: Iterable[str], most: int = 1) -> list[str]:
    """Return those of the `known` names that look like `name`, the likeliest first, at most so many."""
    return difflib.get_close_matches(name, list(known), most)


def did_you_mean(name: str, known: Iterable[str], otherwise: str = "") -> str:
    """Return `, did you mean plant.pitch?` to follow a message about an unknown `name`, `otherwise` if none is near."""
    near = nearest(name, known)
    return f", did you mean {near[0]}?" if near else otherwise
