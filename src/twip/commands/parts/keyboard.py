"""Keys of the terminal while a command runs."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Event, Thread

from ...platform import single_keys

ARROWS = {b"\x1b[A": "up", b"\x1b[B": "down", b"\x1b[C": "right", b"\x1b[D": "left"}
WAIT = 0.1
"""Longest wait in s before the end of the block is noticed."""


@contextmanager
def keys(press: Callable[[str], None]) -> Iterator[bool]:
    """Call `press` in a thread of its own with each key (arrows by name) while the block runs.

    Gives False, and calls nothing, where standard input is no terminal, and on Windows. The terminal is as before
    afterwards.
    """
    if not sys.stdin.isatty():
        yield False
        return
    with single_keys(sys.stdin.fileno()) as typed:
        if typed is None:
            yield False
            return
        ended = Event()

        def listen() -> None:
            while not ended.is_set():
                for key in split(typed(WAIT)):
                    press(key)

        thread = Thread(target=listen, daemon=True)
        thread.start()
        try:
            yield True
        finally:
            ended.set()
            thread.join()


def split(data: bytes) -> Iterator[str]:
    """Yield the keys in what a terminal has sent; unknown sequences are left out."""
    at = 0
    while at < len(data):
        sequence = data[at : at + 3]
        if sequence in ARROWS:
            yield ARROWS[sequence]
            at += 3
        elif data[at : at + 1] == b"\x1b":
            return
        else:
            yield chr(data[at])
            at += 1
