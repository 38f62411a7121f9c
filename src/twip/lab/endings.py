"""File names say by their ending what a file is."""

from collections.abc import Sequence
from pathlib import Path

from ..errors import TwipError


def check_ending(path: Path, endings: Sequence[str]) -> None:
    """Raise TwipError when a path has none of these endings; upper and lower case are the same."""
    if path.suffix.lower() not in endings:
        rule = endings[0] if len(endings) == 1 else f"one of {', '.join(endings)}"
        raise TwipError(f"{path}: the ending must be {rule}")
