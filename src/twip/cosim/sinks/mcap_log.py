"""The log of a run as MCAP with protobuf messages: topic `/<component>` per component, `/<component>/strings` for its
String variables, `/log` for messages in words.

Rows are laid out in numpy and written a chunk at a time; see `log_schema` for names and bytes, `log_rows` for the
layout of a chunk, `log_file` for the container, and `playback` for reading it back.
"""

import csv
import io
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import ClassVar, Self, get_args

import numpy as np
from mcap import records
from numpy.typing import NDArray

from ...errors import TwipError
from ..log import log_event, log_texts
from ..log.log_extra import ExtraChannel
from ..log.log_extra import declare as declare_extras
from ..log.log_file import Attachment, Compression, McapFile, MessageBatch, encoded
from ..log.log_rows import RowBlock
from ..log.log_schema import (
    EVENT_TOPIC,
    FORMAT,
    channel_metadata,
    descriptor,
    field_numbers,
    layout,
    topics,
    unique_identifiers,
)
from ..log.log_texts import TextColumns, text_columns
from ..log.log_times import LogTimes
from ..model.signals import Channel, columns
from .base import FileSink, RunDetails

__all__ = ["Attachment", "McapLog"]

CHUNK_ROWS = 200
CHUNK_BYTES = 4 << 20
METADATA_NAME = "twip.log"
SIGNALS_NAME = "signals.csv"
SHARED = "rows less than 1 ns apart share a time in the log, which keeps whole nanoseconds"


class McapLog(FileSink):
    """Writes the rows and events of a run; a `Sink` and a context manager.

    `metadata` (record name → key → text) and `attachments` open the file, after a record `twip.log` (format, start time
    in s) and an attachment `signals.csv` that names every field; checkers want at least one of each. A chunk is written
    for every `CHUNK_ROWS` rows (fewer when rows are very wide) however the calls divide them, so a killed run loses at
    most that many. Times are kept in whole nanoseconds since `start_time` [s]. Components without recorded variables
    get no channel. `extras` are channels that the caller makes of the rows. Missing folders are created. An existing
    file is replaced by the first `write`, or by `begin`: a run that fails before its first row leaves it as it was.

    Raises TwipError for a path that cannot be written, a failing disk, times out of order and values that are not of
    their type.
    """

    endings: ClassVar[tuple[str, ...]] = (".mcap",)

    def __init__(
        self,
        path: str | Path,
        channels: Sequence[Channel],
        metadata: Mapping[str, Mapping[str, str]],
        attachments: Sequence[Attachment] = (),
        start_time: float = 0.0,
        compression: Compression = "zstd",
        extras: Sequence[ExtraChannel] = (),
    ) -> None:
        if compression not in get_args(Compression):
            raise TwipError(f"compression {compression!r} of the log must be one of {', '.join(get_args(Compression))}")
        self.path = Path(path)
        self._columns = columns(channels)
        self._types = [signal.type for channel in channels for signal in channel.signals]
        self._times = LogTimes(str(self.path), float(start_time))
        recorded = [channel for channel in channels if channel.signals]
        self._texts = text_columns(recorded)
        self._numeric = np.flatnonzero([type_ != "String" for type_ in self._types])
        twice = sorted(name for name, count in Counter(self._columns).items() if count > 1)
        if twice:
            raise TwipError(f"log {str(self.path)!r}: more than one variable is named {', '.join(twice)}")
        own = {"format": FORMAT, "start_time": repr(self._times.start)}
        schema_records, channel_records = declare(
            recorded, self._texts, self._times.start, [extra.topic for extra in extras]
        )
        self._event_channel = channel_records[len(recorded)].id
        self._text_channels = [record.id for record in channel_records[len(recorded) + 1 :]]
        extra_schemas, extra_channels, self._extras = declare_extras(extras, channel_records[-1].id + 1)
        self._file = McapFile(
            self.path,
            compression,
            {METADATA_NAME: {}, **metadata} | {METADATA_NAME: {**metadata.get(METADATA_NAME, {}), **own}},
            [Attachment(SIGNALS_NAME, "text/csv", _signal_table(recorded, channel_records)), *attachments],
            [*schema_records, *extra_schemas],
            [*channel_records, *extra_channels],
        )
        layouts = []
        for record, channel in zip(channel_records, recorded, strict=False):
            types = [signal.type for signal in channel.signals if signal.type != "String"]
            layouts.append((record.id, layout(field_numbers(len(types)), types)))
        row_bytes = sum(31 + item.template.size for _, item in layouts)
        self._block = RowBlock(layouts, max(1, min(CHUNK_ROWS, CHUNK_BYTES // max(row_bytes, 1))))
        self._filled = 0
        self._rows = 0
        self._events: list[tuple[int, int, bytes]] = []
        """Time [ns], channel and record of the messages that are not rows."""
        self._event_counts = dict.fromkeys([self._event_channel, *self._text_channels], 0)

    @classmethod
    def open(cls, path: Path, run: RunDetails) -> Self:
        """Open the log of a run."""
        return cls(path, run.channels, run.metadata, run.attachments, run.start_time, extras=run.extras)

    def check_times(self, start: float, stop: float, step_size: float) -> None:
        """Refuse a run whose times in s do not fit; raises TwipError."""
        self._times.check(start, stop, step_size)

    def begin(self) -> None:
        """Replace the file now, though there may never be a row."""
        self._file.begin()

    def write(self, times: NDArray[np.float64], rows: NDArray[np.float64]) -> None:
        """Take rows (n, columns) at `times` (n,) in s; every full chunk is written before this returns."""
        times = np.asarray(times, np.float64)
        rows = np.asarray(rows, np.float64)
        if rows.shape != (*times.shape, len(self._columns)):
            raise ValueError(f"{rows.shape} values for {times.shape} times and {len(self._columns)} columns")
        shared = self._times.shared
        nanoseconds = self._times.of_rows(times)
        if shared is None and self._times.shared is not None:
            self.event(self._times.shared, "warning", "", SHARED)
        self._file.begin()
        for channel, texts in zip(self._text_channels, self._texts, strict=True):
            for row, data in texts.changes(rows):
                self._add(int(nanoseconds[row]), channel, data)
        done = 0
        while done < len(times):
            count = min(len(times) - done, self._block.capacity - self._filled)
            part = slice(done, done + count)
            numbers = rows[part][:, self._numeric] if self._texts else rows[part]
            wrong = self._block.put(self._filled, self._rows, nanoseconds[part], numbers)
            if wrong:
                self._filled += wrong[0]
                self._rows += wrong[0]
                row, column = done + wrong[0], int(self._numeric[wrong[1]])
                raise TwipError(
                    f"{self._columns[column]} = {rows[row, column]} at t = {times[row]} s "
                    f"is not a value of its type {self._types[column]}"
                )
            for extra in self._extras:
                self._events += [
                    (time, extra.id, record) for time, record in extra.records(nanoseconds[part], rows[part])
                ]
            self._filled += count
            self._rows += count
            done += count
            if self._filled == self._block.capacity:
                self._flush(before=int(self._block.nanoseconds[self._filled - 1]))

    def event(self, time: float, level: str, source: str, message: str) -> None:
        """Take a message at `time` [s]; it is written with the rows around it, after rows of the same time."""
        nanoseconds = self._times.of_event(time)
        self._add(nanoseconds, self._event_channel, log_event.encode(nanoseconds, level, source, message))

    def _add(self, nanoseconds: int, channel: int, data: bytes) -> None:
        record = records.Message(
            channel_id=channel,
            log_time=nanoseconds,
            data=data,
            publish_time=nanoseconds,
            sequence=self._event_counts[channel] & 0xFFFFFFFF,
        )
        self._event_counts[channel] += 1
        self._events.append((nanoseconds, channel, encoded(record)))

    def close(self) -> None:
        """Write what is left and the summary; a second call does nothing, nor does one after a failed write."""
        if not self._file.closed:
            if self._file.begun:
                self._flush(before=None)
            self._file.finish()

    def __enter__(self) -> "McapLog":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()

    def _flush(self, before: int | None) -> None:
        """Write the collected rows, events earlier than `before` [ns] (None: all) where their time puts them, and the
        texts of these rows.
        """
        count = self._filled if self._block.channel_ids else 0
        ready: list[tuple[int, int, bytes]] = []
        later: list[tuple[int, int, bytes]] = []
        for item in self._events:
            now = before is None or item[0] < before or (item[0] == before and item[1] != self._event_channel)
            (ready if now else later).append(item)
        self._events = later
        ready.sort(key=lambda item: item[0])
        times = self._block.nanoseconds[:count]
        places = np.searchsorted(times, np.array([item[0] for item in ready], np.uint64), side="right")
        rows, size = self._block.data(count), self._block.row_size
        pieces: list[bytes | memoryview] = []
        entries: dict[int, list[tuple[int, int]]] = {}
        laid = loose = 0
        for row, (time, channel, record) in zip(places.tolist(), ready, strict=True):
            pieces += (rows[laid * size : row * size], record)
            entries.setdefault(channel, []).append((time, row * size + loose))
            loose += len(record)
            laid = row
        pieces.append(rows[laid * size :])
        shift = None
        if ready:
            before_row = np.bincount(places, [len(record) for _, _, record in ready], count + 1)[:count]
            shift = np.cumsum(before_row).astype(np.int64)
        self._filled = 0
        counts = dict.fromkeys(self._block.channel_ids, count) if count else {}
        index: list[bytes | memoryview] = []
        sizes = {}
        if counts:
            rows_index, bytes_each = self._block.index(count, shift)
            index.append(rows_index)
            sizes = dict.fromkeys(counts, bytes_each)
        for channel, listed in entries.items():
            index.append(encoded(records.MessageIndex(channel, listed)))
            counts[channel] = len(listed)
            sizes[channel] = len(index[-1])
        if counts:
            ends = [*times[:1], *times[-1:], *(time for time, _, _ in ready)]
            self._file.write(MessageBatch(pieces, int(min(ends)), int(max(ends)), counts, index, sizes))


def declare(
    channels: Sequence[Channel], texts: Sequence[TextColumns], start_time: float, reserved: Sequence[str]
) -> tuple[list[records.Schema], list[records.Channel]]:
    """Return the schema and channel records of the components, then those of the events, last those of the texts."""
    found = topics((channel.component for channel in channels), reserved)
    topic_of = [found[channel.component] for channel in channels]
    names = unique_identifiers([topic[1:] for topic in topic_of])
    numeric = [Channel(c.component, tuple(s for s in c.signals if s.type != "String")) for c in channels]
    declared = [
        (f"twip.{name}", descriptor(name, channel.signals), topic, channel_metadata(channel, start_time))
        for name, topic, channel in zip(names, topic_of, numeric, strict=True)
    ]
    about = {"twip.format": FORMAT, "twip.start_time": repr(start_time)}
    declared.append((log_event.SCHEMA_NAME, log_event.SCHEMA, EVENT_TOPIC, about))
    taken = {EVENT_TOPIC, *topic_of, *reserved}
    name_of = dict(zip(topic_of, names, strict=True))
    for item in texts:
        of = found[item.channel.component]
        name, topic = f"strings_of_{name_of[of]}", f"{of}/strings"
        while topic in taken:
            topic += "_"
        taken.add(topic)
        data = log_texts.descriptor(name, item.channel.signals)
        declared.append((f"twip.{name}", data, topic, item.metadata(start_time)))
    schema_records = [records.Schema(i, data, "protobuf", name) for i, (name, data, _, _) in enumerate(declared, 1)]
    channel_records = [
        records.Channel(id=i, topic=topic, message_encoding="protobuf", metadata=metadata, schema_id=i)
        for i, (_, _, topic, metadata) in enumerate(declared, 1)
    ]
    return schema_records, channel_records


def _signal_table(channels: Sequence[Channel], channel_records: Sequence[records.Channel]) -> bytes:
    """Return a CSV table with one line per recorded variable."""
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(["topic", "field", "component", "variable", "type", "unit", "causality", "description"])
    topic_of = {
        (record.metadata["twip.component"], record.metadata.get("twip.kind") == log_texts.KIND): record.topic
        for record in channel_records
        if "twip.component" in record.metadata
    }
    for channel in channels:
        for is_text in (False, True):
            signals = [signal for signal in channel.signals if (signal.type == "String") == is_text]
            topic = topic_of.get((channel.component, is_text), "")
            for field, signal in zip(unique_identifiers([s.name for s in signals]), signals, strict=True):
                about = (signal.name, signal.type, signal.unit or "", signal.causality, signal.description)
                table.writerow([topic, field, channel.component, *about])
    return text.getvalue().encode("utf-8", "backslashreplace")
