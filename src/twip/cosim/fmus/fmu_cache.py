"""Unpacked FMUs that stay: one folder per content of an `.fmu` file, shared by all runs and processes of a user.

What an FMU compiles or caches beside its code is there again in the next run. A marker file tells the FMU that its
folder stays. The folders lie in `fmus` below `$TWIP_CACHE`, else `$XDG_CACHE_HOME/twip`, else `~/.cache/twip`; they may
be deleted at any time when no run uses them.
"""

import contextlib
import marshal
import os
import pathlib
import shutil
import sys
import tempfile
import zipfile
import zlib

from ...errors import TwipError
from ..model.fmu import Fmu
from ..reading.archive import plain, unpack
from .description import file_fingerprint

MARKER = "twip-keeps-this-folder"
"""File beside the model description of an FMU in a folder that stays."""
_NOTE = "This unpacked FMU is kept by twip for later runs. When no run uses it, the folder may be deleted.\n"
_PYC_HEAD = 16
"""Bytes before the code in a file of bytecode (PEP 552)."""
_abandoned: set[pathlib.Path] = set()
_compiled: set[pathlib.Path] = set()
"""Folders that hold compiled code, or have nothing to compile."""


class NotKeptError(Exception):
    """An FMU has to be unpacked into a temporary folder; the message says why, empty if there is nothing to tell."""


def cache_root() -> pathlib.Path:
    """Return the folder for what later runs can use again. Raises `NotKeptError` when there is no home folder."""
    given, shared = os.environ.get("TWIP_CACHE"), os.environ.get("XDG_CACHE_HOME", "")
    if given:
        return pathlib.Path(given).absolute()
    if os.path.isabs(shared):
        return pathlib.Path(shared) / "twip"
    try:
        return pathlib.Path.home() / ".cache" / "twip"
    except RuntimeError as error:
        raise NotKeptError(f"FMUs are unpacked for this run only: {error} (set TWIP_CACHE to a folder)") from None


def keep(fmu: Fmu) -> pathlib.Path:
    """Return the kept folder of the archive `fmu`, unpacked now if it is not there or damaged.

    Raises `NotKeptError` where that is impossible or the FMU would compile its code in every run, and `TwipError` if
    the archive is not the one that was read.
    """
    root = cache_root()
    folder = root / "fmus" / fmu.sha256[:32]
    if folder in _abandoned:
        raise NotKeptError
    if not plain(str(root)):
        raise NotKeptError(
            f"FMUs are unpacked for this run only: the path {root} has characters that some FMUs crash on"
            " (set TWIP_CACHE to a folder without é # + [ ] and the like)"
        )
    try:
        if not _intact(folder, fmu.path):
            _renew(folder, fmu)
        _drop_cut_bytecode(folder)
    except OSError as error:
        raise NotKeptError(
            f"FMUs are unpacked for this run only: {root} cannot be written ({error.strerror or error})"
        ) from None
    if not os.access(folder / "resources", os.W_OK) and awaits_compiling(folder):
        raise NotKeptError(f"FMUs are unpacked for this run only: {folder} is read-only and holds no compiled code")
    return folder


def abandon(folder: pathlib.Path) -> None:
    """Use the kept folder no more in this process: the library loaded from it has failed beyond repair."""
    _abandoned.add(folder)


def awaits_compiling(folder: pathlib.Path) -> bool:
    """Tell whether the FMU in `folder` will compile its code: it looks for the marker, and nothing is compiled yet."""
    if folder in _compiled:
        return False
    awaits = (folder / MARKER).is_file() and not any(folder.rglob("*.nbi"))
    awaits = awaits and any(MARKER.encode() in file.read_bytes() for file in (folder / "resources").rglob("*.py"))
    if not awaits:
        _compiled.add(folder)
    return awaits


def _drop_cut_bytecode(folder: pathlib.Path) -> None:
    """Remove bytecode that Python has written in part, as it may on a full disk: it would not compile it again."""
    for file in folder.rglob(f"*.{sys.implementation.cache_tag}.pyc"):
        try:
            marshal.loads(file.read_bytes()[_PYC_HEAD:])
        except (EOFError, ValueError, TypeError):
            file.unlink(missing_ok=True)


def _intact(folder: pathlib.Path, archive: pathlib.Path) -> bool:
    """Tell whether all files of the archive are there as they should be; what else is there does not matter."""
    try:
        if not (folder / MARKER).is_file():
            return False
        with zipfile.ZipFile(archive) as file:
            entries = [entry for entry in file.infolist() if not entry.is_dir()]
        return all(_unchanged(folder / entry.filename, entry) for entry in entries)
    except OSError:
        return False


def _unchanged(file: pathlib.Path, entry: zipfile.ZipInfo) -> bool:
    return file.stat().st_size == entry.file_size and zlib.crc32(file.read_bytes()) == entry.CRC


def _renew(folder: pathlib.Path, fmu: Fmu) -> None:
    """Unpack into a folder beside `folder` and rename it: other processes see all of it or nothing."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    fresh = pathlib.Path(tempfile.mkdtemp(prefix=f"{folder.name[:8]}_", dir=folder.parent))
    old = fresh.with_name(f"{fresh.name}_old")
    try:
        try:
            unpack(fmu.path, fresh, fmu.name)
        except TwipError as error:  # perhaps the disk is full here; a damaged archive is told by the next attempt
            raise NotKeptError(f"FMUs are unpacked for this run only: {error}") from None
        if file_fingerprint(fmu.path) != fmu.sha256:
            raise TwipError(f"FMU {fmu.name} has changed since it was read")
        (fresh / MARKER).write_text(_NOTE, encoding="utf-8")
        if not _intact(folder, fmu.path):
            _compiled.discard(folder)
            with contextlib.suppress(FileNotFoundError):
                folder.rename(old)
            try:
                fresh.rename(folder)
            except OSError:
                if not _intact(folder, fmu.path):  # else another process was faster
                    raise
    finally:
        for rest in (fresh, old):
            shutil.rmtree(rest, ignore_errors=True)
