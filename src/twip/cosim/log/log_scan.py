"""Reads the container of a log: finished files and those of killed runs, with every checksum tested.

Messages that repeat with one period, as a log's rows do, are found by comparing whole rows in numpy; what lies between
them (an event, a pose), or what another tool has put in another order, makes a period of its own.
"""

import struct
import zlib
from dataclasses import dataclass, field
from io import BytesIO

import lz4.frame
import numpy as np
import zstandard
from mcap import records
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.stream_reader import get_chunk_data_stream
from mcap.writer import MCAP0_MAGIC
from numpy.typing import NDArray

HEAD = struct.Struct("<BQ")
UNSUSPICIOUS_BYTES = 1024**3
MAXIMUM_RATIO = 200
"""Chunks may unpack to so many bytes, or to so many times the size of the file if that is more."""
_LZ4_RATIO = 255
"""Most that LZ4 can grow by."""
BODY_HEAD = 22
"""Bytes of a message's body before its data: channel, sequence, log time, publish time."""


class DamagedError(Exception):
    """The file is not what it says it is; the message says where."""


@dataclass
class Scan:
    """What a file holds; `bodies` are message bodies (messages, bytes) by channel, in file order."""

    library: str = ""
    schemas: dict[int, records.Schema] = field(default_factory=dict)
    channels: dict[int, records.Channel] = field(default_factory=dict)
    metadata: list[records.Metadata] = field(default_factory=list)
    attachments: list[records.Attachment] = field(default_factory=list)
    bodies: dict[int, list[NDArray[np.uint8]]] = field(default_factory=dict)
    uncompressed: int = 0
    """Bytes that the chunks so far may take."""
    complete: bool = False
    """Whether the file was finished; otherwise what follows the last whole record is left out."""


def scan(data: bytes) -> Scan:
    """Take a file apart.

    Raises DamagedError, or what the decoders raise at bytes that are no such record (ValueError, struct.error, …).
    """
    if not data.startswith(MCAP0_MAGIC):
        raise DamagedError("it does not begin as an MCAP file does")
    found = Scan()
    position = len(MCAP0_MAGIC)
    finished = data.endswith(MCAP0_MAGIC) and len(data) > 2 * position
    data_end: int | None = None
    while position + HEAD.size <= len(data):
        opcode, length = HEAD.unpack_from(data, position)
        end = position + HEAD.size + length
        if opcode == 0 or (finished and end > len(data) - len(MCAP0_MAGIC)):
            raise DamagedError(f"no record begins at byte {position}")
        if end > len(data):
            break
        body = data[position + HEAD.size : end]
        if opcode == Opcode.FOOTER:
            _check_summary(data, position, records.Footer.read(_stream(body)))
            if data_end is None or (finished and end != len(data) - len(MCAP0_MAGIC)):
                raise DamagedError(f"its footer is out of place at byte {position}")
            found.complete = finished
            return found
        if opcode == Opcode.DATA_END:
            crc = records.DataEnd.read(_stream(body)).data_section_crc
            if crc not in (0, zlib.crc32(data[:position])):
                raise DamagedError("the checksum of its data differs")
            data_end = position
        elif data_end is None:
            _take(found, opcode, body, position, max(UNSUSPICIOUS_BYTES, MAXIMUM_RATIO * len(data)))
        position = end
    if finished:
        raise DamagedError("it has no footer")
    return found


def _take(found: Scan, opcode: int, body: bytes, position: int, limit: int) -> None:
    if opcode == Opcode.HEADER:
        found.library = records.Header.read(_stream(body)).library
    elif opcode == Opcode.METADATA:
        found.metadata.append(records.Metadata.read(_stream(body)))
    elif opcode == Opcode.ATTACHMENT:
        attachment = records.Attachment.read(_stream(body))
        if zlib.crc32(body[:-4]) != int.from_bytes(body[-4:], "little"):
            raise DamagedError(f"the checksum of its attachment {attachment.name!r} differs")
        found.attachments.append(attachment)
    elif opcode == Opcode.CHUNK:
        chunk = records.Chunk.read(_stream(body))
        if chunk.compression not in ("", "lz4", "zstd"):
            raise DamagedError(f"the chunk at byte {position} is compressed as {chunk.compression!r}")
        found.uncompressed += _grows_to(chunk)
        if found.uncompressed > limit:
            raise DamagedError(f"the chunk at byte {position} would unpack to more than {limit} bytes")
        stream, size = get_chunk_data_stream(chunk, validate_crc=True)
        if size != chunk.uncompressed_size:
            raise DamagedError(f"the chunk at byte {position} has {size} bytes instead of {chunk.uncompressed_size}")
        _split(found, stream.read(size), position)
    elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE):
        _take_inner(found, opcode, body)


def _grows_to(chunk: records.Chunk) -> int:
    """Return how many bytes the decoder of a chunk may make, which looks at nothing but its data."""
    says = 0
    if chunk.compression == "zstd":
        known = zstandard.get_frame_parameters(chunk.data).content_size
        says = 0 if known == zstandard.CONTENTSIZE_UNKNOWN else known
    elif chunk.compression == "lz4":
        says = lz4.frame.get_frame_info(chunk.data)["content_size"] or _LZ4_RATIO * len(chunk.data)
    return max(says, chunk.uncompressed_size)


def _take_inner(found: Scan, opcode: int, body: bytes) -> None:
    if opcode == Opcode.SCHEMA:
        schema = records.Schema.read(_stream(body))
        found.schemas[schema.id] = schema
    elif opcode == Opcode.CHANNEL:
        channel = records.Channel.read(_stream(body))
        found.channels[channel.id] = channel
    elif opcode == Opcode.MESSAGE:
        (channel_id,) = struct.unpack_from("<H", body)
        found.bodies.setdefault(channel_id, []).append(np.frombuffer(body, np.uint8)[None])


def _split(found: Scan, data: bytes, position: int) -> None:
    """Add the records of a chunk's uncompressed data, in their order."""
    raw = np.frombuffer(data, np.uint8)
    at = 0
    while at < len(data):
        row = _row(data, at, position)
        if not row:
            opcode, length = HEAD.unpack_from(data, at)
            _take_inner(found, opcode, data[at + HEAD.size : at + HEAD.size + length])
            at += HEAD.size + length
            continue
        size = sum(HEAD.size + length for _, _, length in row)
        heads = np.concatenate([np.arange(start, start + HEAD.size + 2) for _, start, _ in row])
        count, window = 1, 8
        while (more := min(window, (len(data) - at) // size - count)) > 0:
            first = at + count * size
            same = (raw[first : first + more * size].reshape(more, size)[:, heads] == raw[at:][heads]).all(axis=1)
            count += more if same.all() else int(np.argmin(same))
            if not same.all():
                break
            window *= 4
        rows = raw[at : at + count * size].reshape(count, size)
        for channel_id, start, length in row:
            found.bodies.setdefault(channel_id, []).append(rows[:, start + HEAD.size : start + HEAD.size + length])
        at += count * size


def _row(data: bytes, at: int, position: int) -> list[tuple[int, int, int]]:
    """Return (channel, start from `at`, body length) of the messages from `at` on, until a channel repeats."""
    row: dict[int, tuple[int, int]] = {}
    start = at
    while start < len(data):
        opcode, length = HEAD.unpack_from(data, start)
        if start + HEAD.size + length > len(data):
            raise DamagedError(f"a record overruns the chunk at byte {position}")
        if opcode != Opcode.MESSAGE:
            break
        (channel_id,) = struct.unpack_from("<H", data, start + HEAD.size)
        if channel_id in row:
            break
        row[channel_id] = (start - at, length)
        start += HEAD.size + length
    return [(channel_id, *place) for channel_id, place in row.items()]


def _check_summary(data: bytes, position: int, footer: records.Footer) -> None:
    start = footer.summary_start or position
    covered = data[start : position + HEAD.size + 16]
    if start > position or footer.summary_crc not in (0, zlib.crc32(covered)):
        raise DamagedError("the checksum of its summary differs")


def _stream(body: bytes) -> ReadDataStream:
    return ReadDataStream(BytesIO(body))
