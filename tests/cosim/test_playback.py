"""Reading logs back: whole, cut anywhere, damaged anywhere, rewritten by other tools, and files that are no logs."""

import io
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.records import Channel as ChannelRecord
from mcap.records import Chunk
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer

from twip.cosim.log.log_schema import FORMAT
from twip.cosim.log.playback import Playback, read
from twip.cosim.model.signals import Channel, Signal, columns
from twip.cosim.sinks.mcap_log import Attachment, McapLog
from twip.errors import TwipError

CHANNELS = (
    Channel(
        "left.motor",
        (
            Signal("drive.torque", "Real", "N.m", "output", "torque on the shaft, averaged"),
            Signal("drive_torque", "Real", None, "input"),
            Signal("count", "Integer", None, "output", "Zähler"),
            Signal("on", "Boolean", None, "input"),
        ),
    ),
    Channel("plant", (Signal("pitch", "Real", "rad", "output"),)),
    Channel("", (Signal("push", "Real", "N", "input"),)),
)
ROWS = 450
METADATA = {"twip": {"seed": "7", "command": "twip demo"}, "parameters": {"plant.mass": "1.2"}}
ATTACHMENT = Attachment("system.ssp", "application/zip", bytes(range(256)))


@pytest.fixture(scope="module")
def table() -> np.ndarray:
    rng = np.random.default_rng(3)
    rows = rng.normal(size=(ROWS, 6))
    rows[:, 2] = rng.integers(-(2**31), 2**31, ROWS)
    rows[:, 3] = rng.integers(0, 2, ROWS)
    rows[::7, 4] = -0.0
    rows[5::7, 4] = np.nan
    return rows


@pytest.fixture(scope="module")
def log(tmp_path_factory, table) -> Path:
    """A log of 450 rows from t = 1.5 s on, in three chunks; the second has an event in its middle."""
    path = tmp_path_factory.mktemp("log") / "a.mcap"
    with McapLog(path, CHANNELS, METADATA, [ATTACHMENT], start_time=1.5, compression="lz4") as sink:
        sink.event(1.75, "warning", "plant", "wobbles")
        sink.write(1.5 + 0.001 * np.arange(ROWS), table)
        sink.event(1.949, "info", "", "ends")
    return path


@pytest.fixture(scope="module")
def whole(log) -> Playback:
    return read(log)


def same(one: Playback, other: Playback, rows: int = ROWS) -> bool:
    """Whether `one` holds the first `rows` rows of `other`, and events that the other holds too."""
    return (
        one.channels == other.channels
        and one.table().view(np.uint64).tolist() == other.table()[:rows].view(np.uint64).tolist()
        and np.array_equal(one.times, other.times[:rows])
        and set(one.events) <= set(other.events)
        and one.start_time == other.start_time
    )


def test_everything_comes_back(log, whole, table):
    assert whole.complete
    assert whole.path == log
    assert whole.start_time == 1.5
    assert whole.channels == CHANNELS
    assert list(whole.signals) == columns(CHANNELS)
    assert np.array_equal(whole.table().view(np.uint64), table.view(np.uint64))
    assert [whole[name].dtype for name in columns(CHANNELS)] == [float, float, np.int64, bool, float, float]
    # Times are kept in whole nanoseconds; back in seconds they are right to half of one and a rounding of the sum.
    assert np.max(np.abs(whole.times - (1.5 + 0.001 * np.arange(ROWS)))) <= 0.5e-9 + 2**-52
    assert [(e.level, e.source, e.text) for e in whole.events] == [
        ("warning", "plant", "wobbles"),
        ("info", "", "ends"),
    ]
    assert [e.time for e in whole.events] == [1.75, 1.949]
    assert {name: whole.metadata[name] for name in METADATA} == METADATA
    assert whole.metadata["twip.log"] == {"format": FORMAT, "start_time": "1.5"}
    assert whole.attachments[1:] == (ATTACHMENT,)
    assert whole.unit("left.motor.drive.torque") == "N.m"
    assert whole.unit("left.motor.drive_torque") is None


def test_table_of_signals_names_every_field(whole):
    assert whole.attachments[0].name == "signals.csv"
    lines = whole.attachments[0].data.decode().splitlines()
    assert (
        lines[1] == '/left/motor,drive_torque_2,left.motor,drive.torque,Real,N.m,output,"torque on the shaft, averaged"'
    )
    assert [line.split(",")[:2] for line in lines[2:]] == [
        ["/left/motor", "drive_torque"],
        ["/left/motor", "count"],
        ["/left/motor", "on"],
        ["/plant", "pitch"],
        ["/system", "push"],
    ]


def test_unknown_signal_names_near_ones(whole):
    with pytest.raises(TwipError, match=r"has no signal 'plant\.ptich'; near: plant\.pitch"):
        whole["plant.ptich"]
    with pytest.raises(TwipError, match=r"has no signal 'nothing'$"):
        whole.unit("nothing")


def test_log_without_rows_or_channels(tmp_path):
    with McapLog(tmp_path / "a.mcap", CHANNELS, {}) as log:
        log.begin()
    empty = read(tmp_path / "a.mcap")
    assert (empty.complete, empty.channels, empty.table().shape, empty.events) == (True, CHANNELS, (0, 6), ())
    with McapLog(tmp_path / "b.mcap", [], {}) as sink:
        sink.write(np.arange(5.0), np.zeros((5, 0)))
        sink.event(2.0, "fatal", "plant", "gone")
    bare = read(tmp_path / "b.mcap")
    assert (bare.channels, dict(bare.signals), bare.times.shape) == ((), {}, (0,))
    assert [e.level for e in bare.events] == ["fatal"]


@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_cut_anywhere(log, whole, tmp_path, data):
    """What is left holds the rows of every whole chunk; before the last channel is declared it is empty or no log."""
    content = log.read_bytes()
    size = data.draw(st.integers(0, len(content) - 1))
    ends, declared = _chunk_ends(log)
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(content[:size])
    try:
        left = read(cut)
    except TwipError:
        assert size < declared
        return
    if size < declared:
        assert len(left.times) == len(left.events) == 0
        return
    rows = min(ROWS, 200 * sum(end <= size for end in ends))
    assert not left.complete
    assert len(left.times) == rows
    assert same(left, whole, rows)


@settings(max_examples=400, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_damage_anywhere_is_told(log, whole, tmp_path, data):
    """Another byte anywhere gives one line of TwipError; only what carries no data may change unnoticed."""
    content = bytearray(log.read_bytes())
    content[data.draw(st.integers(0, len(content) - 1))] ^= data.draw(st.integers(1, 255))
    bad = tmp_path / "bad.mcap"
    bad.write_bytes(content)
    message = ""
    try:
        found = read(bad)
    except TwipError as error:
        message = str(error)
    if message:
        assert re.fullmatch(r"log '.*' is damaged or no MCAP file: [^\n]+", message)
    else:
        assert same(found, whole)
        assert found.events == whole.events


@settings(max_examples=200, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.binary(max_size=300), st.booleans())
def test_any_bytes(tmp_path, content, with_magic):
    path = tmp_path / "a.mcap"
    path.write_bytes((b"\x89MCAP0\r\n" if with_magic else b"") + content)
    with pytest.raises(TwipError) as caught:
        read(path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("compression", list(CompressionType))
def test_log_rewritten_by_another_tool(log, whole, tmp_path, compression):
    """Other channel numbers, chunks and order of metadata, and a channel added, by the mcap package's own writer."""
    path = tmp_path / "again.mcap"
    with log.open("rb") as stream, path.open("wb") as output:
        reader = make_reader(stream)
        writer = Writer(output, chunk_size=5000, compression=compression)
        writer.start(library="another tool")
        extra = writer.register_channel("/tf", "json", writer.register_schema("tf", "jsonschema", b"{}"))
        ids: dict[int, int] = {}
        for schema, channel, message in reader.iter_messages():
            if channel.id not in ids:
                schema_id = writer.register_schema(schema.name, schema.encoding, schema.data)
                metadata = dict(sorted(channel.metadata.items()))
                ids[channel.id] = writer.register_channel(channel.topic, channel.message_encoding, schema_id, metadata)
            writer.add_message(ids[channel.id], message.log_time, message.data, message.publish_time)
            writer.add_message(extra, message.log_time, b"{}", message.publish_time)
        writer.finish()
    again = read(path)
    assert again.complete
    assert same(again, whole)
    assert again.events == whole.events


def test_foreign_log_says_what_it_is(tmp_path):
    path = tmp_path / "a.mcap"
    with path.open("wb") as output:
        writer = Writer(output)
        writer.start(library="robot recorder 3")
        writer.add_message(writer.register_channel("/odom", "cdr", 0), 0, b"", 0)
        writer.finish()
    with pytest.raises(
        TwipError, match=r"is not a log of twip: it was written by 'robot recorder 3' .* 1 channels .*cdr"
    ):
        read(path)


def test_other_format_is_named(tmp_path):
    path = tmp_path / "a.mcap"
    with path.open("wb") as output:
        writer = Writer(output)
        writer.start()
        writer.register_channel("/plant", "protobuf", 0, {"twip.format": "99", "twip.start_time": "0.0"})
        writer.add_message(1, 0, b"", 0)
        writer.finish()
    with pytest.raises(TwipError, match="has format '99'; this version reads '1'"):
        read(path)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "cannot be read: No such file or directory"),
        (b"", "is empty"),
        (b"PK\3\4 a zip", "is damaged or no MCAP file: it does not begin as an MCAP file does"),
        (b"\x89MCAP0\r\n", "is not a log of twip"),
    ],
)
def test_no_log_at_all(tmp_path, content, message):
    path = tmp_path / "a.mcap"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(TwipError, match=message):
        read(path)
    with pytest.raises(TwipError, match="cannot be read: Is a directory"):
        read(tmp_path)
    with pytest.raises(TwipError, match="cannot be read: embedded null byte"):
        read("a\0b")


def _chunk_ends(path: Path) -> tuple[list[int], int]:
    """Return where each chunk record ends, and where the last channel is declared, by the mcap package."""
    content = path.read_bytes()
    ends: list[int] = []
    declared = 0
    stream = io.BytesIO(content)
    for record in StreamReader(stream, emit_chunks=True).records:
        if isinstance(record, Chunk):
            ends.append(stream.tell())
        elif isinstance(record, ChannelRecord) and not ends:
            declared = stream.tell()
    return ends, declared


def test_a_log_cut_before_its_channels_is_called_cut_off(log, tmp_path):
    path, content = tmp_path / "cut.mcap", log.read_bytes()
    path.write_bytes(content[: content.index(b"system.ssp") + 20])
    with pytest.raises(TwipError, match="ends before its first row: the log is cut off"):
        read(path)
