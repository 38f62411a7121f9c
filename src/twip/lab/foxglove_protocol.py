"""Foxglove's WebSocket protocol: the messages of a server, and what clients ask of it.

Text messages are JSON objects whose `op` names their kind. Binary messages begin with an opcode, little-endian:

    message data    0x01 | u32 subscription | u64 log time in ns | message

Source: github.com/foxglove/ws-protocol, docs/spec.md. Newer viewers ask for the same messages by the subprotocol
`foxglove.sdk.v1`, older ones by `foxglove.websocket.v1`.
"""

import base64
import json
import re
import struct
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

SUBPROTOCOLS = ("foxglove.sdk.v1", "foxglove.websocket.v1")
"""The first that a client offers too is taken."""
ORIGIN = re.compile(r"[a-z][a-z0-9+.-]*://[^/\s]*")
"""Scheme, host and port, as a browser sends them (RFC 6454)."""
WEB_APP = "https://app.foxglove.dev"
"""Origin of Foxglove in a browser."""
DESKTOP = "file://"
"""Origin of Foxglove's desktop program, which is a page from files in Electron (github.com/foxglove/studio,
studio-desktop/src/main/StudioWindow.ts). Browsers send null for files, as for pages without an origin of their own.
"""
_CAPABILITIES = ("parameters", "parametersSubscribe")
_MESSAGE_DATA = struct.Struct("<BIQ")
_BINARY_SCHEMAS = ("protobuf", "flatbuffer")
"""Schema encodings that travel as base64; others are text."""


class ProtocolError(Exception):
    """A message of a client that is not understood; the text says why."""


@dataclass(frozen=True)
class Channel:
    """A stream of messages; names and encodings as MCAP's registry has them."""

    topic: str
    encoding: str
    schema_name: str
    schema_encoding: str
    schema: bytes


@dataclass(frozen=True)
class Subscribe:
    """Asks for the messages of channels: (subscription, channel) pairs."""

    pairs: list[tuple[int, int]]


@dataclass(frozen=True)
class Unsubscribe:
    """Ends subscriptions."""

    subscriptions: list[int]


@dataclass(frozen=True)
class GetParameters:
    """Asks for the values of parameters, of all where no name is given."""

    names: list[str]
    request: str | None


@dataclass(frozen=True)
class SetParameters:
    """Sets parameters: (name, value) pairs, where a value is whatever JSON can hold, None for none."""

    pairs: list[tuple[str, object]]
    request: str | None


@dataclass(frozen=True)
class WatchParameters:
    """Asks to be told, or told no more, when parameters change: all where no name is given."""

    names: list[str]
    on: bool


Request = Subscribe | Unsubscribe | GetParameters | SetParameters | WatchParameters


def server_info(name: str, session: str) -> str:
    """Return the first message of a connection; `session` tells a client whether it has come back to the same run."""
    return json.dumps({"op": "serverInfo", "name": name, "capabilities": _CAPABILITIES, "sessionId": session})


def advertise(channels: Iterable[Channel]) -> str:
    """Return the message that lists the channels; their ids are 1, 2, …."""
    listed = [
        {
            "id": number,
            "topic": channel.topic,
            "encoding": channel.encoding,
            "schemaName": channel.schema_name,
            "schemaEncoding": channel.schema_encoding,
            "schema": base64.b64encode(channel.schema).decode()
            if channel.schema_encoding in _BINARY_SCHEMAS
            else channel.schema.decode(),
        }
        for number, channel in enumerate(channels, 1)
    ]
    return json.dumps({"op": "advertise", "channels": listed})


def message_data(subscription: int, time: int, message: bytes) -> bytes:
    """Return a message of a channel for one subscription; `time` in ns."""
    return _MESSAGE_DATA.pack(1, subscription, time) + message


def parameter_values(values: Mapping[str, float], request: str | None = None) -> str:
    """Return the message that tells the values of parameters; `request` is the id of the request that it answers."""
    listed = [{"name": name, "value": value, "type": "float64"} for name, value in values.items()]
    answer = {} if request is None else {"id": request}
    return json.dumps({"op": "parameterValues", "parameters": listed, **answer})


def error_status(text: str) -> str:
    """Return the message that tells a client what is wrong with what it sent."""
    return json.dumps({"op": "status", "level": 2, "message": text})


def parse(message: str | bytes) -> Request:
    """Return what a client asks for; raises ProtocolError."""
    if isinstance(message, bytes):
        raise ProtocolError("this server takes no binary messages")
    try:
        found = json.loads(message)
    except (ValueError, RecursionError):  # also an integer with thousands of digits
        raise ProtocolError("a text message must be JSON") from None
    if not isinstance(found, dict):
        raise ProtocolError("a text message must be a JSON object")
    op = found.get("op")
    if op == "subscribe":
        return Subscribe([(_id(item, "id"), _id(item, "channelId")) for item in _objects(found, "subscriptions")])
    if op == "unsubscribe":
        return Unsubscribe([_id({"id": item}, "id") for item in _items(found, "subscriptionIds")])
    if op == "getParameters":
        return GetParameters(_names(found), _request(found))
    if op == "setParameters":
        pairs = [(_text(item, "name"), item.get("value")) for item in _objects(found, "parameters")]
        return SetParameters(pairs, _request(found))
    if op in ("subscribeParameterUpdates", "unsubscribeParameterUpdates"):
        return WatchParameters(_names(found), op == "subscribeParameterUpdates")
    raise ProtocolError("op must be one that serverInfo offers")


def _items(found: Mapping[str, Any], key: str) -> list[Any]:
    items = found.get(key)
    if not isinstance(items, list):
        raise ProtocolError(f"{key} must be an array")
    return items


def _objects(found: Mapping[str, Any], key: str) -> list[dict[str, Any]]:
    items = _items(found, key)
    if not all(isinstance(item, dict) for item in items):
        raise ProtocolError(f"{key} must be an array of objects")
    return items


def _id(found: Mapping[str, Any], key: str) -> int:
    value = found.get(key)
    if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value < 1 << 32:
        raise ProtocolError(f"{key} must be an integer from 0 to 4294967295")
    return value


def _text(found: Mapping[str, Any], key: str) -> str:
    value = found.get(key)
    if not isinstance(value, str):
        raise ProtocolError(f"{key} must be a string")
    return value


def _names(found: Mapping[str, Any]) -> list[str]:
    return [_text({"parameterNames": item}, "parameterNames") for item in _items(found, "parameterNames")]


def _request(found: Mapping[str, Any]) -> str | None:
    return None if found.get("id") is None else _text(found, "id")
