"""A result file that grows during a run, with one writer: a second run that is told the same path is refused instead
of damaging it, and so is whatever else writes it in between.
"""

import contextlib
import errno
import os
import stat
from pathlib import Path

from ...platform import CREATE, lock

CLOSED = "an FMU or something else in this process has closed its descriptor"
CHANGED = "something else has changed it meanwhile"
MOVED = "something else has removed, moved or replaced it meanwhile"


class InUseError(OSError):
    """Another run, another sink of this one, or another process is writing the file."""


class SoleFile:
    """Creates or replaces a file (and creates its missing folders); what is written is with the operating system.

    The file keeps its old content until the first `write`; without one it stays as it was. Raises `InUseError`, and
    `OSError` or `ValueError` when it cannot be written, here and later; what was written last in part is then cut off,
    and the file is closed. At each `write` and at `close` the descriptor must still be that of the file, and its size
    what was written: an FMU may close descriptors that are not its own, or fork. Devices and pipes are shared.
    """

    def __init__(self, path: Path, keep: int = 0) -> None:
        """Open the file; its first `keep` bytes stay, and what is written follows them."""
        path.parent.mkdir(parents=True, exist_ok=True)
        self._path = path
        self._process = os.getpid()
        try:
            self._file, self._made = os.open(path, CREATE | os.O_EXCL, 0o666), True
        except FileExistsError:
            self._file, self._made = os.open(path, CREATE, 0o666), False
        found = os.fstat(self._file)
        self._regular = stat.S_ISREG(found.st_mode)
        self._identity = found.st_dev, found.st_ino
        self._position = keep
        self._begun = False
        if self._regular:
            try:
                self._lock()
            except InUseError:
                os.close(self._file)
                raise

    def _lock(self) -> None:
        try:
            lock(self._file)
        except BlockingIOError as error:
            raise InUseError(error.errno, "is being written by another run") from None
        except OSError:
            pass  # some network file systems have no locks: there every run is on its own

    @property
    def closed(self) -> bool:
        """Whether nothing more can be written."""
        return self._file < 0

    def write(self, data: bytes) -> None:
        """Append all of `data`."""
        if self.closed:
            raise ValueError("it is closed already")
        self._check()
        rest = memoryview(data)
        try:
            if self._regular and not self._begun:
                os.ftruncate(self._file, self._position)
            self._begun = True
            done = 0
            while done < len(rest):
                done += self._append(rest[done:], self._position + done)
        except OSError:
            self._give_up()
            raise
        self._position += len(data)

    def _append(self, data: memoryview, position: int) -> int:
        # at a position of its own, because whoever inherits the descriptor may move the common one
        return os.pwrite(self._file, data, position) if self._regular else os.write(self._file, data)

    def _check(self) -> None:
        """Raise `OSError` unless the descriptor is that of the file, which holds what was written."""
        if os.getpid() != self._process:
            raise InUseError(errno.EBUSY, "is being written by the process from which this one was forked")
        try:
            found = os.fstat(self._file)
        except OSError as error:
            self._file = -1
            raise OSError(error.errno, CLOSED) from None
        if (found.st_dev, found.st_ino) != self._identity:
            self._file = -1  # it belongs to whoever opened it
            raise OSError(errno.EBADF, CLOSED)
        if self._regular and self._begun and found.st_size != self._position:
            self._give_up()
            raise OSError(errno.EIO, f"{CHANGED}: it had {found.st_size} bytes instead of {self._position}")

    def _give_up(self) -> None:
        """Cut off what is not known to be whole, and close."""
        with contextlib.suppress(OSError):
            if self._regular:
                os.ftruncate(self._file, self._position)
        with contextlib.suppress(OSError):
            os.close(self._file)
        self._file = -1

    def close(self, removed: bool = False) -> None:
        """Let others write the file; without any `write` it is left as it was found. `removed`: by its owner."""
        if self.closed:
            return
        self._check()
        if self._made and not self._begun:
            with contextlib.suppress(OSError):
                found = os.stat(self._path, follow_symlinks=False)
                if (found.st_dev, found.st_ino) == self._identity:
                    self._path.unlink()
        descriptor, self._file = self._file, -1
        os.close(descriptor)
        if self._regular and self._begun and not removed and not self._in_place():
            raise OSError(errno.ENOENT, MOVED)

    def _in_place(self) -> bool:
        """Tell whether the path still leads to the file."""
        try:
            found = os.stat(self._path)
        except OSError:
            return False
        return (found.st_dev, found.st_ino) == self._identity
