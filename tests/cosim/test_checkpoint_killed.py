"""Runs that are killed or interrupted go on from their checkpoint."""

import shlex
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from checkpoint_runs import run
from ssp_writer import bind, component, connection, system, write

from twip.cli import main
from twip.cosim.run.checkpoint import Checkpoint

TWIP = "import sys\nfrom twip.cli import main\nsys.exit(main())"


@pytest.fixture
def folder(state_folder):
    """The FMUs, able to serialize their state, and `in.csv`."""
    return state_folder


@pytest.fixture
def slow(folder):
    """A system of which each step takes 10 ms."""
    fault = bind({"fault": ("String", "slow"), "fault_time": ("Real", 0.0)})
    parts = [component("f", "CosimFaulty.fmu", "y<", fault), component("i", "CosimIntegrator.fmu", "u> x<")]
    return write(folder, system(parts, [connection("f.y -> i.u")]))


def start(path, folder, *options):
    command = [sys.executable, "-c", TWIP, "run", str(path), "--step-size", "0.01", "--stop-time", "1000", *options]
    return subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def steps_in(file, at_least):
    """Wait for a checkpoint of so many steps; return its steps."""
    end = time.monotonic() + 30
    while time.monotonic() < end:
        if file.exists() and (steps := Checkpoint.read(file).steps) >= at_least:
            return steps
        time.sleep(0.02)
    return pytest.fail(f"no checkpoint after {at_least} steps")


def assert_goes_on(path, file):
    """Compare 20 more steps with a run that never stopped."""
    steps = Checkpoint.read(file).steps
    options = {
        "step_size": 0.01,
        "mid_step": [],
        "input_file": None,
        "stop_time": (steps + 20) * 0.01,
        "coupling": None,
    }
    whole, _ = run(path, **options)
    rest, _ = run(path, resume=file, **options)
    assert len(rest.times) == 21
    assert rest.values.tobytes() == whole.values[steps:].tobytes()


def test_a_killed_run_goes_on_from_its_last_checkpoint(slow, folder, loop):
    file = folder / "x.checkpoint"
    process = start(slow, folder, "--no-log", "--checkpoint", str(file), "--checkpoint-every", "0.05", "--loop", loop)
    steps_in(file, 5)
    process.kill()
    process.communicate(timeout=30)
    assert Checkpoint.read(file).steps % 5 == 0
    assert_goes_on(slow, file)


def test_after_ctrl_c_the_command_that_is_told_goes_on(slow, folder, loop, monkeypatch, capsys):
    process = start(slow, folder, "--checkpoint-every", "0.05", "--output-file", "out.csv", "--loop", loop)
    file = folder / "logs" / "SystemStructure.checkpoint"
    steps_in(file, 5)
    process.send_signal(signal.SIGINT)
    out, _ = process.communicate(timeout=30)
    assert process.returncode == 130
    steps = Checkpoint.read(file).steps
    reached = f"{steps * 0.01:g}"
    told = {line[:19].strip(): line[20:] for line in out.splitlines()}
    assert told["interrupted at"] == f"{reached} s in {steps} steps of 0.01 s (jacobi)"
    assert told["checkpoint"] == "logs/SystemStructure.checkpoint"
    assert_goes_on(slow, file)

    monkeypatch.chdir(folder)
    command = [*shlex.split(told["go on by"])[1:], "--stop-time", f"{(steps + 20) * 0.01:g}"]
    assert main(command) == 0
    assert f"{(steps + 20) * 0.01:g} s from {reached} s in 20 steps" in capsys.readouterr().out
    assert (folder / "logs" / "SystemStructure.mcap").is_file()
    assert (folder / "logs" / f"SystemStructure-from-{reached}s.mcap").is_file()
    before, after = (Path(name).read_text().splitlines() for name in ("out.csv", f"out-from-{reached}s.csv"))
    assert len(before) == steps + 2
    assert after[:2] == [before[0], before[-1]]
    assert len(after) == 22
