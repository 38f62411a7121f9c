"""Logs that cannot be written, or not to their end."""

import contextlib
import itertools
import os
import re
import signal
import struct
import subprocess
import sys
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
import zstandard
from log_samples import channels
from mcap.exceptions import EndOfFile
from mcap.stream_reader import StreamReader

from twip.cosim.log import playback
from twip.cosim.model.signals import Channel, Signal
from twip.cosim.sinks.mcap_log import McapLog
from twip.errors import TwipError


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
    log = McapLog("/dev/full", channels(), {})
    with pytest.raises(TwipError, match=r"^log '/dev/full' cannot be written: No space left on device$"):
        log.begin()
    assert Path("/dev/full").is_char_device()


def test_a_log_without_rows_leaves_what_is_there(tmp_path):
    path, fresh = tmp_path / "a.mcap", tmp_path / "b.mcap"
    path.write_bytes(b"precious")
    for name in (path, fresh):
        with McapLog(name, channels(), {}) as log:
            log.event(0.0, "error", "plant", "cannot begin")
    assert path.read_bytes() == b"precious"
    assert not fresh.exists()


CLOSES = """
import os, sys
import numpy as np
from twip.cosim.sinks.mcap_log import McapLog
from twip.cosim.model.signals import Channel, Signal
from twip.errors import TwipError
path, deed = sys.argv[1:]
def find():
    for fd in range(3, 64):
        try:
            if os.path.samestat(os.fstat(fd), os.stat(path)):
                return fd
        except OSError:
            pass
deeds = {
    "close": lambda: os.close(find()),
    "reopen": lambda: os.dup2(os.open(f"{path}.other", os.O_CREAT | os.O_WRONLY), find()),
    "append": lambda: open(path, "ab").write(b"foreign"),
    "empty": lambda: os.truncate(path, 0),
    "seek": lambda: os.lseek(find(), 7, 0),
}
log = McapLog(path, [Channel("plant", (Signal("x", "Real", "m", "output"),))], {})
log.write(np.arange(200) * 1e-3, np.zeros((200, 1)))
deeds[deed]()
try:
    log.write(0.2 + np.arange(100) * 1e-3, np.zeros((100, 1)))
    log.close()
except TwipError as error:
    print(error)
"""


@pytest.mark.parametrize(
    ("deed", "said", "rows"),
    [
        ("close", "an FMU or something else in this process has closed its descriptor", 200),
        ("reopen", "an FMU or something else in this process has closed its descriptor", 200),
        ("append", "something else has changed it meanwhile: it had .* bytes instead of", 200),
        ("empty", "something else has changed it meanwhile: it had 0 bytes instead of", None),
        ("seek", "", 300),
    ],
)
def test_what_others_do_to_the_file_or_its_descriptor_is_noticed(tmp_path, deed, said, rows):
    path = tmp_path / "a.mcap"
    done = subprocess.run([sys.executable, "-c", CLOSES, path, deed], capture_output=True, text=True, check=True)
    assert re.match(f"^log '{path}' cannot be written: {said}" if said else "$", done.stdout), done.stdout
    assert done.stderr == ""
    if rows is not None:
        left = playback.read(path)
        assert (len(left.times), left.complete) == (rows, not said)
    if deed == "reopen":
        assert (tmp_path / "a.mcap.other").read_bytes() == b""


def test_a_copy_of_the_process_does_not_write(tmp_path):
    path = tmp_path / "a.mcap"
    log = McapLog(path, channels(), {})
    log.begin()
    before = path.read_bytes()
    copy = os.fork()
    if not copy:
        try:
            log.close()
        except TwipError as error:
            os._exit(0 if "is being written by the process from which" in str(error) else 1)
        os._exit(2)
    assert os.waitpid(copy, 0)[1] == 0
    assert path.read_bytes() == before
    log.close()
    assert playback.read(path).complete


DISK_FILLS = """
import resource, sys
import numpy as np
from twip.cosim.sinks.mcap_log import McapLog
from twip.cosim.model.signals import Channel, Signal
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
from twip.cosim.sinks.mcap_log import McapLog
from twip.cosim.model.signals import Channel, Signal
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
