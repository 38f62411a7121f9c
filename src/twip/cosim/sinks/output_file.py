"""A text file that a sink writes."""

from pathlib import Path

from ...errors import TwipError
from ..log.sole_file import InUseError, SoleFile


class OutputFile:
    """Grows with each `write`, and what is written is in the file when it returns.

    Missing folders are created. An existing file is replaced by the first `write`. Raises `TwipError`, here and later,
    when another run writes the file or it cannot be written.
    """

    def __init__(self, path: Path):
        self._path = path
        try:
            self._file = SoleFile(path)
        except (OSError, ValueError) as error:
            raise self._failed(error) from None

    def write(self, text: str) -> None:
        """Append a text, in UTF-8."""
        try:
            self._file.write(text.encode("utf-8"))
        except (OSError, ValueError) as error:
            raise self._failed(error) from None

    def close(self) -> None:
        """Close the file; one that was never written is left as it was."""
        try:
            self._file.close()
        except OSError as error:
            raise self._failed(error) from None

    def _failed(self, error: OSError | ValueError) -> TwipError:
        reason = (error.strerror if isinstance(error, OSError) else None) or error
        if isinstance(error, InUseError):
            return TwipError(f"{self._path} {reason}")
        return TwipError(f"{self._path}: cannot be written ({reason})")
