"""What the commands say: notices and warnings on standard error, rows of results on standard output."""

import json
import math
import sys
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray


def notice(text: str) -> None:
    """Tell the user about something that takes a while."""
    print(f"twip: {text} …", file=sys.stderr, flush=True)


def print_rows(*rows: tuple[str, object]) -> None:
    """Print labels and what there is to say about them; rows with nothing are left out."""
    for label, content in rows:
        if content is not None:
            print(f"{label:<19} {content}")


class Warnings:
    """A sink that prints each warning of a component or of the master once, on standard error."""

    def __init__(self) -> None:
        self._said: set[tuple[str, str]] = set()

    def write(self, times: NDArray[np.float64], rows: NDArray[np.float64]) -> None:
        """Rows are for other sinks."""

    def event(self, time: float, level: str, source: str, message: str) -> None:
        """Print a warning that has not been printed yet."""
        if level == "warning" and (source, message) not in self._said:
            self._said.add((source, message))
            where = f"{source} at t = {time:g} s: " if source else ""
            print(f"twip: warning: {where}{message}", file=sys.stderr)

    def close(self) -> None:
        """Nothing is kept open."""


def print_json(content: Mapping[str, object]) -> None:
    """Print an object as one line of JSON; paths become text, numbers that are not finite null."""
    print(json.dumps(_plain(content), ensure_ascii=False, allow_nan=False))


def _plain(value: object) -> object:
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value if value is None or isinstance(value, bool | int | str) else str(value)
