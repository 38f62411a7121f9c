"""Folders for results are checked before what takes a while."""

import tempfile
from pathlib import Path

from .errors import TwipError


def make_writable(folder: Path) -> None:
    """Create a folder if it is missing; raises TwipError when no file can be written there."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise TwipError(f"{folder}: cannot be written: {error.strerror}") from None
