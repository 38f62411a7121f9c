"""Time series from an MCAP file of any robot: JSON, protobuf, or ROS 2 messages, each signal `topic.field`."""

import json
import struct
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...cosim import nearest
from ...cosim.log import BODY_HEAD, DECODING_ERRORS, DamagedError, Scan, bytes_of, damage_told, reason_of, scan
from ...errors import TwipError
from . import protobuf, ros2
from .fields import MOST_LISTED, Steps, listed, locate, pick

SAMPLED = 20
"""Messages of a topic that are looked at to list its fields."""
INTEGERS = 2.0**31
"""FMI 2.0 holds integers below this."""


@dataclass(frozen=True)
class Series:
    """A signal: `kind` is Real, Integer or Boolean; `times` in s since the log's first message, increasing; (n,)."""

    kind: str
    times: NDArray[np.float64]
    values: NDArray[np.float64]


class RobotLog:
    """A sound MCAP file of anybody; times are log times, in s since the earliest one of all messages."""

    def __init__(self, path: Path, found: Scan):
        self.path = path
        self._bodies: dict[str, list[tuple[int, list[NDArray[np.uint8]]]]] = {}
        for channel_id, bodies in sorted(found.bodies.items()):
            if channel_id not in found.channels:
                raise DamagedError(f"its messages have a channel {channel_id}, which it does not describe")
            self._bodies.setdefault(found.channels[channel_id].topic, []).append((channel_id, bodies))
        self._found = found
        blocks = [block for bodies in found.bodies.values() for block in bodies]
        if any(block.shape[1] < BODY_HEAD for block in blocks):
            raise DamagedError("a message is too short to be one")
        times = [int(np.ascontiguousarray(block[:, 6:14]).view("<u8").min()) for block in blocks]
        self._start = min(times, default=0)

    @property
    def topics(self) -> tuple[str, ...]:
        """The topics that have messages."""
        return tuple(sorted(self._bodies))

    def fields(self, topic: str) -> list[str]:
        """Return the names of a topic's signals, from its first messages; an array's as `topic.x[0…5]`.

        Raises TwipError when its messages cannot be decoded.
        """
        names: dict[str, None] = {}
        for _, message in islice(self._messages(topic), SAMPLED):
            names |= dict.fromkeys(f"{topic}{path}" for path in islice(listed(message), MOST_LISTED))
        return list(names)

    def count(self, topic: str) -> int:
        """Return how many messages a topic has."""
        return sum(len(block) for _, bodies in self._bodies[topic] for block in bodies)

    def overview(self) -> str:
        """Return the names of the first signals, for a message's end."""
        names: list[str] = []
        for topic in self.topics:
            try:
                names += self.fields(topic)
            except TwipError:
                continue
        more = f" and {len(names) - 12} more (twip replay {self.path} --list)" if len(names) > 12 else ""
        return f"there are {', '.join(names[:12])}{more}" if names else "it has no signals that can be read"

    def series(self, names: Iterable[str]) -> dict[str, Series]:
        """Return signals by name; raises TwipError that names those that are not there, and the nearest."""
        wanted = list(dict.fromkeys(names))
        found: dict[str, Series] = {}
        for topic in sorted(self.topics, key=len, reverse=True):
            paths = {n: n[len(topic) :] for n in wanted if n not in found and _within(n, topic)}
            if paths:
                found |= self._read(topic, paths)
        missing = [name for name in wanted if name not in found]
        if missing:
            raise TwipError(f"{self.path}: there is no signal {name!r}; {self._hint(name)}" for name in missing)
        return {name: found[name] for name in wanted}

    def _hint(self, name: str) -> str:
        topics = [topic for topic in self.topics if _within(name, topic)]
        known = [field for topic in topics for field in self.fields(topic)]
        near = nearest(name, known, 3) or known[:8]
        return f"near: {', '.join(near)}" if near else self.overview()

    def _read(self, topic: str, paths: Mapping[str, str]) -> dict[str, Series]:
        steps: dict[str, Steps] = {}
        samples: dict[str, tuple[list[int], list[float], set[type]]] = {name: ([], [], set()) for name in paths}
        for time, message in self._messages(topic):
            for name, path in paths.items():
                if name not in steps:
                    place = locate(message, path)
                    if place is None:
                        continue
                    steps[name] = place
                value = pick(message, steps[name])
                if value is None:
                    continue
                times, values, kinds = samples[name]
                times.append(time)
                try:
                    values.append(float(value))
                except OverflowError:
                    raise TwipError(f"{self.path}: {name} has a number that is too large") from None
                kinds.add(type(value))
        return {name: _series(*found) for name, found in samples.items() if found[0]}

    def _messages(self, topic: str) -> Iterator[tuple[int, Any]]:
        """Yield log time [ns since the start] and content of a topic's messages, channel by channel."""
        for channel_id, bodies in self._bodies[topic]:
            decode = self._decoder(channel_id)
            rows = (row.tobytes() for block in bodies for row in block)
            for position, row in enumerate(rows, 1):
                (time,) = struct.unpack_from("<Q", row, 6)
                try:
                    content = decode(row[BODY_HEAD:])
                except DECODING_ERRORS as error:
                    raise TwipError(
                        f"{self.path}: message {position} of {topic} cannot be decoded: {reason_of(error)}"
                    ) from error
                yield time - self._start, content

    def _decoder(self, channel_id: int) -> Callable[[bytes], Any]:
        channel = self._found.channels[channel_id]
        schema = self._found.schemas.get(channel.schema_id)
        encodings = (channel.message_encoding, schema.encoding if schema else "")
        try:
            if channel.message_encoding == "json":
                return json.loads
            if schema and encodings == ("protobuf", "protobuf"):
                return protobuf.decoder(schema.name, schema.data)
            if schema and encodings == ("cdr", "ros2msg"):
                return ros2.decoder(schema.name, schema.data)
        except DECODING_ERRORS as error:
            raise TwipError(f"{self.path}: the schema of {channel.topic} is damaged: {reason_of(error)}") from error
        raise TwipError(
            f"{self.path}: {channel.topic} is encoded as {encodings[0]!r} with a schema in {encodings[1]!r};"
            " what is read is json, protobuf, and cdr with ros2msg"
        )


def open_log(path: Path) -> RobotLog:
    """Open an MCAP file; raises TwipError of one line when it cannot be read or is damaged."""
    data = bytes_of(path)
    with damage_told(path):
        return RobotLog(path, scan(data))


def _within(name: str, topic: str) -> bool:
    """Return whether a signal's name may be one of a topic."""
    return name.startswith(topic) and name[len(topic) : len(topic) + 1] in ("", ".", "[")


def _series(times: list[int], values: list[float], kinds: set[type]) -> Series:
    """Order by time; of messages at the same time the last in the file counts."""
    order = np.argsort(np.asarray(times, np.uint64), kind="stable")
    ordered, numbers = np.asarray(times, np.uint64)[order], np.asarray(values)[order]
    last = np.append(ordered[1:] != ordered[:-1], True)
    ordered, numbers = ordered[last], numbers[last]
    whole = float not in kinds and bool(np.all(np.abs(numbers) < INTEGERS))
    kind = "Boolean" if kinds == {bool} else "Integer" if whole else "Real"
    return Series(kind, ordered / 1e9, numbers)
