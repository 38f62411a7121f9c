"""What passes between a run and the processes of its isolated FMUs: frames on a socket, and memory that all share.

Requests are pickled: they come from the run. Replies are not: the process that sends them runs the code of an FMU.
"""

import ctypes
import json
import mmap
import os
import pathlib
import socket
import struct
import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...errors import TwipError
from ...platform import shared_memory
from ..model.schedule import ComponentPorts
from ..model.system import Component
from .component import ComponentError, EndRequestedError

START, CALL, ADVANCE = range(3)
"""Requests: a `Start`; a method of the instance or its ports; a step."""
DONE, FAILED = range(3, 5)
"""Replies: what a method returned; its failure, as `write_failure` has it."""
MESSAGE, NUMBER_OF, TEXT_OF = range(5, 8)
"""Before a reply: a log message; a question for the number of a text, and for the text of a number, which are answered
by a frame of the same kind.
"""
NUMBER = struct.Struct("<d")
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


def write_failure(error: TwipError) -> bytes:
    """Return a failure as `read_failure` takes it."""
    own = error if isinstance(error, ComponentError) else ComponentError()
    told = {
        "problems": [str(problem) for problem in error.problems],
        "time": own.time,
        "call": own.call,
        "repeatable": own.repeatable,
        "ends": isinstance(error, EndRequestedError),
    }
    return json.dumps(told).encode()


def read_failure(payload: bytes, component: str) -> ComponentError:
    """Return the failure of a component as the run raises it again."""
    told = json.loads(payload)
    kind = EndRequestedError if told["ends"] else ComponentError
    return kind(
        told["problems"], component=component, time=told["time"], call=told["call"], repeatable=told["repeatable"]
    )


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
