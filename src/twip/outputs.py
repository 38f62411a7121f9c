"""How files are written: whole or not at all. A file that is there stays as it is until the new one is complete.

What grows during a run (logs, CSV files, the journal of a sweep) is written in place instead, by
`cosim.log.sole_file`: it must be readable while it grows and after the process was killed.
"""

import contextlib
import errno
import os
import secrets
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from .errors import TwipError
from .platform import CREATE_NEW, set_mode


def make_writable(folder: Path) -> None:
    """Create a folder if it is missing; raises TwipError when no file can be written there."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except (OSError, ValueError) as error:
        raise _refusal(folder, error) from None


def write_file(path: Path, data: bytes) -> None:
    """Create or replace the file at `path`, and create its missing folders; see `replacing`."""
    with replacing(path) as stream:
        stream.write(data)


@contextmanager
def replacing(path: Path) -> Iterator[BinaryIO]:
    """Give a stream whose content becomes the file at `path` when the block ends without an exception.

    The content goes to a scratch file in the same folder, reaches the disk, and is then renamed. After a failure the
    old file is untouched and nothing is left behind. The scratch file is created exclusively under a name that cannot
    be guessed, so that no link leads it elsewhere. A link at `path` itself keeps leading to its file, whose permissions
    stay; devices and pipes are written directly. Missing folders are created.

    Raises TwipError when the file cannot be written; every `OSError` within the block counts as that.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError) as error:
        raise _refusal(path.parent, error) from None
    try:
        target = Path(os.path.realpath(path))
        mode = _mode(target)
    except (OSError, ValueError) as error:  # ValueError: a null byte
        raise _refusal(path, error) from None
    try:
        with _scratch(target, mode) if mode is None or stat.S_ISREG(mode) else target.open("wb") as stream:
            yield stream
    except OSError as error:
        raise _refusal(path, error) from None


@contextmanager
def _scratch(target: Path, mode: int | None) -> Iterator[BinaryIO]:
    """Give a stream that replaces `target` at the end; `mode` is that of the file which is there."""
    scratch = target.with_name(f".twip-{secrets.token_hex(8)}")
    stream = os.fdopen(os.open(scratch, CREATE_NEW, 0o666), "wb")
    try:
        if mode is not None:
            set_mode(stream.fileno(), stat.S_IMODE(mode))
        yield stream
        stream.flush()
        os.fsync(stream.fileno())
        stream.close()
        scratch.replace(target)
    except BaseException:
        with contextlib.suppress(OSError):
            stream.close()
        with contextlib.suppress(OSError):
            scratch.unlink()
        raise


def _mode(target: Path) -> int | None:
    """Return type and permissions of the file that is there, None without one; `OSError` if it may not be replaced."""
    try:
        mode = target.stat().st_mode
    except FileNotFoundError:
        return None
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
    if not os.access(target, os.W_OK):  # a file that is write-protected is to stay
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
    return mode


def _refusal(path: Path, error: OSError | ValueError) -> TwipError:
    reason = (error.strerror if isinstance(error, OSError) else None) or error
    return TwipError(f"{path}: cannot be written: {reason}")
