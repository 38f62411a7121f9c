"""The process that serves a live view, and what passes between it and the run: frames on a socket.

    frame = u8 kind | u32 bytes | payload

The run never waits for the server: it sends what the socket takes at once, keeps a little, and drops messages beyond.
"""

import contextlib
import json
import os
import socket
import struct
import subprocess
import sys
from collections.abc import Iterator

HEAD = struct.Struct("<BI")
MESSAGE_HEAD = struct.Struct("<IQ")
"""Before the message of a channel: id of the channel, log time in ns."""
HELLO, MESSAGE, VALUES = range(3)
"""From the run: JSON of what a server begins with; a message of a channel; JSON of how many `SET` frames were dealt
with, and the inputs by name.
"""
SET, NOTE = range(3, 5)
"""From the server: JSON of the (name, value) pairs that a client sets; a text for the user."""
_SERVER = "twip.lab.live_server"
_PATH = os.pathsep.join(dict.fromkeys(filter(None, sys.path)))
_START_LIMIT = 10.0
"""Longest that the server may take until it reads, in s."""
END_LIMIT = 3.0
"""Longest that its end is waited for, in s."""
_BUFFER = 1 << 20
_MOST_KEPT = 4 << 20
"""Bytes kept for a server that does not read; messages beyond are dropped."""
_MOST_READ = 1 << 18
"""Bytes taken from the server at once."""


def frame(kind: int, payload: bytes) -> bytes:
    """Return a frame."""
    return HEAD.pack(kind, len(payload)) + payload


class ServerProcess:
    """A process that serves a live view on `listening`, seen from the run; all calls return at once but the first and
    the last.
    """

    def __init__(self, listening: socket.socket, hello: object) -> None:
        """Start it; raises OSError."""
        own, other = socket.socketpair()
        self._socket, self._kept, self._read, self._ended = own, bytearray(), bytearray(), False
        own.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _BUFFER)
        descriptors = (listening.fileno(), other.fileno())
        try:
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-m", _SERVER, *map(str, descriptors)],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                env={**os.environ, "PYTHONPATH": _PATH},
                pass_fds=descriptors,
                start_new_session=True,  # Ctrl-C is for the run alone
            )
        except OSError:
            own.close()
            raise
        finally:
            other.close()
        own.settimeout(_START_LIMIT)
        try:
            own.sendall(frame(HELLO, json.dumps(hello).encode()))
        except OSError:
            self.close()
            raise
        own.setblocking(False)

    def send(self, kind: int, payload: bytes, vital: bool = False) -> None:
        """Keep a frame for `flush`; one that is not vital is dropped when the server does not keep up."""
        if not self._ended and (vital or len(self._kept) + len(payload) < _MOST_KEPT):
            self._kept += frame(kind, payload)

    def flush(self) -> None:
        """Send as much as the socket takes now."""
        with contextlib.suppress(BlockingIOError):
            try:
                while self._kept:
                    del self._kept[: self._socket.send(self._kept)]
            except ConnectionError:  # `received` tells of it
                self._kept.clear()

    def received(self) -> Iterator[tuple[int, bytes]]:
        """Yield the frames that the server has sent, last a `NOTE` when it has ended by itself."""
        with contextlib.suppress(BlockingIOError):
            try:
                part = b"" if self._ended else self._socket.recv(_MOST_READ)
            except ConnectionError:
                part = b""
            self._read += part
            if not part and not self._ended:
                self._ended = True
                self._kept.clear()
                yield NOTE, b"the live view has ended: its server process is gone; the run goes on"
        while len(self._read) >= HEAD.size:
            kind, size = HEAD.unpack_from(self._read)
            if len(self._read) < HEAD.size + size:
                return
            payload = bytes(self._read[HEAD.size : HEAD.size + size])
            del self._read[: HEAD.size + size]
            yield kind, payload

    def close(self) -> None:
        """Send what is kept, and end the process; a second call does nothing."""
        if self._process.returncode is not None:
            return
        with contextlib.suppress(OSError):
            self._socket.settimeout(END_LIMIT)
            self._socket.sendall(self._kept)
            self._socket.shutdown(socket.SHUT_WR)
        try:
            self._process.wait(END_LIMIT)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        finally:
            self._socket.close()
