"""What takes the rows of a run, one class in one file each. A new file is a new kind of sink (docs/extending.md)."""

from functools import cache
from pathlib import Path

from ..reading.family import members
from .base import FileSink, RunDetails
from .csv_sink import CsvSink


@cache
def file_sinks() -> dict[str, type[FileSink]]:
    """Return the sinks that write files, by the endings of the files."""
    found = [item for item in members(__name__, __path__) if issubclass(item, FileSink)]
    return {ending: item for item in found for ending in item.endings}


def open_sink(path: Path, run: RunDetails) -> FileSink:
    """Open the sink that a file's ending asks for, whose case does not matter; CSV where no sink has the ending.

    Raises `TwipError` when it cannot be written.
    """
    return file_sinks().get(path.suffix.lower(), CsvSink).open(path, run)
