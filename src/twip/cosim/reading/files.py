"""What the URIs in a system structure description point to, and reading it.

Supported are relative URIs and `file:` URIs. Within an archive they may not lead out of it.
"""

import pathlib
import urllib.parse
import zipfile
from dataclasses import dataclass

from .problems import Place, Problems
from .xml import MAXIMUM_BYTES, Element, parse_xml


@dataclass(frozen=True)
class Location:
    """Where a document stands."""

    folder: pathlib.Path
    """That relative URIs are relative to."""
    enclosure: pathlib.Path | None
    """The unpacked archive that URIs may not leave, if any."""
    name: str
    """How messages call the document; below an inner archive or folder with the way to it."""

    def beside(self, source: str) -> str:
        """Return how messages call the file that `source` points to."""
        if source.startswith(("/", "file:")):
            return source
        way, _, _ = self.name.rpartition("/")
        return f"{way}/{source}" if way else source

    def resolve(self, source: str, place: Place, problems: Problems) -> tuple[pathlib.Path, str] | None:
        """Return the file that a URI points to, and the URI's fragment; a URI that is not supported is a problem."""
        folder = self.folder.resolve()
        try:
            uri = urllib.parse.urlsplit(source)
            path = (folder / urllib.parse.unquote(uri.path, errors="strict")).resolve()
            special = is_special(path)
        except (ValueError, OSError, RuntimeError) as error:
            problems.add(f"source {source!r} is not a usable path: {error}", place)
            return None
        if uri.scheme not in ("", "file") or uri.netloc not in ("", "localhost") or uri.query:
            problems.add(f"source {source}: only relative paths and file: URIs are supported", place)
            return None
        if self.enclosure is not None and not path.is_relative_to(self.enclosure.resolve()):
            problems.add(f"source {source} leads out of the archive", place)
            return None
        if special:
            problems.add(f"source {source} is a device or the like, not a file", place)
            return None
        return path, urllib.parse.unquote(uri.fragment)


def is_special(path: pathlib.Path) -> bool:
    """Tell whether `path` is a device, pipe or socket: reading it may never end."""
    return path.exists() and not (path.is_file() or path.is_dir())


def is_endless(path: pathlib.Path) -> bool:
    """Tell whether `path` is a device; a pipe that the caller names has an end."""
    return path.is_char_device() or path.is_block_device()


def read_limited(path: pathlib.Path) -> bytes:
    """Return what the file at `path` holds, of one beyond `MAXIMUM_BYTES` that much and a byte. Raises `OSError`."""
    with path.open("rb") as stream:
        return stream.read(MAXIMUM_BYTES + 1)


def read_file(path: pathlib.Path, file: str, problems: Problems, place: Place | None = None) -> Element | None:
    """Read and parse the XML file at `path`, called `file` in messages."""
    if is_special(path):
        problems.add(f"{file} is a device or the like, not a file", place)
        return None
    try:
        data = read_limited(path)
    except OSError as error:
        problems.add(f"{file}: {error.strerror or error}", place)
        return None
    return parse_xml(data, file, problems)


def read_within(fmu: pathlib.Path, source: str, file: str, problems: Problems, place: Place) -> Element | None:
    """Read and parse an XML file inside an FMU, by the relative URI `source`."""
    try:
        uri = urllib.parse.urlsplit(source)
        entry = urllib.parse.unquote(uri.path, errors="strict")
    except ValueError as error:
        problems.add(f"source {source!r} is not a usable path: {error}", place)
        return None
    parts = [part for part in entry.split("/") if part not in ("", ".")]
    odd = uri.scheme or uri.netloc or uri.query or uri.fragment or "\0" in entry or not parts
    if odd or entry.startswith("/") or ".." in parts:
        problems.add(f"source {source}: only relative paths that stay inside the component are supported", place)
        return None
    if fmu.is_dir():
        path = fmu.joinpath(*parts)
        if not path.resolve().is_relative_to(fmu.resolve()):
            problems.add(f"source {source} leads out of the component", place)
            return None
        return read_file(path, file, problems, place)
    try:
        with zipfile.ZipFile(fmu) as archive:
            if archive.getinfo("/".join(parts)).file_size > MAXIMUM_BYTES:
                problems.add(f"{file}: larger than {MAXIMUM_BYTES // 1024 // 1024} MiB, refused", place)
                return None
            data = archive.read("/".join(parts))
    except KeyError:
        problems.add(f"{file}: the component has no such file", place)
        return None
    except Exception as error:  # zipfile raises many kinds on damaged archives
        problems.add(f"{file}: cannot be read: {error}", place)
        return None
    return parse_xml(data, file, problems)
