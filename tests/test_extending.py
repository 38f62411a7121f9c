"""The guide's examples run as printed, each as one new file in a copy of the package."""

import json
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from twip.cli import COMMANDS
from twip.cosim import Runtime, load, read_log, simulate

ROOT = Path(__file__).parents[1]
GUIDE = (ROOT / "docs" / "extending.md").read_text(encoding="utf-8")
FILES = re.compile(r"^`([\w./]+)`:\n\n```\w+\n(.*?)^```$", re.DOTALL | re.MULTILINE)


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    """A folder with a copy of the package, the blocks and the systems."""
    folder = tmp_path_factory.mktemp("extended")
    for name in ("src", "fmus", "ssp"):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__", "*.fmu", "*.ssp"))
    shutil.copy(ROOT / "LICENSE", folder)
    return folder


@pytest.fixture
def follow(package, built, tmp_path, monkeypatch):
    """Follow a section of the guide: write its files and run its commands; return the folder and what they print."""

    def section(title):
        (text,) = re.findall(rf"^## {title}\n(.*?)(?=^## |\Z)", GUIDE, re.DOTALL | re.MULTILINE)
        (tmp_path / "ssp").symlink_to(built / "ssp")
        new = [name for name, _ in FILES.findall(text) if name.startswith(("src/", "fmus/"))]
        assert len(new) == 1, "one new file"
        for name, content in FILES.findall(text):
            path = (package if name in new else tmp_path) / name
            assert not path.exists()
            path.parent.mkdir(exist_ok=True)
            path.write_text(content, encoding="utf-8")
        monkeypatch.setenv("PYTHONPATH", str(package / "src"))
        commands = re.findall(r"^(?:    )?twip (.*)$", text, re.MULTILINE)
        assert commands
        printed = []
        for command in commands:
            words = shlex.split(command) + (["--loop", "python"] if command.startswith("run ") else [])
            program = [sys.executable, "-m", "twip.cli"]
            run = subprocess.run([*program, *words], cwd=tmp_path, capture_output=True, text=True, check=False)
            assert run.returncode == 0, (command, run.stderr)
            printed.append(run.stdout)
        return tmp_path, printed

    return section


def test_a_new_fault_acts_by_its_file_alone(follow):
    folder, _ = follow("A fault")
    log = read_log(folder / "drift.mcap")
    steps = np.arange(1000) - 250  # since the fault began, of 1 ms each
    drift = np.where(steps < 0, 0.0, np.minimum(1.0, steps / 500) * 0.02)
    assert np.array_equal(log["estimator.gyro"][1:], log["imu.gyro"][1:] + drift)
    assert [(e.time, e.text) for e in log.events if "fault" in e.text] == [
        (0.25, "fault begins: imu.gyro drifts by 0.02 rad/s within 0.5 s")
    ]


def test_a_new_sink_writes_by_its_file_alone(follow, built):
    folder, _ = follow("A sink")
    lines = [json.loads(line) for line in (folder / "robot.jsonl").read_text(encoding="utf-8").splitlines()]
    rows = [line for line in lines if "message" not in line]
    with load(built / "ssp" / "twip.ssp") as system:
        result = simulate(system, stop_time=0.2, runtime=Runtime(loop="python"))
        for name in ("plant.pitch", "controller.left.voltage"):
            assert [row[name] for row in rows] == result[name].tolist()
        assert list(rows[0]) == ["time", *system.columns]
    assert [row["time"] for row in rows] == result.times.tolist()


def test_a_new_command_is_there_by_its_file_alone(follow, package):
    folder, (_, printed) = follow("A command")
    assert printed.splitlines() == sorted(printed.splitlines())
    assert set(printed.splitlines()) == set(read_log(folder / "short.mcap").signals)
    run = subprocess.run([sys.executable, "-m", "twip.cli", "--help"], capture_output=True, text=True, check=True)
    assert re.search(r"^ +signals +list the signals of a log$", run.stdout, re.MULTILINE)
    listed = re.findall(r"^    (\w+)(?: |$)", run.stdout, re.MULTILINE)
    assert listed == [*COMMANDS, "signals"]


def test_a_new_coupling_steps_by_its_file_alone(follow, built):
    folder, _ = follow("A coupling")
    with load(built / "ssp" / "twip.ssp") as system:
        order = [component.name for component in system.components]

    def rows(*options):
        words = [sys.executable, "-m", "twip.cli", "run", "ssp/twip.ssp", "--stop-time", "0.1", *options]
        words += ["--no-log", "--output-file", "rows.csv", "--loop", "python"]
        run = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False)
        assert run.returncode == 0, run.stderr
        return (folder / "rows.csv").read_bytes()

    grouped = (folder / "grouped.csv").read_bytes()
    one, all_ = rows("--coupling", "gauss-seidel"), rows("--coupling", "jacobi")
    assert rows("--coupling", "grouped", "--group-size", "1") == one
    assert rows("--coupling", "grouped", "--group-size", str(len(order))) == all_
    assert len({grouped, one, all_}) == 3
    check = [sys.executable, "-m", "twip.cli", "check", "ssp/twip.ssp", "--coupling"]
    for options, text in (
        (["grouped", "--group-size", "0"], "group size 0 must be at least 1"),
        (["jacobi", "--group-size", "2"], "group size has a meaning under grouped only, not under jacobi"),
    ):
        refused = subprocess.run([*check, *options], cwd=folder, capture_output=True, text=True, check=False)
        assert (refused.returncode, text in refused.stderr) == (1, True)
    told = subprocess.run([*check, "grouped"], cwd=folder, capture_output=True, text=True, check=True).stdout
    assert re.search(r"^coupling +grouped\n +group size +2$", told, re.MULTILINE), told


def test_a_new_block_is_built_and_balances_by_its_file_alone(follow):
    folder, _ = follow("A block")
    log = read_log(folder / "upright.mcap")
    assert np.abs(log["plant.pitch"][log.times >= 4.0]).max() < np.radians(1.0)
    assert np.array_equal(log["controller.left.voltage"], log["controller.right.voltage"])
