"""What hostile clients do to a live view: `python live_attack.py HOST PORT TIMES`."""

import json
import socket
import struct
import sys
from contextlib import ExitStack, suppress

from websockets.exceptions import WebSocketException
from websockets.sync.client import connect

NAME = "plant.push_force"
LARGE = {
    "text": "x" * 10_000_000,
    "array": json.dumps({"op": "setParameters", "parameters": [{"name": NAME, "value": [1.0] * 1_000_000}], "id": "1"}),
}
GONE = (WebSocketException, OSError)
RESET = struct.pack("ii", 1, 0)
"""Lingering of a socket that is reset when it is closed."""


def viewer(host, port):
    return connect(f"ws://{host}:{port}", subprotocols=["foxglove.sdk.v1"], compression=None, close_timeout=0.5)


def large_messages(host, port):
    for content in LARGE.values():
        with suppress(*GONE), viewer(host, port) as client:
            client.send(content)


def connections(host, port):
    """200 at once: some say nothing that is understood, some begin a handshake, some are reset."""
    with ExitStack() as connected:
        for number in range(200):
            plain = connected.enter_context(socket.create_connection((host, port)))
            with suppress(*GONE):
                plain.sendall(b"GET / HTTP/1.1\r\nUpgrade: websocket\r\n" if number % 2 else b"\0" * 1000)
            if number % 4 == 0:
                plain.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, RESET)


def aborted_viewers(host, port):
    for _ in range(20):
        with suppress(*GONE), viewer(host, port) as client:
            client.send(json.dumps({"op": "setParameters", "parameters": [{"name": NAME, "value": 1.0}], "id": "1"}))
            client.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, RESET)
            client.socket.close()


def deaf_viewer(host, port):
    """Ask for much and read nothing."""
    with suppress(*GONE), viewer(host, port) as client:
        client.send(json.dumps({"op": "subscribe", "subscriptions": [{"id": k, "channelId": k} for k in range(1, 99)]}))
        client.socket.settimeout(1.0)
        for _ in range(5000):
            client.send(json.dumps({"op": "getParameters", "parameterNames": [], "id": "x" * 1000}))


if __name__ == "__main__":
    for _ in range(int(sys.argv[3])):
        for attack in (large_messages, connections, aborted_viewers, deaf_viewer):
            attack(sys.argv[1], int(sys.argv[2]))
