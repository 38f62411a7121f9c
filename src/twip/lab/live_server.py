"""Serves a live view to Foxglove, in a process of its own: `python -m twip.lab.live_server LISTENING LINK`.

Whatever clients do costs this process time, never the run's. Each client gets what it subscribed to through a queue of
its own, which drops the oldest messages when the client does not keep up. It ends when the run closes the link.
"""

import asyncio
import contextlib
import json
import logging
import os
import socket
import sys
from collections import deque
from http import HTTPStatus
from typing import Any

from websockets.asyncio.server import ServerConnection, serve
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response
from websockets.typing import Origin, Subprotocol

from . import foxglove_protocol as protocol
from .live_link import HEAD, HELLO, MESSAGE, MESSAGE_HEAD, NOTE, SET, VALUES, frame

MOST_CLIENTS = 16
MOST_BYTES = 1 << 18
"""Of a message of a client: one with more ends the connection before it is read."""
MOST_QUEUED = 2 << 20
"""Bytes that wait for one client."""
MOST_UNKNOWN = 20
"""Parameters that a client may set at once beyond the number that there are."""
MOST_TEXT = 200
"""Characters of a name or a value that is passed on to the run."""
OPEN_LIMIT, ANSWER_LIMIT, END_LIMIT = 5.0, 3.0, 0.5
"""Longest that a handshake, the run's answer and the end of a connection are waited for, in s."""
NICENESS = 5
"""The run comes first where processors are scarce."""


class Client:
    """A connected viewer: what it subscribed to, and what waits for it."""

    def __init__(self, connection: ServerConnection) -> None:
        self.connection = connection
        self.subscriptions: dict[int, int] = {}
        """Subscription by channel."""
        self.watched: set[str] = set()
        """Parameters whose changes it is told."""
        self._queue: deque[str | bytes] = deque()
        self._queued = 0
        self._wake = asyncio.Event()

    def put(self, message: str | bytes) -> None:
        """Queue a message, and drop the oldest if too much waits."""
        self._queue.append(message)
        self._queued += len(message)
        while self._queued > MOST_QUEUED and len(self._queue) > 1:
            self._queued -= len(self._queue.popleft())
        self._wake.set()

    async def send(self) -> None:
        """Send what is queued, as fast as the client takes it, until it is gone."""
        with contextlib.suppress(ConnectionClosed):
            while True:
                while self._queue:
                    message = self._queue.popleft()
                    self._queued -= len(message)
                    await self.connection.send(message)
                self._wake.clear()
                await self._wake.wait()

    @property
    def idle(self) -> bool:
        """Whether nothing waits."""
        return not self._queue


class Server:
    """Passes messages of the run to clients, and what they set to the run."""

    def __init__(self, hello: dict[str, Any], link: asyncio.StreamWriter) -> None:
        self._greeting: list[str] = hello["greeting"]
        self._values: dict[str, float] = hello["values"]
        self.origins: list[Origin | None] = [None, *hello["origins"]]
        self._channels: int = hello["channels"]
        self._link = link
        self._clients: set[Client] = set()
        self._setting, self._settled = asyncio.Lock(), asyncio.Condition()
        self._asked = self._dealt_with = 0
        self._noted = False

    async def take(self, kind: int, payload: bytes) -> None:
        """Take a frame of the run."""
        if kind == MESSAGE:
            channel, time = MESSAGE_HEAD.unpack_from(payload)
            message = payload[MESSAGE_HEAD.size :]
            for client in self._clients:
                if channel in client.subscriptions:
                    client.put(protocol.message_data(client.subscriptions[channel], time, message))
        elif kind == VALUES:
            self._dealt_with, values = json.loads(payload)
            changed = {name: value for name, value in values.items() if self._values.get(name) != value}
            self._values = values
            for client in self._clients:
                if told := {name: value for name, value in changed.items() if name in client.watched}:
                    client.put(protocol.parameter_values(told))
            async with self._settled:
                self._settled.notify_all()

    async def serve(self, connection: ServerConnection) -> None:
        """Serve a client until it goes."""
        client = Client(connection)
        self._clients.add(client)
        sending = None
        try:
            for text in self._greeting:
                await connection.send(text)
            sending = asyncio.create_task(client.send())
            async for message in connection:
                try:
                    answer = await self._answer(client, protocol.parse(message))
                except protocol.ProtocolError as error:
                    answer = protocol.error_status(str(error))
                if answer is not None:
                    await connection.send(answer)  # a client that does not read its answers is heard no more
        except ConnectionClosed:
            pass
        finally:
            self._clients.discard(client)
            if sending is not None:
                sending.cancel()

    async def _answer(self, client: Client, request: protocol.Request) -> str | None:
        """Do what a client asks for, and return what to answer."""
        match request:
            case protocol.Subscribe(pairs):
                return _subscribe(client, pairs, self._channels)
            case protocol.Unsubscribe(subscriptions):
                gone = set(subscriptions)
                client.subscriptions = {c: s for c, s in client.subscriptions.items() if s not in gone}
            case protocol.GetParameters(names, asked):
                wanted = set(names)
                found = {n: value for n, value in self._values.items() if n in wanted or not wanted}
                return protocol.parameter_values(found, asked)
            case protocol.SetParameters(pairs, asked):
                await self._set(pairs)
                return None if asked is None else protocol.parameter_values(self._values, asked)
            case protocol.WatchParameters(names, on):
                meant = set(names or self._values) & set(self._values)
                client.watched = client.watched | meant if on else client.watched - meant
        return None

    async def _set(self, pairs: list[tuple[str, object]]) -> None:
        """Let the run set inputs, one request at a time, so that it has little to do however many are sent."""
        most = len(self._values) + MOST_UNKNOWN
        if len(pairs) > most:
            raise protocol.ProtocolError(f"at most {most} parameters can be set at once")
        async with self._setting:
            self._asked += 1
            self._link.write(frame(SET, json.dumps([(_short(n), _plain(value)) for n, value in pairs]).encode()))
            asked = self._asked
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(ANSWER_LIMIT), self._settled:
                    await self._settled.wait_for(lambda: self._dealt_with >= asked)

    def crowded(self, connection: ServerConnection, request: Request) -> Response | None:  # noqa: ARG002
        """Refuse a client more than there may be, before the handshake."""
        if len(self._clients) < MOST_CLIENTS:
            return None
        return connection.respond(HTTPStatus.SERVICE_UNAVAILABLE, f"there are {MOST_CLIENTS} viewers already\n")

    def note_refusal(self, connection: ServerConnection, request: Request, response: Response) -> None:  # noqa: ARG002
        """Tell the user of the first page that is refused for its origin."""
        if response.status_code == HTTPStatus.FORBIDDEN and not self._noted:
            self._noted = True
            origin = _short(request.headers.get("Origin", ""))
            page = (
                "a page without an origin of its own (a file, a frame)" if origin == "null" else f"a page of {origin}"
            )
            advice = f"; --live-origin {origin} allows it" if protocol.ORIGIN.fullmatch(origin) else ""
            self.note(f"{page} is not allowed to see or steer the run{advice}")

    def note(self, text: str) -> None:
        """Tell the user something."""
        self._link.write(frame(NOTE, text.encode(errors="replace")))

    async def finish(self) -> None:
        """Let clients have what is queued for them, for a moment."""
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(END_LIMIT):
                while not all(client.idle for client in self._clients):
                    await asyncio.sleep(0.01)


def _subscribe(client: Client, pairs: list[tuple[int, int]], channels: int) -> str | None:
    problem = ""
    taken = set(client.subscriptions.values())
    for subscription, channel in pairs:
        if not 1 <= channel <= channels:
            problem = f"there is no channel {channel}"
        elif channel in client.subscriptions or subscription in taken:
            problem = f"channel {channel} or subscription {subscription} is taken already"
        else:
            client.subscriptions[channel] = subscription
            taken.add(subscription)
    return protocol.error_status(problem) if problem else None


def _short(text: str) -> str:
    """Return a text that can be printed on one line."""
    cut = text if len(text) <= MOST_TEXT else f"{text[:MOST_TEXT]}…"
    return "".join(character if character.isprintable() else "�" for character in cut)


def _plain(value: object) -> object:
    """Return what of a value is passed on: anything long is refused whatever it is."""
    text = json.dumps(value)
    return value if len(text) <= MOST_TEXT else _short(text)


async def run(listening: socket.socket, link: socket.socket) -> None:
    """Serve until the run closes the link."""
    reader, writer = await asyncio.open_connection(sock=link)

    async def received() -> tuple[int, bytes]:
        kind, size = HEAD.unpack(await reader.readexactly(HEAD.size))
        return kind, await reader.readexactly(size)

    asyncio.get_running_loop().set_exception_handler(lambda *_: None)  # such as too many open files while accepting
    with contextlib.suppress(asyncio.IncompleteReadError, ConnectionError):
        kind, payload = await received()
        assert kind == HELLO
        server = Server(json.loads(payload), writer)
        serving = await serve(
            server.serve,
            sock=listening,
            origins=server.origins,
            subprotocols=[Subprotocol(name) for name in protocol.SUBPROTOCOLS],
            process_request=server.crowded,
            process_response=server.note_refusal,
            compression=None,  # costs more than it saves on one computer
            max_size=MOST_BYTES,
            open_timeout=OPEN_LIMIT,
            close_timeout=END_LIMIT,
        )
        try:
            while True:
                await server.take(*await received())
        finally:
            await server.finish()
            serving.close()
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(2.0 * END_LIMIT):
                    await serving.wait_closed()


if __name__ == "__main__":
    os.nice(NICENESS)
    logging.disable()  # a client that goes wrong is no news
    asyncio.run(run(socket.socket(fileno=int(sys.argv[1])), socket.socket(fileno=int(sys.argv[2]))))
