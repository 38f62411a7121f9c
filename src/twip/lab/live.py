"""A run as it goes, in Foxglove: the channels of a log, and inputs as parameters.

Topics, schemas and times are those of the log, so one layout serves both. A process of its own serves the clients
(needs `websockets`, extra `view`); what they set is taken over between two deliveries of rows.
"""

import json
import socket
import time
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ..cosim import Channel, LiveInputs, declare
from ..cosim.log import MESSAGE_HEAD, ExtraChannel, RowBlock, encode_event, field_numbers, layout
from ..errors import TwipError
from ..extras import optional
from . import foxglove_protocol as protocol
from . import live_link
from .live_link import ServerProcess
from .scene import scene
from .scene.text import TextChannel

RATE = 50.0
"""Rows sent per simulated second; poses have a rate of their own."""
REPEAT = 1.0
"""Simulated time after which a text is sent again, for those who came later, in s."""
HOST, PORT = "127.0.0.1", 8765


class LiveView:
    """A sink that sends rows to whoever is connected; `inputs` may be set from there.

    Web pages are served if their origin is Foxglove's own or among `origins`; so are programs that send none. `say` is
    told at most once that a page was refused, and that the server has ended by itself.
    """

    def __init__(
        self,
        channels: Sequence[Channel],
        metadata: Mapping[str, Mapping[str, str]],
        inputs: LiveInputs,
        host: str = HOST,
        port: int = PORT,
        start_time: float = 0.0,
        origins: Sequence[str] = (),
        say: Callable[[str], None] = lambda _: None,
    ) -> None:
        """Listen; raises TwipError without websockets, for an origin that is none, or if it cannot listen there."""
        optional("websockets", "a live view")
        for origin in origins:
            if not protocol.ORIGIN.fullmatch(origin):
                raise TwipError(f"origin {origin!r} must be SCHEME://HOST or SCHEME://HOST:PORT, without a path")
        recorded = [c for c in channels if c.signals and all(s.type != "String" for s in c.signals)]
        self._columns: list[int] = []
        first = 0
        for channel in channels:
            if channel in recorded:
                self._columns += range(first, first + len(channel.signals))
            first += len(channel.signals)
        extras = scene(channels, metadata)
        schemas, records = declare(recorded, (), start_time, [extra.topic for extra in extras])
        offered = [
            protocol.Channel(r.topic, r.message_encoding, s.name, s.encoding, s.data)
            for r, s in zip(records, schemas, strict=True)
        ]
        self._event_channel = len(offered)  # ids count from 1
        self._extras: list[tuple[ExtraChannel, int]] = list(zip(extras, range(len(offered) + 1, 1 << 31), strict=False))
        offered += [
            protocol.Channel(e.topic, e.message_encoding, e.schema_name, e.schema_encoding, e.schema) for e in extras
        ]
        layouts = [
            (i, layout(field_numbers(len(c.signals)), [s.type for s in c.signals])) for i, c in enumerate(recorded, 1)
        ]
        self._sizes = [MESSAGE_HEAD.itemsize + of.template.size for _, of in layouts]
        self._block = RowBlock(layouts, 1)
        self._start, self._next, self._repeat, self._sent = start_time, 0, 0, 0
        self._inputs, self._say, self._dealt_with, self._told = inputs, say, 0, inputs.present()
        hello = {
            "greeting": [protocol.server_info("twip", str(time.time_ns())), protocol.advertise(offered)],
            "channels": len(offered),
            "values": self._told,
            "origins": [protocol.WEB_APP, protocol.DESKTOP, *origins],
        }
        try:
            family = socket.AF_INET6 if ":" in host else socket.AF_INET
            with socket.create_server((host.strip("[]"), port), family=family) as listening:
                self.address = f"ws://{host}:{listening.getsockname()[1]}"
                self._server = ServerProcess(listening, hello)
        except (OSError, UnicodeError) as error:
            raise TwipError(f"{host}:{port}: the live view cannot listen there ({error})") from None

    def write(self, times: NDArray[np.float64], rows: NDArray[np.float64]) -> None:
        """Take over what clients have set; send the newest row when one is due, and the poses and texts of all rows."""
        self._take()
        if len(times):
            self._send(times, rows)
        self._server.flush()

    def _take(self) -> None:
        before = self._dealt_with
        for kind, payload in self._server.received():
            if kind == live_link.NOTE:
                self._say(payload.decode())
                continue
            for name, value in json.loads(payload):
                self._inputs.offer(name, value)
            self._dealt_with += 1
        if (values := self._inputs.present()) != self._told or self._dealt_with > before:
            self._told = values
            self._server.send(live_link.VALUES, json.dumps([self._dealt_with, values]).encode(), vital=True)

    def _send(self, times: NDArray[np.float64], rows: NDArray[np.float64]) -> None:
        nanoseconds = np.rint((times - self._start) * 1e9).astype(np.uint64)
        now = int(nanoseconds[-1])
        for extra, channel in self._extras:
            if isinstance(extra, TextChannel) and now >= self._repeat:
                extra.repeat()
                self._repeat = now + round(REPEAT * 1e9)
            for instant, message in zip(*extra.messages(nanoseconds, rows), strict=True):
                self._message(channel, int(instant), message.tobytes())
        if now < self._next:
            return
        self._next = now + round(1e9 / RATE)
        self._block.put(0, self._sent, nanoseconds[-1:], rows[-1:, self._columns])
        self._sent += 1
        data, at = self._block.data(1), 0
        for channel, size in enumerate(self._sizes, 1):
            self._message(channel, now, bytes(data[at + MESSAGE_HEAD.itemsize : at + size]))
            at += size

    def _message(self, channel: int, instant: int, message: bytes) -> None:
        self._server.send(live_link.MESSAGE, live_link.MESSAGE_HEAD.pack(channel, instant) + message)

    def event(self, time: float, level: str, source: str, message: str) -> None:
        """Send a message."""
        nanoseconds = max(0, round((time - self._start) * 1e9))
        self._message(self._event_channel, nanoseconds, encode_event(nanoseconds, level, source, message))
        self._server.flush()

    def close(self) -> None:
        """Stop listening."""
        self._server.close()
