"""The log as the mcap package and protobuf read it."""

import numpy as np
import pytest
from log_samples import channels, read_by_mcap, table, write
from mcap.reader import NonSeekingReader, make_reader
from mcap.records import Attachment as AttachmentRecord
from mcap.records import Channel as ChannelRecord
from mcap.records import Chunk, Metadata
from mcap.stream_reader import StreamReader
from mcap_protobuf.decoder import DecoderFactory

from twip.cosim.log import playback
from twip.cosim.model.signals import Channel, Signal
from twip.cosim.sinks.mcap_log import Attachment, McapLog
from twip.errors import TwipError


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


def test_start_time_is_time_zero(tmp_path):
    described = [Channel("plant", (Signal("x", "Real", None, "output"),))]
    with McapLog(tmp_path / "a.mcap", described, {}, start_time=-2.5) as log:
        log.event(-2.5, "info", "plant", "begins")
        log.write(np.array([-2.5, -2.4999999996, 0.25]), np.zeros((3, 1)))
    _, times, _ = read_by_mcap(tmp_path / "a.mcap", described)
    assert times == {"/plant": [0, 0, 2_750_000_000], "/log": [0, 0]}  # the second tells of the rows that share a time


def test_text_that_utf8_cannot_carry(tmp_path):
    with McapLog(tmp_path / "a.mcap", [], {"twip": {"command": "run \udcff.ssp"}}) as log:
        log.begin()
        log.event(float("nan"), "loud", "pl\udc80nt", "b\udcffd")
    with (tmp_path / "a.mcap").open("rb") as stream:
        (event,) = make_reader(stream, True, [DecoderFactory()]).iter_decoded_messages()
        assert (event.decoded_message.name, event.decoded_message.message) == ("pl\\udc80nt", "b\\udcffd")
        assert event.decoded_message.level == 0
