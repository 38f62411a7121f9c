"""What passes between a run and the processes of its isolated FMUs: frames on a socket, and memory that all share.

Requests are pickled: they come from the run. Replies are not: the process that sends them runs the code of an FMU.
"""

import ctypes
import mmap
import os
import pathlib
import socket
import struct
import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...platform import shared_memory
from ..model.schedule import ComponentPorts
from ..model.system import Component

START, CALL, ADVANCE = range(3)
"""Requests: a `Start`; a method of the instance or its ports; a step."""
DONE, FAILED = range(3, 5)
"""Replies: what a method returned; its failure, as `isolation_child.told` writes it."""
MESSAGE, NUMBER_OF, TEXT_OF = range(5, 8)
"""Before a reply: a log message; a question for the number of a text, and for the text of a number, which are answered
by a frame of the same kind.
"""
NUMBER = struct.Struct("<d")
FINAL, REPEATABLE, END = b"0", b"1", b"2"
"""First byte of a failure: for good, one after which a smaller step from an earlier state may succeed, and the request
to end the simulation.
"""
SETTING, STEPPING, GETTING = range(3)
"""What an instance is at within a step."""
STEP = struct.Struct("<ddddd")
"""A step, all in s: simulated time while inputs are set (NaN if they are not) and while the step is done, where it
begins and its size (NaN if there is none), simulated time while outputs are read.
"""
_HEAD = struct.Struct("<BQ")
_MAXIMUM_BYTES = 4 * 1024**3
_BLOCK, _MAXIMUM_BLOCK = 4096, 1 << 20
"""Bytes asked for at once, at least and at most: a large buffer for a small frame costs more than its way."""
_WORD = ctypes.sizeof(ctypes.c_double)


@dataclass(frozen=True)
class Start:
    """The first request: what an instance is made of."""

    component: Component
    folder: pathlib.Path
    """The unpacked FMU."""
    ports: ComponentPorts
    index: int
    """Of the component among `components`."""
    columns: int
    components: int
    time: float
    """Start time in s."""


class Wire:
    """One end of a connection that carries frames: a kind and bytes."""

    def __init__(self, end: socket.socket):
        self._socket = end
        self._rest = b""

    def send(self, kind: int, payload: bytes = b"", deadline: float | None = None) -> None:
        """Send a frame. Raises as `receive`."""
        self._limit(deadline)
        self._socket.sendall(_HEAD.pack(kind, len(payload)) + payload)

    def receive(self, deadline: float | None = None) -> tuple[int, bytes]:
        """Return the next frame, at the latest at `deadline` on the monotonic clock.

        Raises `TimeoutError`, and `ConnectionError` when the other end is gone.
        """
        self._fill(_HEAD.size, deadline)
        kind, size = _HEAD.unpack_from(self._rest)
        if size > _MAXIMUM_BYTES:
            raise ConnectionError(f"a frame of {size} bytes")
        end = _HEAD.size + size
        self._fill(end, deadline)
        frame, self._rest = self._rest[_HEAD.size : end], self._rest[end:]
        return kind, frame

    def _fill(self, size: int, deadline: float | None) -> None:
        if len(self._rest) >= size:
            return
        parts, have = [self._rest], len(self._rest)
        while have < size:
            self._limit(deadline)
            parts.append(self._socket.recv(min(max(size - have, _BLOCK), _MAXIMUM_BLOCK)))
            have += len(parts[-1])
            if not parts[-1]:
                raise ConnectionResetError("the other end is closed")
        self._rest = b"".join(parts)

    def _limit(self, deadline: float | None) -> None:
        """Let what is there already be read also after the deadline: this process may have been stopped."""
        if deadline is not None:
            self._socket.settimeout(max(deadline - time.monotonic(), 1e-3))

    def close(self) -> None:
        """Close this end."""
        self._socket.close()


class SharedValues:
    """The value vector of a run, and what each instance is at, in memory that other processes can map."""

    def __init__(self, columns: int, components: int, descriptor: int | None = None):
        """Create the memory, or map that of `descriptor`."""
        size = (columns + components + 1) * _WORD
        self.descriptor = shared_memory(size) if descriptor is None else descriptor
        memory = mmap.mmap(self.descriptor, size)
        self.values = (ctypes.c_double * columns).from_buffer(memory)
        self.doing: NDArray[np.float64] = np.frombuffer(memory, np.float64, components, columns * _WORD)
        """`SETTING`, `STEPPING` or `GETTING` (components,)."""

    def close(self) -> None:
        """Close the descriptor; the values stay."""
        os.close(self.descriptor)
