"""What the commands say: notices and warnings on standard error, rows of results on standard output."""

import sys

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
