"""Arguments of the Python interface that may be one thing or several of it."""

import os
from collections.abc import Mapping, Sequence
from typing import TypeVar

from ...errors import TwipError

T = TypeVar("T")
PathLike = str | os.PathLike[str]
Paths = PathLike | Sequence[PathLike]


def paths(given: Paths) -> list[PathLike]:
    """Return the paths that the caller gives; one alone is a list of one."""
    return [given] if isinstance(given, str | os.PathLike) else list(given)


def names(argument: str, given: str | Sequence[str]) -> tuple[str, ...]:
    """Return the names that the caller gives as `argument`; one alone is a list of one.

    Raises `TwipError` for what is no name.
    """
    found = (given,) if isinstance(given, str) else tuple(given)
    if wrong := [name for name in found if not isinstance(name, str)]:
        raise TwipError(f"{argument}: {wrong[0]!r} must be a name")
    return found


def by_name(argument: str, given: Mapping[str, T] | None) -> Mapping[str, T]:
    """Return what the caller gives by name as `argument`, nothing for None. Raises `TwipError` for anything else."""
    if given is None:
        return {}
    if not isinstance(given, Mapping) or not all(isinstance(name, str) for name in given):
        raise TwipError(f"{argument} = {given!r} must be a mapping, such as {{'component.variable': 1.0}}")
    return given
