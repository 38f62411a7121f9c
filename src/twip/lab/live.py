"""A run as it goes, in Foxglove: a websocket server with the channels of a log, and inputs as parameters.

Needs foxglove-sdk (extra `view`). Topics, schemas and times are those of the log, so one layout serves both.
"""

from collections.abc import Mapping, Sequence
from importlib import import_module
from importlib.util import find_spec
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..cosim.log import log_event
from ..cosim.log.log_extra import ExtraChannel
from ..cosim.log.log_rows import MESSAGE_HEAD, RowBlock
from ..cosim.log.log_schema import field_numbers, layout
from ..cosim.log.mcap_log import declare
from ..cosim.record import Channel
from ..cosim.scenario.live_inputs import LiveInputs
from ..errors import TwipError
from .scene import scene
from .scene.text import TextChannel

RATE = 50.0
"""Rows sent per simulated second; poses have a rate of their own."""
REPEAT = 1.0
"""Simulated time after which a text is sent again, for those who came later, in s."""
HOST, PORT = "127.0.0.1", 8765


class LiveView:
    """A sink that sends rows to whoever is connected; `inputs` may be set from there."""

    def __init__(
        self,
        channels: Sequence[Channel],
        metadata: Mapping[str, Mapping[str, str]],
        inputs: LiveInputs,
        host: str = HOST,
        port: int = PORT,
        start_time: float = 0.0,
    ) -> None:
        """Listen; raises TwipError without foxglove-sdk, or where the port cannot be had."""
        if find_spec("foxglove") is None:
            raise TwipError("foxglove-sdk is not installed: pip install -e '.[view]'")
        foxglove: Any = import_module("foxglove")
        websocket: Any = import_module("foxglove.websocket")
        recorded = [c for c in channels if c.signals and all(s.type != "String" for s in c.signals)]
        self._columns: list[int] = []
        first = 0
        for channel in channels:
            if channel in recorded:
                self._columns += range(first, first + len(channel.signals))
            first += len(channel.signals)
        extras = scene(channels, metadata)
        schemas, records = declare(recorded, (), start_time, [extra.topic for extra in extras])
        self._context = context = foxglove.Context()  # lives as long as its channels

        def made(topic: str, encoding: str, name: str, schema_encoding: str, data: bytes, about: dict[str, str]) -> Any:
            schema = foxglove.Schema(name=name, encoding=schema_encoding, data=data)
            return foxglove.Channel(topic, schema=schema, message_encoding=encoding, metadata=about, context=context)

        self._channels = [
            made(r.topic, r.message_encoding, s.name, s.encoding, s.data, r.metadata)
            for r, s in zip(records, schemas, strict=True)
        ]
        self._extras: list[tuple[ExtraChannel, Any]] = [
            (e, made(e.topic, e.message_encoding, e.schema_name, e.schema_encoding, e.schema, {})) for e in extras
        ]
        layouts = [
            (i, layout(field_numbers(len(c.signals)), [s.type for s in c.signals])) for i, c in enumerate(recorded, 1)
        ]
        self._sizes = [MESSAGE_HEAD.itemsize + of.template.size for _, of in layouts]
        self._block = RowBlock(layouts, 1)
        self._start, self._next, self._repeat, self._sent = start_time, 0, 0, 0
        try:
            self._server: Any = foxglove.start_server(
                name="twip",
                host=host,
                port=port,
                capabilities=[websocket.Capability.Parameters],
                server_listener=_Listener(inputs, websocket.Parameter),
                context=context,
            )
        except (OSError, RuntimeError, ValueError) as error:
            raise TwipError(f"{host}:{port}: the live view cannot listen there ({error})") from None
        self.address = f"ws://{host}:{self._server.port}"

    def write(self, times: NDArray[np.float64], rows: NDArray[np.float64]) -> None:
        """Send the newest row when one is due, and the poses and texts of all rows."""
        if not len(times):
            return
        nanoseconds = np.rint((times - self._start) * 1e9).astype(np.uint64)
        now = int(nanoseconds[-1])
        for extra, channel in self._extras:
            if isinstance(extra, TextChannel) and now >= self._repeat:
                extra.repeat()
                self._repeat = now + round(REPEAT * 1e9)
            for time, message in zip(*extra.messages(nanoseconds, rows), strict=True):
                channel.log(message.tobytes(), log_time=int(time))
        if now < self._next:
            return
        self._next = now + round(1e9 / RATE)
        self._block.put(0, self._sent, nanoseconds[-1:], rows[-1:, self._columns])
        self._sent += 1
        data, at = self._block.data(1), 0
        for channel, size in zip(self._channels, self._sizes, strict=False):
            channel.log(bytes(data[at + MESSAGE_HEAD.itemsize : at + size]), log_time=now)
            at += size

    def event(self, time: float, level: str, source: str, message: str) -> None:
        """Send a message."""
        nanoseconds = max(0, round((time - self._start) * 1e9))
        self._channels[-1].log(log_event.encode(nanoseconds, level, source, message), log_time=nanoseconds)

    def close(self) -> None:
        """Stop listening."""
        self._server.stop()


class _Listener:
    """Shows the inputs as parameters, and sets them; see foxglove's `ServerListener`."""

    def __init__(self, inputs: LiveInputs, parameter: Any) -> None:
        self._inputs = inputs
        self._parameter = parameter

    def on_get_parameters(self, client: object, names: list[str], request_id: str | None = None) -> list[Any]:  # noqa: ARG002
        """Return inputs by name, all without names."""
        return [
            self._parameter(name, value=self._inputs[name]) for name in self._inputs.names if name in names or not names
        ]

    def on_set_parameters(self, client: object, parameters: list[Any], request_id: str | None = None) -> list[Any]:
        """Set the inputs that can take their values, the run tells of the others; return them all as they are."""
        for parameter in parameters:
            self._inputs.offer(parameter.name, parameter.get_value())
        return self.on_get_parameters(client, [], request_id)

    def __getattr__(self, name: str) -> Any:
        """Take every other call of the server as nothing."""
        if name.startswith("on_"):
            return lambda *_: None
        raise AttributeError(name)
