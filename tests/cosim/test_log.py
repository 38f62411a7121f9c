"""The log as others read it: the mcap package and protobuf always, Rerun and pymcap-cli under the marker `foreign`."""

import contextlib
import itertools
import json
import re
import shutil
import signal
import struct
import subprocess
import sys
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
import zstandard
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message_factory import GetMessageClass
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.exceptions import EndOfFile
from mcap.reader import NonSeekingReader, make_reader
from mcap.records import Attachment as AttachmentRecord
from mcap.records import Channel as ChannelRecord
from mcap.records import Chunk, Metadata
from mcap.stream_reader import StreamReader
from mcap_protobuf.decoder import DecoderFactory

from twip.cosim import playback
from twip.cosim.log import Attachment, McapLog
from twip.cosim.log_schema import PLAIN_TYPES, WIRES, descriptor, field_numbers, layout, topics, unique_identifiers
from twip.cosim.record import Channel, Signal
from twip.errors import TwipError

AWKWARD = [
    "a.b",
    "a_b",
    "x[1]",
    "x_1_",
    "1st",
    "_hidden",
    "θ",
    "φ",
    "class",
    "from",
    "aB",
    "naïve name",
    "der(x)",
    "A_B",
]
INT32 = (-(2**31), 2**31 - 1)
SPECIAL = [np.nan, -np.nan, np.inf, -np.inf, 0.0, -0.0, 5e-324, -5e-324, 1.7976931348623157e308, 0.1]
SPECIAL_BITS = np.append(
    np.array(SPECIAL).view(np.uint64), np.uint64(0x7FF4DEADBEEF0001)
)  # a signalling NaN with payload


def channels() -> list[Channel]:
    """Return components whose names and variables collide in every way, with all types mixed."""
    kinds = itertools.cycle(["Real", "Real", "Integer", "Real", "Boolean", "Integer", "Real"])
    first = tuple(Signal(n, k, "m/s", "output", f"about {n}") for n, k in zip(AWKWARD, kinds, strict=False))
    return [
        Channel("left.motor", first),
        Channel("left/motor", (Signal("on", "Boolean", None, "input"),)),
        Channel("silent", ()),
        Channel("system", (Signal("q", "Real", "rad", "output"),)),
        Channel("log", (Signal("q", "Integer", None, "output"), Signal("r", "Integer", None, "output"))),
        Channel("", (Signal("push", "Real", "N", "input"),)),
    ]


def table(described: list[Channel], count: int, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Return times and rows: random values with every special one among them."""
    rng = np.random.default_rng(seed)
    columns = []
    for item in (s for c in described for s in c.signals):
        if item.type == "Integer":
            values = rng.integers(*INT32, count, endpoint=True).astype(float)
            values[: len(INT32)] = INT32[:count]
        elif item.type == "Boolean":
            values = rng.integers(0, 2, count).astype(float)
        else:
            values = rng.normal(size=count)
            values[: len(SPECIAL_BITS)] = SPECIAL_BITS[:count].view(np.float64)
            values = rng.permutation(values)
        columns.append(values)
    return 0.001 * np.arange(count), np.column_stack(columns) if columns else np.zeros((count, 0))


def write(
    path: Path, count: int = 450, described: list[Channel] | None = None, step: int = 77, **options
) -> np.ndarray:
    """Write a log with events in calls of `step` rows; return its rows."""
    described = channels() if described is None else described
    times, rows = table(described, count)
    with McapLog(
        path, described, {"twip": {"seed": "7"}}, [Attachment("a.ssv", "text/xml", b"<x/>")], **options
    ) as log:
        log.event(0.0, "info", "plant", "begins")
        for i in range(0, count, step):
            log.event(times[i], "warning", "left.motor", f"row {i}")
            log.write(times[i : i + step], rows[i : i + step])
        log.event(99.0, "error", "plant", "ends")
    return rows


def read_by_mcap(path: Path, described: list[Channel]) -> tuple[dict[str, np.ndarray], dict[str, list], list]:
    """Return values (as float64 bits), log times by topic and log messages, through the mcap package and protobuf."""
    values: dict[str, list] = {}
    times: dict[str, list] = {}
    events = []
    with path.open("rb") as stream:
        for schema, channel, message, decoded in make_reader(stream, True, [DecoderFactory()]).iter_decoded_messages():
            assert message.log_time == message.publish_time
            assert message.sequence == len(times.setdefault(channel.topic, []))
            times[channel.topic].append(message.log_time)
            if schema.name == "foxglove.Log":
                events.append((message.log_time, decoded))
                continue
            component = channel.metadata["twip.component"]
            for field in decoded.DESCRIPTOR.fields:
                about = json.loads(channel.metadata[field.name])
                values.setdefault((component, about["name"]), []).append(getattr(decoded, field.name))
    ordered = [np.array(values[c.component, s.name], float) for c in described for s in c.signals]
    return np.column_stack(ordered).view(np.uint64), times, events


@pytest.mark.parametrize("compression", ["zstd", "lz4", "none"])
def test_every_value_is_read_back_bit_for_bit(tmp_path, compression):
    rows = write(tmp_path / "a.mcap", compression=compression)
    bits, times, _ = read_by_mcap(tmp_path / "a.mcap", channels())
    assert np.array_equal(bits, rows.view(np.uint64))
    assert set(times) == {"/left/motor", "/left/motor_2", "/system", "/system_2", "/log", "/log_2"}
    for topic in set(times) - {"/log"}:
        assert times[topic] == [k * 1_000_000 for k in range(450)]


def test_data_checksum_and_order(tmp_path):
    """A reader that goes through the file from front to back finds the checksum right and no step back in time."""
    write(tmp_path / "a.mcap")
    with (tmp_path / "a.mcap").open("rb") as stream:
        reader = NonSeekingReader(stream, validate_crcs=True)
        times = [message.log_time for _, _, message in reader.iter_messages(log_time_order=False)]
    assert times == sorted(times)
    assert len(times) == 5 * 450 + 8


def test_summary_counts_and_indexes(tmp_path):
    write(tmp_path / "a.mcap")
    with (tmp_path / "a.mcap").open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        assert summary.statistics.message_count == 5 * 450 + 8
        assert summary.statistics.channel_count == len(summary.channels) == len(summary.schemas) == 6
        assert (summary.statistics.message_start_time, summary.statistics.message_end_time) == (0, 99_000_000_000)
        assert summary.statistics.chunk_count == len(summary.chunk_indexes) == 3
        in_range = list(reader.iter_messages(topics=["/system"], starting_at=200_000_000, ending_before=250_000_000))
        assert [m.log_time for _, _, m in in_range] == [k * 1_000_000 for k in range(200, 250)]
        backwards = [m.log_time for _, c, m in reader.iter_messages(reverse=True) if c.topic == "/system"]
        assert backwards == [k * 1_000_000 for k in reversed(range(450))]
        assert [a.name for a in reader.iter_attachments()] == ["signals.csv", "a.ssv"]
        assert {m.name: m.metadata for m in reader.iter_metadata()}["twip"] == {"seed": "7"}


def test_what_the_file_is_comes_first(tmp_path):
    write(tmp_path / "a.mcap")
    with (tmp_path / "a.mcap").open("rb") as stream:
        kinds = [type(record) for record in StreamReader(stream, emit_chunks=True).records]
    first_chunk = kinds.index(Chunk)
    for kind, count in ((Metadata, 2), (AttachmentRecord, 2), (ChannelRecord, 6)):
        assert kinds[:first_chunk].count(kind) == count


def test_attached_file(tmp_path):
    (tmp_path / "system.ssp").write_bytes(b"PK")
    assert Attachment.file(tmp_path / "system.ssp") == Attachment("system.ssp", "application/zip", b"PK")
    with pytest.raises(TwipError, match=r"missing\.csv' cannot be read into the log: No such file or directory"):
        Attachment.file(tmp_path / "missing.csv")


def test_events_are_foxglove_logs(tmp_path):
    write(tmp_path / "a.mcap")
    _, _, events = read_by_mcap(tmp_path / "a.mcap", channels())
    assert [e.message for _, e in events] == ["begins", *(f"row {i}" for i in range(0, 450, 77)), "ends"]
    assert [e.level for _, e in events] == [2, *[3] * 6, 4]
    assert {e.name for _, e in events} == {"plant", "left.motor"}
    assert all(e.timestamp.ToNanoseconds() == time for time, e in events)


def test_same_run_same_bytes(tmp_path):
    write(tmp_path / "a.mcap")
    write(tmp_path / "deeper" / "b.mcap")
    assert (tmp_path / "a.mcap").read_bytes() == (tmp_path / "deeper" / "b.mcap").read_bytes()


def test_bytes_do_not_depend_on_how_calls_divide_the_rows(tmp_path):
    times, rows = table(channels(), 450)
    for step in (1, 200, 450):
        with McapLog(tmp_path / f"{step}.mcap", channels(), {}) as log:
            for i in range(0, 450, step):
                log.write(times[i : i + step], rows[i : i + step])
    assert len({(tmp_path / f"{step}.mcap").read_bytes() for step in (1, 200, 450)}) == 1


def test_no_rows(tmp_path):
    with McapLog(tmp_path / "a.mcap", channels(), {}) as log:
        log.write(np.zeros(0), np.zeros((0, 19)))
    with (tmp_path / "a.mcap").open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        assert list(reader.iter_messages()) == []
        assert len(reader.get_summary().channels) == 6
        assert len(list(reader.iter_metadata())) == len(list(reader.iter_attachments())) == 1


@pytest.mark.parametrize("count", [1, 15, 16, 300, 2050])
def test_tags_of_every_length(tmp_path, count):
    """Field numbers from 16 on take two bytes, from 2048 on three."""
    kinds = list(PLAIN_TYPES.values())
    described = [Channel("plant", tuple(Signal(f"v{i}", kinds[i % 7 % 3], None, "output") for i in range(count)))]
    times, rows = table(described, 9)
    with McapLog(tmp_path / "a.mcap", described, {}) as log:
        log.write(times, rows)
    bits, _, _ = read_by_mcap(tmp_path / "a.mcap", described)
    assert np.array_equal(bits, rows.view(np.uint64))


def test_wide_rows_make_chunks_of_bounded_size(tmp_path):
    described = [Channel("plant", tuple(Signal(f"v{i}", "Real", None, "output") for i in range(20000)))]
    times, rows = table(described, 50)
    with McapLog(tmp_path / "a.mcap", described, {}) as log:
        log.write(times, rows)
    with (tmp_path / "a.mcap").open("rb") as stream:
        sizes = [c.uncompressed_size for c in make_reader(stream).get_summary().chunk_indexes]
    assert len(sizes) > 1
    assert max(sizes) <= 4 << 20
    assert np.array_equal(playback.read(tmp_path / "a.mcap").table().view(np.uint64), rows.view(np.uint64))


@given(st.lists(st.sampled_from(sorted(WIRES)), max_size=60))
def test_layout_is_what_protobuf_writes(kinds):
    """Protobuf's own serialisation of ones (it leaves out zeros) puts each value where the layout says."""
    signals = [Signal(f"v{i}", kind, None, "output") for i, kind in enumerate(kinds)]
    message_class = _message_class(descriptor("m", signals), "twip.m")
    expected = layout(field_numbers(len(kinds)), kinds)
    data = bytearray(expected.template)
    for kind, offset in zip(kinds, expected.offsets, strict=True):
        one = np.array(1, WIRES[kind].dtype).tobytes()
        data[offset : offset + len(one)] = one
    assert message_class(**{s.name: 1 for s in signals}).SerializeToString(deterministic=True) == bytes(data)


def test_field_numbers_avoid_those_protobuf_keeps():
    numbers = field_numbers(19500)
    assert numbers[18998:19000] == [18999, 20000]
    assert len({*numbers}) == 19500
    signals = [Signal(f"v{i}", "Boolean", None, "output") for i in range(19001)]
    _message_class(descriptor("m", signals), "twip.m")


NAMES = st.lists(
    st.one_of(
        st.text(st.characters(codec="utf-8"), max_size=6),
        st.text("aAbB_.1[]", min_size=1, max_size=5),
        st.sampled_from([*AWKWARD, "a_b_2", "ab", "DESCRIPTOR", "None", "__proto__"]),
    ),
    unique=True,
    max_size=25,
)


@settings(max_examples=300)
@given(NAMES)
def test_field_names_are_valid_and_distinct_even_as_json_names(names):
    found = unique_identifiers(names)
    assert len(found) == len(names)
    assert all(re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name) for name in found)
    # Camel case as protobuf makes it, and lower case without underscores, which its libraries before 2023 compare.
    camel = {re.sub(r"_+(.?)", lambda m: m[1].upper(), name) for name in found}
    assert len(camel) == len({name.replace("_", "").lower() for name in found}) == len(names)
    assert found == unique_identifiers(names)


@given(NAMES)
def test_protobuf_takes_the_field_names(names):
    signals = [Signal(name, "Real", None, "output") for name in names]
    message_class = _message_class(descriptor("m", signals), "twip.m")
    assert [field.name for field in message_class.DESCRIPTOR.fields] == unique_identifiers(names)


@given(st.lists(st.from_regex(r"[A-Za-z][A-Za-z0-9]{0,5}", fullmatch=True), unique_by=str.lower))
def test_plain_names_stay(names):
    assert unique_identifiers(names) == names


def test_names_that_are_identifiers_keep_theirs():
    assert unique_identifiers(["a.b", "a_b", "left.voltage", "1st", "θ"]) == [
        "a_b_2",
        "a_b",
        "left_voltage",
        "x1st",
        "x_",
    ]


@given(st.lists(st.text("ab./", max_size=4) | st.sampled_from(["", "log", "system", "log_2"]), unique=True))
def test_topics_are_distinct_and_do_not_depend_on_the_order(components):
    found = topics(components)
    assert len({*found.values(), "/log"}) == len(components) + 1
    assert found == topics(reversed(components))
    assert "" not in found or found[""] == "/system"


def test_start_time_is_time_zero(tmp_path):
    described = [Channel("plant", (Signal("x", "Real", None, "output"),))]
    with McapLog(tmp_path / "a.mcap", described, {}, start_time=-2.5) as log:
        log.event(-2.5, "info", "plant", "begins")
        log.write(np.array([-2.5, -2.4999999996, 0.25]), np.zeros((3, 1)))
    _, times, _ = read_by_mcap(tmp_path / "a.mcap", described)
    assert times == {"/plant": [0, 0, 2_750_000_000], "/log": [0]}


def test_text_that_utf8_cannot_carry(tmp_path):
    with McapLog(tmp_path / "a.mcap", [], {"twip": {"command": "run \udcff.ssp"}}) as log:
        log.event(float("nan"), "loud", "pl\udc80nt", "b\udcffd")
    with (tmp_path / "a.mcap").open("rb") as stream:
        (event,) = make_reader(stream, True, [DecoderFactory()]).iter_decoded_messages()
        assert (event.decoded_message.name, event.decoded_message.message) == ("pl\\udc80nt", "b\\udcffd")
        assert event.decoded_message.level == 0


@pytest.mark.parametrize(
    ("place", "reason"),
    [
        ("folder", "Is a directory"),
        ("file/a.mcap", "Not a directory|File exists"),
        ("x" * 300, "File name too long"),
        ("nul\0", "null byte"),
    ],
)
def test_path_that_cannot_be_written(tmp_path, place, reason):
    (tmp_path / "folder").mkdir()
    (tmp_path / "file").write_text("")
    with pytest.raises(TwipError, match=rf"^log .* cannot be written: .*({reason})") as caught:
        McapLog(tmp_path / place, channels(), {})
    assert "\n" not in str(caught.value)


def test_full_disk_from_the_start():
    with pytest.raises(TwipError, match=r"^log '/dev/full' cannot be written: No space left on device$"):
        McapLog("/dev/full", channels(), {})


DISK_FILLS = """
import resource, sys
import numpy as np
from twip.cosim.log import McapLog
from twip.cosim.record import Channel, Signal
from twip.errors import TwipError
log = McapLog(sys.argv[1], [Channel("plant", (Signal("x", "Real", "m", "output"),))], {}, compression="none")
resource.setrlimit(resource.RLIMIT_FSIZE, (40_000, 40_000))
times, rows = np.arange(10_000) * 1e-3, np.random.default_rng(0).normal(size=(10_000, 1))
try:
    log.write(times, rows)
except TwipError as error:
    print(error)
log.event(10.0, "error", "master", "too late")
log.close()
try:
    log.write(times + 10.0, rows)
except TwipError as error:
    print(error)
"""


def test_disk_that_fills_up_leaves_whole_chunks(tmp_path):
    path = tmp_path / "a.mcap"
    done = subprocess.run([sys.executable, "-c", DISK_FILLS, path], capture_output=True, text=True, check=True)
    first, second = done.stdout.splitlines()
    assert first == f"log '{path}' cannot be written: File too large"
    assert second.startswith(f"log '{path}' cannot be written: ")
    left = playback.read(path)
    assert not left.complete
    assert len(left.times) % 200 == 0
    assert len(left.times) > 0
    # The part of a chunk that still went through is cut off: the file ends with the last index record.
    with path.open("rb") as stream:
        records = StreamReader(stream, emit_chunks=True).records
        kinds = [
            type(record).__name__
            for record in itertools.takewhile(lambda _: stream.tell() < path.stat().st_size, records)
        ]
    assert kinds[-1] in ("Chunk", "MessageIndex")


KILLED = """
import sys, time
import numpy as np
from twip.cosim.log import McapLog
from twip.cosim.record import Channel, Signal
described = [Channel(c, tuple(Signal(f"v{i}", "Real", "m", "output") for i in range(20))) for c in ("plant", "imu")]
log = McapLog(sys.argv[1], described, {"twip": {"seed": "7"}})
for k in range(0, 10**9, 170):
    steps = np.arange(k, k + 170)
    log.write(steps * 1e-3, np.sin(steps[:, None] * np.arange(1, 41)))
    print(k + 170, flush=True)
"""


def test_killed_run_keeps_every_finished_chunk(tmp_path):
    path = tmp_path / "a.mcap"
    with subprocess.Popen([sys.executable, "-c", KILLED, path], stdout=subprocess.PIPE, text=True) as run:
        written = 0
        for line in run.stdout:
            written = int(line)
            if written > 5000:
                run.kill()
                break
        rest = run.stdout.read().splitlines()
    assert run.returncode == -signal.SIGKILL
    written = int(rest[-1]) if rest and rest[-1].endswith("0") else written
    left = playback.read(path)
    assert not left.complete
    assert left.metadata["twip"] == {"seed": "7"}
    count = len(left.times)
    assert count >= written // 200 * 200
    expected = np.sin(np.arange(count)[:, None] * np.arange(1, 41))
    assert np.array_equal(left.table(), expected)
    assert np.array_equal(left.times, np.arange(count) * 1_000_000 / 1e9)
    seen: Counter[int] = Counter()
    # The package's own reader meets the missing end as an error, which one depends on where the kill struck.
    with path.open("rb") as stream, contextlib.suppress(EndOfFile, struct.error, zstandard.ZstdError):
        for record in StreamReader(stream, validate_crcs=True).records:
            if type(record).__name__ == "Message":
                seen[record.channel_id] += 1
    assert seen == {1: count, 2: count}


@pytest.mark.parametrize("times", [[0.0, np.nan], [np.nan], [np.inf], [-0.001], [0.0, 0.2, 0.1], [1e12]])
def test_times_out_of_order_are_refused(tmp_path, times):
    with McapLog(tmp_path / "a.mcap", [Channel("plant", (Signal("x", "Real", None, "output"),))], {}) as log:
        with pytest.raises(TwipError, match="must not decrease"):
            log.write(np.array(times), np.zeros((len(times), 1)))
        log.write(np.array([0.5]), np.zeros((1, 1)))
        with pytest.raises(TwipError, match=r"must not lie before 0\.5 s"):
            log.write(np.array([0.4]), np.zeros((1, 1)))


@pytest.mark.parametrize(
    ("kind", "value"),
    [("Integer", 0.5), ("Integer", np.nan), ("Integer", 2.0**63), ("Boolean", 2.0), ("Boolean", np.nan)],
)
def test_value_that_is_not_of_its_type(tmp_path, kind, value):
    described = [Channel("plant", (Signal("x", "Real", None, "output"), Signal("count", kind, None, "output")))]
    rows = np.ones((5, 2))
    rows[3, 1] = value
    message = re.escape(f"plant.count = {value} at t = 0.3 s is not a value of its type {kind}")
    with McapLog(tmp_path / "a.mcap", described, {}) as log, pytest.raises(TwipError, match=f"^{message}$"):
        log.write(np.array([0.0, 0.1, 0.2, 0.3, 0.4]), rows)
    assert np.array_equal(playback.read(tmp_path / "a.mcap").table(), rows[:3])


def test_names_given_twice_and_unknown_compression(tmp_path):
    twice = Channel("plant", (Signal("x", "Real", None, "output"),) * 2)
    with pytest.raises(TwipError, match=r"more than one variable is named plant\.x"):
        McapLog(tmp_path / "a.mcap", [twice], {})
    with pytest.raises(TwipError, match=r"compression 'zip' of the log must be one of zstd, lz4, none"):
        McapLog(tmp_path / "a.mcap", [], {}, compression="zip")
    with McapLog(tmp_path / "a.mcap", channels(), {}) as log, pytest.raises(ValueError, match="columns"):
        log.write(np.zeros(2), np.zeros((2, 3)))


@pytest.mark.foreign
@pytest.mark.parametrize("compression", ["zstd", "lz4", "none"])
@pytest.mark.parametrize("count", [0, 1, 450])
def test_checkers_find_nothing(tmp_path, compression, count):
    path = tmp_path / "a.mcap"
    write(path, count, compression=compression)
    checked = _run("rerun", "mcap", "check", "--full", path)
    rows = re.findall(r"^(\w+)\s+\d+\s+\d+\s+(/\S+)\s+(.*)$", checked, re.MULTILINE)
    expected = {"/log"} | ({"/left/motor", "/left/motor_2", "/system", "/system_2", "/log_2"} if count else set())
    assert {topic for _, topic, _ in rows} == expected
    assert {(status, issues.strip()) for status, _, issues in rows} == {("ok", "—")}
    findings = [json.loads(line) for line in _run("pymcap-cli", "doctor", "--format", "jsonl", path).splitlines()]
    assert not [f for f in findings if f.get("severity") in ("warning", "error")], findings


@pytest.mark.foreign
def test_rerun_reads_every_value(tmp_path):
    rows = write(tmp_path / "a.mcap")
    python = Path(_tool("rerun")).resolve().parent / "python"
    script = Path(__file__).with_name("log_rerun.py")
    subprocess.run([python, script, tmp_path / "a.mcap", tmp_path / "a.npz"], check=True, capture_output=True)
    seen = np.load(tmp_path / "a.npz")
    column = 0
    names = {
        "left.motor": "/left/motor",
        "left/motor": "/left/motor_2",
        "system": "/system_2",
        "log": "/log_2",
        "": "/system",
    }
    for channel in (c for c in channels() if c.signals):
        assert np.array_equal(seen[names[channel.component] + " time"], np.arange(450) * 1_000_000)
        for field in unique_identifiers([s.name for s in channel.signals]):
            # Bit for bit, but for the sign of zeros, which Rerun drops as a default value of proto3.
            expected = np.where(rows[:, column] == 0.0, 0.0, rows[:, column]).view(np.uint64)
            values = seen[f"{names[channel.component]} {field}"].astype(np.float64).view(np.uint64)
            assert np.array_equal(values, expected), field
            column += 1


@pytest.mark.foreign
def test_rerun_converts_and_mends(tmp_path):
    """A converted log verifies; what a killed run has left is mended by both tools, with every whole chunk."""
    write(tmp_path / "a.mcap")
    data = (tmp_path / "a.mcap").read_bytes()
    with (tmp_path / "a.mcap").open("rb") as stream:
        chunks = make_reader(stream).get_summary().chunk_indexes
    second = chunks[1]
    (tmp_path / "cut.mcap").write_bytes(
        data[: second.chunk_start_offset + second.chunk_length + second.message_index_length]
    )
    for name, options in (("a", []), ("cut", ["--recover"])):
        source, target = tmp_path / f"{name}.mcap", tmp_path / f"{name}.rrd"
        _run(
            "rerun",
            "mcap",
            "convert",
            *options,
            "--application-id",
            "twip",
            "--timeline-type",
            "duration",
            source,
            "-o",
            target,
        )
        assert "verified without error" in _run("rerun", "rrd", "verify", target)
    subprocess.run(
        [_tool("pymcap-cli"), "recover", tmp_path / "cut.mcap", "-o", tmp_path / "mended.mcap"], capture_output=True
    )
    mended, cut = playback.read(tmp_path / "mended.mcap"), playback.read(tmp_path / "cut.mcap")
    assert (mended.complete, cut.complete) == (True, False)
    assert len(cut.times) == 400
    assert np.array_equal(mended.table().view(np.uint64), cut.table().view(np.uint64))
    assert mended.events == cut.events


def _tool(name: str) -> str:
    found = shutil.which(name, path=str(Path(sys.executable).parent)) or shutil.which(name)
    if not found:
        pytest.fail(f"{name} is not installed: pip install -e '.[foreign]'")
    return found


def _run(tool: str, *arguments: object) -> str:
    done = subprocess.run([_tool(tool), *map(str, arguments)], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout + done.stderr


def _message_class(data: bytes, name: str) -> type:
    pool = DescriptorPool()
    for file in FileDescriptorSet.FromString(data).file:
        pool.Add(file)
    return GetMessageClass(pool.FindMessageTypeByName(name))
