"""The outputs of a run as a table of text (CSV)."""

import csv
import io
import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from ..log.log_event import clean
from ..model.signals import TIME, Channel, columns
from ..values.strings import text_of
from ..values.types import family
from .base import FileSink, RunDetails
from .output_file import OutputFile


def _line(cells: Sequence[str]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerow(cells)
    return text.getvalue()


def _whole(value: float) -> str:
    return repr(int(value))


def _text(number: float) -> str:
    return _line([clean(text_of(number))])[:-1]


_SHOWN: dict[str, Callable[[float], str]] = {"Real": repr, "String": _text}
"""How a CSV file shows values, by family of the type; others as whole numbers."""


class CsvSink(FileSink):
    """A sink that writes `time`, every output, and every connector of the outermost system, in full precision."""

    endings: ClassVar[tuple[str, ...]] = (".csv",)

    def __init__(self, path: str | os.PathLike[str], channels: Sequence[Channel]):
        """Open the file and create its missing folders; an existing one is replaced by the first `write`.

        Raises `TwipError` when another run writes it or it cannot be written.
        """
        names = columns(channels)
        signals = [(channel.component, signal) for channel in channels for signal in channel.signals]
        self._keep = [i for i, (owner, signal) in enumerate(signals) if signal.causality == "output" or not owner]
        self._shown = [_SHOWN.get(family(signals[i][1].type), _whole) for i in self._keep]
        self._header = _line([TIME, *(names[i] for i in self._keep)])
        self._file = OutputFile(Path(path))

    @classmethod
    def open(cls, path: Path, run: RunDetails) -> Self:
        """Open the table of a run."""
        return cls(path, run.channels)

    def write(self, times: NDArray[np.float64], rows: NDArray[np.float64]) -> None:
        """Append the rows; they are in the file when this returns. Raises `TwipError` when they cannot be written."""
        lines = [self._header] if self._header else []
        self._header = ""
        for time, row in zip(times.tolist(), rows[:, self._keep].tolist(), strict=True):
            cells = [show(v) for v, show in zip(row, self._shown, strict=True)]
            lines.append(f"{','.join([repr(time), *cells])}\n")
        self._file.write("".join(lines))

    def event(self, time: float, level: str, source: str, message: str) -> None:
        """Messages have no place in a table of numbers."""

    def close(self) -> None:
        """Close the file."""
        self._file.close()
