"""A temporary folder for unpacked archives, and unpacking that trusts nothing in them."""

import pathlib
import re
import shutil
import stat
import tempfile
import weakref
import zipfile
import zlib

from ...errors import TwipError

MAXIMUM_BYTES = 4 * 1024**3
"""Most that one archive may unpack to."""
MAXIMUM_RATIO = 200
"""Most that an archive may grow by when it is unpacked; binaries and text grow by less than 20."""
UNSUSPICIOUS_BYTES = 64 * 1024**2
"""What an archive may always unpack to."""
MAXIMUM_FILES = 100_000
FALLBACKS = ("/tmp", "/var/tmp")
"""Where to unpack when the path of the usual temporary folder is not plain."""
_PLAIN = re.compile(r"[A-Za-z0-9_./\\: ~-]*")


def plain(path: str) -> bool:
    """Tell whether `path` holds only characters that every FMU takes: some crash on `é`, `#`, `+` or brackets in their
    own path.
    """
    return _PLAIN.fullmatch(path) is not None


class Workspace:
    """A folder for unpacked files with a plain path; it disappears with the last reference, at exit, or by `close`."""

    def __init__(self) -> None:
        for parent in (tempfile.gettempdir(), *FALLBACKS):
            if plain(parent) and pathlib.Path(parent).is_dir():
                try:
                    self.path = pathlib.Path(tempfile.mkdtemp(prefix="twip_", dir=parent))
                except OSError:
                    continue
                break
        else:
            raise TwipError(
                f"temporary folder {tempfile.gettempdir()!r} cannot hold unpacked FMUs: it must be writable and"
                " its path free of characters such as é # + [ ] (set TMPDIR to another folder)"
            )
        self.close = weakref.finalize(self, shutil.rmtree, self.path, ignore_errors=True)

    def folder(self, name: str) -> pathlib.Path:
        """Return a new empty folder in the workspace."""
        prefix = f"{name}_" if name.isidentifier() and name.isascii() else "x_"
        return pathlib.Path(tempfile.mkdtemp(prefix=prefix, dir=self.path))


def unpack(archive: pathlib.Path, target: pathlib.Path, name: str) -> None:
    """Unpack the zip file `archive`, called `name` in messages, into `target`.

    Raises `TwipError` for a damaged archive, entries that lead out of `target`, links, and archives beyond the size
    limit.
    """
    try:
        with zipfile.ZipFile(archive) as file:
            entries = file.infolist()
            _refuse(entries, archive.stat().st_size, name)
            for entry in entries:
                file.extract(entry, target)
    except FileNotFoundError:
        raise TwipError(f"{name}: no such file") from None
    except (
        zipfile.BadZipFile,
        zlib.error,
        EOFError,
        NotImplementedError,
        RuntimeError,
        ValueError,
        UnicodeError,
    ) as error:
        raise TwipError(f"{name}: not a readable zip archive ({error})") from None
    except OSError as error:
        raise TwipError(f"{name}: cannot be unpacked ({error.strerror or error})") from None


def _refuse(entries: list[zipfile.ZipInfo], size: int, name: str) -> None:
    total = sum(entry.file_size for entry in entries)
    if total > max(UNSUSPICIOUS_BYTES, MAXIMUM_RATIO * size):
        raise TwipError(f"{name}: {size} bytes that unpack to {total} bytes are no honest archive")
    if total > MAXIMUM_BYTES or len(entries) > MAXIMUM_FILES:
        raise TwipError(
            f"{name}: {len(entries)} files of {total} bytes exceed the limit of {MAXIMUM_FILES} files,"
            f" {MAXIMUM_BYTES} bytes"
        )
    if (
        entries and min(entry.header_offset for entry in entries) != 0
    ):  # a cut .ssp ends in the directory of an FMU stored in it
        raise TwipError(f"{name}: not a readable zip archive (it is cut off, or something precedes it)")
    seen: set[str] = set()
    for entry in entries:
        path = entry.filename.replace("\\", "/")
        if path.startswith("/") or re.match(r"[A-Za-z]:", path) or ".." in path.split("/"):
            raise TwipError(f"{name}: entry {entry.filename!r} leads out of the archive")
        kind = stat.S_IFMT(entry.external_attr >> 16)
        if kind not in (0, stat.S_IFREG, stat.S_IFDIR):
            what = "link" if kind == stat.S_IFLNK else "device or the like"
            raise TwipError(f"{name}: entry {entry.filename!r} is a {what}")
        path = "/".join(part for part in path.split("/") if part not in ("", "."))
        if path in seen:
            raise TwipError(f"{name}: entry {entry.filename!r} is there twice")
        seen.add(path)
