"""The log as Rerun and pymcap-cli read it."""

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from log_samples import channels, write
from mcap.reader import make_reader

from twip.cosim.log import playback
from twip.cosim.log.log_schema import unique_identifiers


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
