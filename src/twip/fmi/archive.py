"""Zip archives whose bytes depend on their content alone."""

import zipfile
from collections.abc import Mapping
from pathlib import Path

from ..outputs import replacing

TIME = (1980, 1, 1, 0, 0, 0)
"""Modification time of every entry: the earliest that the format knows."""


def write_archive(path: Path, files: Mapping[str, bytes], first: str) -> None:
    """Write `files` (name in the archive → content) to `path`, `first` in front, the others sorted.

    Entries are stored, since compressors differ between zlib versions; times and permissions are fixed. The file
    appears whole or not at all. Raises TwipError when it cannot be written.
    """
    with replacing(path) as stream, zipfile.ZipFile(stream, "w", zipfile.ZIP_STORED) as archive:
        for name in sorted(files, key=lambda n: (n != first, n)):
            entry = zipfile.ZipInfo(name, TIME)
            entry.create_system = 3  # Unix, so that the permissions below are read as such
            entry.external_attr = 0o100644 << 16
            archive.writestr(entry, files[name])
