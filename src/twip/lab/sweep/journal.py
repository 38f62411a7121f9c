"""The finished runs of a sweep that is under way: one JSON line each, so that a killed sweep loses none of them."""

import json
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path
from typing import Any

from ...cosim.log import InUseError, SoleFile
from ...errors import TwipError
from .worker import Row

_FORMAT = "twip sweep 1"
_BEGINNING = json.dumps({"format": _FORMAT})[:-1].encode()
"""Of the first line of every journal."""


class Journal:
    """Takes the rows of one sweep. The first line is the plan's description; what follows are rows in any order.

    A file whose first line was cut off, as on a full disk, holds no run: it is begun anew, resumed or not.

    Raises `TwipError` when the file cannot be read or written, belongs to another sweep, or is in use.
    """

    def __init__(self, path: Path, description: dict[str, Any], resume: bool):
        """Begin the journal, or with `resume` go on with the one that is there."""
        self.path = path
        self.rows: dict[int, Row] = {}
        keep = 0
        data = self._data()
        if data is None and resume:
            raise TwipError(f"there is no unfinished sweep to resume: {path} does not exist")
        if data is not None and not _cut_at_the_beginning(data):
            keep = self._read(data, description, resume)
        try:
            self._file = SoleFile(path, keep)
            if not keep:
                self._write([{"format": _FORMAT, "sweep": description}])
        except (OSError, ValueError) as error:
            raise self._failed(error) from None

    def add(self, rows: Iterable[Row]) -> None:
        """Keep finished runs; they are with the operating system when this returns."""
        new = list(rows)
        try:
            self._write([asdict(row) for row in new])
        except (OSError, ValueError) as error:
            raise self._failed(error) from None
        self.rows.update((row.number, row) for row in new)

    def close(self, forget: bool) -> None:
        """Close the file; with `forget` it is needed no more."""
        if forget:
            self.path.unlink(missing_ok=True)
        try:
            self._file.close(removed=forget)
        except OSError as error:
            raise self._failed(error) from None

    def _write(self, records: Iterable[dict[str, Any]]) -> None:
        self._file.write("".join(f"{json.dumps(record)}\n" for record in records).encode())

    def _data(self) -> bytes | None:
        """Return what the file holds; None if there is none."""
        try:
            return self.path.read_bytes()
        except FileNotFoundError:
            return None
        except OSError as error:
            raise TwipError(f"{self.path}: cannot be read ({error.strerror})") from None

    def _read(self, data: bytes, description: dict[str, Any], resume: bool) -> int:
        """Read the rows that are there, and return the length of what is whole."""
        whole = data[: data.rfind(b"\n") + 1]
        try:
            head, *lines = [json.loads(line) for line in whole.splitlines()]
            if head["format"] != _FORMAT:
                raise ValueError
            theirs = dict(head["sweep"])
            for line in lines:
                row = Row(int(line["number"]), str(line["verdict"]), line["error"], dict(line["metrics"]))
                self.rows[row.number] = row
        except (ValueError, KeyError, TypeError):
            raise TwipError(f"{self.path} is no journal of a sweep: remove it, or take another --out") from None
        if not resume:
            raise TwipError(
                f"{self.path} holds the finished runs of a sweep that was not completed: --resume does the rest"
            )
        ours = json.loads(json.dumps(description))
        if differing := [key for key in ours | theirs if ours.get(key) != theirs.get(key)]:
            raise TwipError(f"{self.path} belongs to another sweep: {', '.join(map(_words, differing))} differ")
        return len(whole)

    def _failed(self, error: OSError | ValueError) -> TwipError:
        if isinstance(error, InUseError):
            return TwipError(f"{self.path} {error.strerror or 'is in use'}")
        return TwipError(f"{self.path}: cannot be written ({getattr(error, 'strerror', None) or error})")


def _cut_at_the_beginning(data: bytes) -> bool:
    """Tell whether a file is a journal that ends before its first line does."""
    return b"\n" not in data and (_BEGINNING.startswith(data) or data.startswith(_BEGINNING))


def _words(key: str) -> str:
    return {"provenance": "FMUs, parameters or start values"}.get(key, key.replace("_", " "))
