"""A result file with one writer: a second run that is told the same path is refused instead of damaging it."""

import contextlib
import fcntl
import os
import stat
from pathlib import Path


class InUseError(OSError):
    """Another run, or another sink of this one, is writing the file."""


class SoleFile:
    """Creates or replaces a file (and creates its missing folders); what is written is with the operating system.

    The file keeps its old content until nobody else writes it. Raises `InUseError`, and `OSError` or `ValueError` when
    it cannot be written, here and later; what was written last in part is then cut off, and the file is closed.
    Devices and pipes are shared.
    """

    def __init__(self, path: Path, keep: int = 0) -> None:
        """Open the file; its first `keep` bytes stay, and what is written follows them."""
        path.parent.mkdir(parents=True, exist_ok=True)
        self._stream = os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT, 0o666), "wb", buffering=0)
        self._position = keep
        if stat.S_ISREG(os.fstat(self._stream.fileno()).st_mode):
            try:
                self._lock()
                self._stream.truncate(keep)
                self._stream.seek(keep)
            except OSError:
                self._stream.close()
                raise

    def _lock(self) -> None:
        try:
            fcntl.flock(self._stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise InUseError(error.errno, "is being written by another run") from None
        except OSError:
            pass  # some network file systems have no locks: there every run is on its own

    @property
    def closed(self) -> bool:
        """Whether nothing more can be written."""
        return self._stream.closed

    def write(self, data: bytes) -> None:
        """Append all of `data`."""
        rest = memoryview(data)
        try:
            while rest:
                rest = rest[self._stream.write(rest) :]
        except (OSError, ValueError):  # ValueError: already closed
            with contextlib.suppress(OSError, ValueError):
                os.ftruncate(self._stream.fileno(), self._position)
            with contextlib.suppress(OSError):
                self._stream.close()
            raise
        self._position += len(data)

    def close(self) -> None:
        """Let others write the file."""
        self._stream.close()
