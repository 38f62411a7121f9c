"""Reads a log back, finished or left by a killed run: `read("logs/demo.mcap")["plant.pitch"]` is one signal."""

import struct
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from mcap import records
from mcap.well_known import MessageEncoding, SchemaEncoding
from numpy.typing import NDArray

from twip.cosim.log import log_event, log_texts

from ...errors import Problem, TwipError, UnknownNameError
from ..model.message import Message
from ..model.signals import Channel, columns
from ..reading.wording import nearest
from ..values.strings import number_of
from .log_file import Attachment
from .log_open import bytes_of, damage_told
from .log_scan import BODY_HEAD, DamagedError, Scan, scan
from .log_schema import FORMAT, WIRES, Layout, read_schema


class ForeignLogError(TwipError):
    """The file is a sound MCAP file that twip has not written."""

    def __init__(
        self, problems: str | Problem | Iterable[str | Problem] = (), *, path: Path | None = None, library: str = ""
    ):
        super().__init__(problems)
        self.path = path
        """The file."""
        self.library = library
        """What wrote it, as it says itself."""


@dataclass(frozen=True)
class Playback:
    """A log in memory; `signals` maps `component.variable` (system connector: its bare name) to values, shape (rows,).

    Real and Float32 are float64, integers int64, Boolean is bool, String an object array of texts, each as it was
    computed; `times` (rows,) in s is exact to the nanosecond.
    """

    path: Path
    start_time: float
    channels: tuple[Channel, ...]
    times: NDArray[np.float64] = field(repr=False)
    signals: Mapping[str, NDArray[Any]] = field(repr=False)
    events: tuple[Message, ...]
    metadata: Mapping[str, Mapping[str, str]]
    attachments: tuple[Attachment, ...]
    complete: bool
    """False for the log of a killed run: its last rows, and nothing else, are missing."""

    @property
    def continued(self) -> bool:
        """Whether the rows go on from a checkpoint: the first one is later than the run's start."""
        return bool(len(self.times)) and float(self.times[0]) > self.start_time

    def __contains__(self, name: object) -> bool:
        """Tell whether there is a signal of this name."""
        return name in self.signals

    def __getitem__(self, name: str) -> NDArray[Any]:
        """Return the values of `component.variable`; raises UnknownNameError with the nearest ones."""
        if name not in self.signals:
            near = nearest(name, self.signals, 3)
            hint = f"; near: {', '.join(near)}" if near else ""
            raise UnknownNameError(f"log {str(self.path)!r} has no signal {name!r}{hint}", name=name, near=near)
        return self.signals[name]

    @cached_property
    def units(self) -> dict[str, str | None]:
        """The unit of each signal, as its model description writes it."""
        return dict(zip(columns(self.channels), (s.unit for c in self.channels for s in c.signals), strict=True))

    def unit(self, name: str) -> str | None:
        """Return the unit of `component.variable`, None where it has none."""
        self[name]
        return self.units[name]

    def table(self) -> NDArray[np.float64]:
        """Return all values as the rows a `Sink` takes: shape (rows, columns), columns in the order of `channels`."""
        table = np.empty((len(self.times), len(self.signals)))
        for column, name in enumerate(columns(self.channels)):
            values = self.signals[name]
            table[:, column] = [number_of(text) for text in values] if values.dtype == object else values
        return table


def read(path: str | Path) -> Playback:
    """Read a log that twip has written, also one that another tool has recompressed, filtered or mended since.

    Channels others have added are left out. Raises TwipError when the file cannot be read or is damaged,
    ForeignLogError when it is no log of twip.
    """
    path = Path(path)
    data = bytes_of(path)
    with damage_told(path):
        return _playback(path, scan(data))


def _playback(path: Path, found: Scan) -> Playback:
    ours = {i: channel for i, channel in found.channels.items() if "twip.format" in channel.metadata}
    if found.library.startswith("twip") and not found.channels and not found.complete:
        raise TwipError(f"{str(path)!r} ends before its first row: the log is cut off")
    if not ours:
        encodings = ", ".join(sorted({c.message_encoding or "none" for c in found.channels.values()})) or "none"
        raise ForeignLogError(
            f"{str(path)!r} is not a log of twip: "
            f"it was written by {found.library!r} and has {len(found.channels)} channels (encodings: {encodings})",
            path=path,
            library=found.library,
        )
    for channel in ours.values():
        if channel.metadata["twip.format"] != FORMAT:
            raise TwipError(
                f"log {str(path)!r} has format {channel.metadata['twip.format']!r}; this version reads {FORMAT!r}"
            )
    start_time = float(next(iter(ours.values())).metadata["twip.start_time"])
    channels: list[Channel] = []
    signals: dict[str, NDArray[Any]] = {}
    events: list[Message] = []
    texts: list[tuple[log_texts.TextReader, list[NDArray[np.uint8]]]] = []
    nanoseconds: NDArray[np.uint64] | None = None
    for channel_id, record in sorted(ours.items()):
        schema = found.schemas[record.schema_id]
        if (record.message_encoding, schema.encoding) != (MessageEncoding.Protobuf, SchemaEncoding.Protobuf):
            raise DamagedError(f"{record.topic} is encoded as {record.message_encoding!r}")
        bodies = found.bodies.get(channel_id, [])
        if schema.name == log_event.SCHEMA_NAME:
            events = _events(bodies, start_time)
            continue
        if record.metadata.get("twip.kind") == log_texts.KIND:
            texts.append((log_texts.TextReader(schema.data, schema.name, record.metadata), bodies))
            continue
        described, layout = read_schema(schema.data, schema.name, record.metadata)
        times, values = _values(record, layout, bodies)
        if nanoseconds is not None and not np.array_equal(nanoseconds, times):
            raise DamagedError(f"{record.topic} has other times than the channels before it")
        nanoseconds = times
        channels.append(described)
        signals.update(zip(columns([described]), values, strict=True))
    if nanoseconds is None:
        nanoseconds = np.zeros(0, np.uint64)
    for reader, bodies in texts:
        channels = [_with_texts(channel, reader) for channel in channels]
        changes = [(time, reader.decode(data)) for time, data in _messages(bodies)]
        own = Channel(reader.component, tuple(signal for _, signal in reader.signals))
        signals.update(zip(columns([own]), log_texts.held(nanoseconds, changes, len(own.signals)), strict=True))
    return Playback(
        path=path,
        start_time=start_time,
        channels=tuple(channels),
        times=start_time + nanoseconds / 1e9,
        signals=signals,
        events=tuple(events),
        metadata={item.name: item.metadata for item in found.metadata},
        attachments=tuple(Attachment(item.name, item.media_type, item.data) for item in found.attachments),
        complete=found.complete,
    )


def _values(
    record: records.Channel, layout: Layout, bodies: list[NDArray[np.uint8]]
) -> tuple[NDArray[np.uint64], list[NDArray[Any]]]:
    """Return the log times [ns] and the values of each field, shape (messages,)."""
    size = BODY_HEAD + layout.template.size
    if any(block.shape[1] != size for block in bodies):
        raise DamagedError(f"messages of {record.topic} differ in size from their schema")
    rows = np.concatenate(bodies) if bodies else np.zeros((0, size), np.uint8)
    if (rows[:, BODY_HEAD:][:, layout.is_tag] != layout.template[layout.is_tag]).any():
        raise DamagedError(f"messages of {record.topic} differ from their schema")
    body = np.dtype(
        {
            "names": ["time", *(f"f{i}" for i in range(len(layout.types)))],
            "formats": ["<u8", *(WIRES[type_].dtype for type_ in layout.types)],
            "offsets": [6, *(BODY_HEAD + offset for offset in layout.offsets)],
            "itemsize": size,
        }
    )
    table = rows.view(body)[:, 0]
    return np.ascontiguousarray(table["time"]), [np.ascontiguousarray(table[f"f{i}"]) for i in range(len(layout.types))]


def _with_texts(channel: Channel, reader: log_texts.TextReader) -> Channel:
    """Return the channel of a component with its String variables in their places."""
    if channel.component != reader.component:
        return channel
    found = list(channel.signals)
    for position, signal in sorted(reader.signals, key=lambda item: item[0]):
        found.insert(position, signal)
    return Channel(channel.component, tuple(found))


def _messages(bodies: list[NDArray[np.uint8]]) -> Iterator[tuple[int, bytes]]:
    """Yield time [ns] and data of messages that may differ in size, ordered by time."""
    messages = [row.tobytes() for block in bodies for row in block]
    heads = [struct.unpack_from("<IQ", message, 2) for message in messages]  # sequence, time
    for time, _, i in sorted((time, sequence, i) for i, (sequence, time) in enumerate(heads)):
        yield time, messages[i][BODY_HEAD:]


def _events(bodies: list[NDArray[np.uint8]], start_time: float) -> list[Message]:
    return [Message(start_time + time / 1e9, *log_event.decode(data)) for time, data in _messages(bodies)]
