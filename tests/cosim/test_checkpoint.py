"""A run that is saved and goes on elsewhere is the run that never stopped, bit for bit."""

import json
import os
import shlex
import shutil
import signal
import subprocess
import sys
import time
import zipfile
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from ssp_writer import bind, component, connection, edit_fmu, linear, system, write

from twip.cli import main
from twip.cosim import Table, load, simulate
from twip.cosim.checkpoint import Checkpoint, Saving
from twip.cosim.component import Instance
from twip.errors import TwipError

STEP = 1 / 128
INPUTS = "time,m.smooth,m.held,m.n,m.on\n0,0.1,1,4,1\n0.6,-0.3,2,-5,0\n1.2,0.2,3,9,1\n"


@pytest.fixture
def folder(fmus, tmp_path):
    """FMUs that can serialize their state, with the dependencies they have."""
    depends = {"CosimGain": {"y": ["u"], "z": ["u"]}, "CosimIntegrator": {"x": []}}
    for fmu in fmus.glob("*.fmu"):
        edit_fmu(fmu, tmp_path / fmu.name, dependencies=depends.get(fmu.stem), state=True)
    (tmp_path / "in.csv").write_text(INPUTS)
    return tmp_path


def describe(folder, *, factor=-1.0, start=1.0, gain="CosimGain.fmu"):
    """An oscillator that drives, and is driven by, a component with Integers and Booleans."""
    parts = [
        component("a", "CosimIntegrator.fmu", "u> x<"),
        component("b", "CosimIntegrator.fmu", "u> x<", bind({"x_start": ("Real", start)})),
        component("g", gain, "u> y<"),
        component("m", "CosimMixed.fmu", "total<:Integer seen<"),
    ]
    wires = [
        connection("a.x -> g.u", linear(factor=factor)),
        connection("g.y -> b.u", linear(factor=0.5)),
        connection("b.x -> a.u"),
    ]
    return write(folder, system(parts, wires))


def run(path, **options):
    """Run with everything that a step may remember: mid-step inputs, driven inputs."""
    given = {"step_size": STEP, "coupling": "gauss-seidel", "mid_step": ["a.u", "b.u"], "loop": "python", **options}
    given.setdefault("input_file", path.parent / "in.csv")
    with load(path) as loaded:
        table = Table(loaded.channels)
        result = simulate(loaded, sinks=[table], **given)
    return table, result


@pytest.mark.parametrize("resumed_by", ["compiled", "python"])
@pytest.mark.parametrize("saved_by", ["compiled", "python"])
@pytest.mark.parametrize("coupling", ["jacobi", "gauss-seidel"])
def test_a_resumed_run_is_the_uninterrupted_one(folder, coupling, saved_by, resumed_by):
    path, file = describe(folder), folder / "half.checkpoint"
    whole, whole_result = run(path, coupling=coupling, stop_time=2.5, loop=resumed_by)
    first, first_result = run(path, coupling=coupling, stop_time=0.75, loop=saved_by, checkpoint=file)
    assert first_result.checkpoint == file
    second, result = run(path, coupling=coupling, stop_time=2.5, loop=resumed_by, resume=file)
    # the row of the checkpoint is the last of the one and the first of the other
    assert second.times[0] == first.times[-1] == 0.75
    assert second.values[0].tobytes() == first.values[-1].tobytes()
    assert np.concatenate([first.times, second.times[1:]]).tobytes() == whole.times.tobytes()
    assert np.concatenate([first.values, second.values[1:]]).tobytes() == whole.values.tobytes()
    assert result.values == whole_result.values
    assert (result.start_time, result.time, result.steps) == (0.75, 2.5, 224)
    assert result.checkpoint is None
    assert [e.text for e in second.events if e.level == "info"] == ["resumed from a checkpoint at t = 0.75 s"]


@pytest.mark.parametrize("steps", [0, 1, 2, 199, 200, 201])
def test_every_step_can_be_resumed_from(folder, steps):
    path, file = describe(folder), folder / "x.checkpoint"
    whole, _ = run(path, stop_time=2.0)

    class Stop(Table):
        def write(self, times, rows):
            super().write(times, rows)
            if len(self.times) > steps:
                os.kill(os.getpid(), signal.SIGINT)

    with load(path) as loaded:
        table = Stop(loaded.channels)
        result = simulate(
            loaded, sinks=[table], step_size=STEP, coupling="gauss-seidel", mid_step=["a.u", "b.u"], stop_time=2.0,
            input_file=folder / "in.csv", checkpoint=file, checkpoint_every=max(steps, 1) * STEP, loop="python",
        )  # fmt: skip
    assert (result.interrupted, result.steps, result.checkpoint) == (True, steps, file)
    rest, _ = run(path, stop_time=2.0, resume=file)
    assert rest.values.tobytes() == whole.values[steps:].tobytes()


def test_a_chain_of_checkpoints_and_a_start_time(folder):
    path, file = describe(folder), folder / "x.checkpoint"
    whole, _ = run(path, start_time=-1.0, stop_time=0.5)
    parts = [run(path, start_time=-1.0, stop_time=-0.5, checkpoint=file)[0]]
    for stop in (-0.25, 0.25, 0.5):
        parts.append(run(path, start_time=-1.0, stop_time=stop, checkpoint=file, resume=file)[0])
    assert np.concatenate([parts[0].values, *(p.values[1:] for p in parts[1:])]).tobytes() == whole.values.tobytes()


def test_a_checkpoint_does_not_change_the_run_and_the_same_state_gives_the_same_bytes(folder, tmp_path):
    path = describe(folder)
    plain, _ = run(path)
    files = [tmp_path / name for name in ("one", "two", "deep/er/three")]
    saved, _ = run(path, checkpoint=files[0], checkpoint_every=0.1)
    assert saved.values.tobytes() == plain.values.tobytes()
    run(path, checkpoint=files[1], loop="compiled")
    run(path, checkpoint=files[2], resume=files[0], stop_time=1.5)
    run(path, checkpoint=files[1], stop_time=1.5, loop="compiled")
    assert files[1].read_bytes() == files[2].read_bytes()
    with zipfile.ZipFile(files[0]) as archive:
        assert archive.namelist() == [
            "checkpoint.json",
            "values",
            "samples",
            "delayed",
            *(f"states/{i}" for i in range(4)),
        ]
    assert [p.name for p in files[2].parent.iterdir()] == ["three"]


@pytest.mark.parametrize(
    ("every", "step", "steps"),
    [
        (0.1, 0.05, [2, 4, 6, 8, 10]),
        (0.3, 0.1, [3, 6, 9, 10]),  # 0.3 / 0.1 is not 3
        (0.25, 0.1, [3, 5, 8, 10]),  # the first step that reaches the time
        (0.001, 0.1, list(range(1, 11))),
        (1e-12, 0.1, list(range(1, 11))),
        (7.0, 0.1, [10]),
        (None, 0.1, [10]),
    ],
)
def test_when_a_run_is_saved(tmp_path, every, step, steps):
    saving = Saving(tmp_path, None if every is None else max(every / step, 1.0))
    found = [saving.next(0, 10)]
    while found[-1] < 10:
        found.append(saving.next(found[-1], 10))
    assert found == steps


def test_a_failed_run_leaves_its_last_checkpoint(folder):
    fault = bind({"fault": ("String", "raise"), "fault_time": ("Real", 0.5)})
    path, file = write(folder, system([component("f", "CosimFaulty.fmu", "y<", fault)])), folder / "x.checkpoint"
    options = {"step_size": 0.125, "checkpoint": file, "mid_step": [], "input_file": None}
    with pytest.raises(TwipError) as failure:
        run(path, checkpoint_every=0.3, **options)
    assert Checkpoint.read(file).steps == 3
    with pytest.raises(TwipError) as again:
        run(path, resume=file, **options)
    assert str(again.value) == str(failure.value)
    assert Checkpoint.read(file).steps == 3


def test_states_are_freed(folder, monkeypatch):
    counts = Counter()
    original = Instance.call

    def counting(self, function, *arguments):
        counts[function] += "FMUstate" in function
        return original(self, function, *arguments)

    monkeypatch.setattr(Instance, "call", counting)
    path, file = describe(folder), folder / "x.checkpoint"
    run(path, checkpoint=file, checkpoint_every=0.25)
    run(path, resume=file, stop_time=1.25)
    made = counts["fmi2GetFMUstate"], counts["fmi2DeSerializeFMUstate"]
    assert made == (4 * 4, 4)
    assert counts["fmi2FreeFMUstate"] == sum(made)


def test_inputs_may_change_after_the_checkpoint_only(folder):
    path, file = describe(folder), folder / "x.checkpoint"
    run(path, checkpoint=file, stop_time=0.5)
    (folder / "later.csv").write_text(INPUTS.replace("1.2,0.2", "0.6,0.2,7,7,1\n1.2,0.2"))
    changed, _ = run(path, resume=file, input_file=folder / "later.csv")
    whole, _ = run(path, input_file=folder / "later.csv")
    assert changed.values.tobytes() == whole.values[64:].tobytes()
    (folder / "earlier.csv").write_text(INPUTS.replace("0,0.1,1", "0,0.1,1.5"))
    with pytest.raises(TwipError, match="the inputs up to the checkpoint have other values than in the run it belongs"):
        run(path, resume=file, input_file=folder / "earlier.csv")


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        ({"coupling": "jacobi"}, "coupling differs: jacobi here, gauss-seidel in the checkpoint"),
        ({"mid_step": []}, "list of mid-step inputs differs: none here, a.u, b.u in the checkpoint"),
        ({"step_size": 1 / 64}, "step size [s] differs: 0.015625 here, 0.0078125 in the checkpoint"),
        ({"start_time": -0.5}, "start time [s] differs: -0.5 here, 0.0 in the checkpoint"),
        ({"input_file": None}, "list of inputs with time series differs: none here, m.held, m.n, m.on, m.smooth in"
         " the checkpoint"),
        ({"stop_time": 0.5}, "the run is at 0.5 s, the stop time must be later than that"),
        ({"stop_time": 0.25}, "the run is at 0.5 s, the stop time must be later than that"),
    ],
)  # fmt: skip
def test_a_run_with_other_options_is_refused(folder, change, problem):
    path, file = describe(folder), folder / "x.checkpoint"
    run(path, checkpoint=file, stop_time=0.5)
    with pytest.raises(TwipError) as failure:
        run(path, resume=file, **change)
    assert str(failure.value) == f"{file}: {problem}"


def test_another_system_is_refused_with_all_differences(folder):
    file = folder / "x.checkpoint"
    run(describe(folder), checkpoint=file, stop_time=0.5)
    edit_fmu(folder / "CosimGain.fmu", folder / "other.fmu", files={"resources/more.txt": b""})
    opened = []
    path = describe(folder, factor=-2.0, start=3.0, gain="other.fmu")
    path.write_text(path.read_text().replace('name="test"', 'name="else"'))
    with (
        load(path) as loaded,
        pytest.raises(TwipError) as failure,
    ):
        simulate(loaded, step_size=STEP, coupling="gauss-seidel", mid_step=["a.u", "b.u"],
                 input_file=folder / "in.csv", resume=file, sinks=lambda grid: opened.append(grid) or [])  # fmt: skip
    lines = [line.removeprefix(f"{file}: ") for line in str(failure.value).splitlines()]
    assert [line.partition(" differs: ")[0] for line in lines] == [
        "FMU of g", "connection to g.u", "start value b.x_start", "system",
    ]  # fmt: skip
    assert lines[1:] == [
        "connection to g.u differs: a.x * -2.0 + 0.0 here, a.x * -1.0 + 0.0 in the checkpoint",
        "start value b.x_start differs: 3.0 here, 1.0 in the checkpoint",
        "system differs: else here, test in the checkpoint",
    ]
    assert opened == []  # no log has been replaced


@pytest.mark.parametrize("option", ["checkpoint", "resume"])
def test_components_that_cannot_give_away_their_state_are_named_before_the_run(folder, fmus, option):
    shutil.copy(fmus / "CosimGain.fmu", folder / "silent.fmu")
    file, opened = folder / "x.checkpoint", []
    run(describe(folder), checkpoint=file, stop_time=0.5)
    with load(describe(folder, gain="silent.fmu")) as loaded, pytest.raises(TwipError) as failure:
        simulate(loaded, step_size=STEP, sinks=lambda grid: opened.append(grid) or [], **{option: file})
    assert str(failure.value) == (
        "g: FMU silent.fmu cannot serialize its state (canSerializeFMUstate), which a checkpoint needs"
    )
    assert opened == []


def test_an_fmu_that_does_not_save_all_it_remembers_is_found_out(folder):
    path, file = write(folder, system([component("h", "CosimHidden.fmu", "y<")])), folder / "x.checkpoint"
    options = {"step_size": 0.25, "mid_step": [], "input_file": None}
    run(path, checkpoint=file, stop_time=0.5, **options)
    with pytest.raises(TwipError) as failure:
        run(path, resume=file, **options)
    assert str(failure.value) == (
        "h.y = 0.0 after its component's state was restored from the checkpoint, where it was 2.0:"
        " the FMU does not save its whole state"
    )


def cut(file):
    file.write_bytes(file.read_bytes()[:-40])


def flip(file):
    data = bytearray(file.read_bytes())
    with zipfile.ZipFile(file) as archive:
        data[archive.getinfo("values").header_offset + 40] ^= 1
    file.write_bytes(data)


def drop(file, name="samples", edit=None):
    with zipfile.ZipFile(file) as archive:
        members = {n: archive.read(n) for n in archive.namelist()}
    with zipfile.ZipFile(file, "w") as archive:
        for n, data in members.items():
            if n != name or edit is not None:
                archive.writestr(n, edit(data) if n == name else data)


def other_format(file):
    drop(file, "checkpoint.json", lambda data: json.dumps({**json.loads(data), "format": "twip.checkpoint 99"}))


@pytest.mark.parametrize(
    ("damage", "problem"),
    [
        (cut, "{file} is not a readable checkpoint (File is not a zip file)"),
        (flip, "{file} is not a readable checkpoint (Bad CRC-32 for file 'values')"),
        (drop, "{file} is not a readable checkpoint (\"There is no item named 'samples' in the archive\")"),
        (
            lambda file: drop(file, "states/3"),
            "{file} is not a readable checkpoint (something is missing)",
        ),
        (
            lambda file: drop(file, "values", lambda d: d[8:]),
            "{file} is not a readable checkpoint (something is missing)",
        ),
        (other_format, "checkpoint {file} has the format 'twip.checkpoint 99', not 'twip.checkpoint 2'"),
        (lambda file: file.write_text("time,a\n"), "{file} is not a readable checkpoint (File is not a zip file)"),
        (Path.unlink, "checkpoint {file} cannot be read (No such file or directory)"),
    ],
)
def test_a_damaged_file_is_one_line(folder, damage, problem):
    path, file = describe(folder), folder / "x.checkpoint"
    run(path, checkpoint=file, stop_time=0.5)
    damage(file)
    with pytest.raises(TwipError) as failure:
        run(path, resume=file)
    assert str(failure.value).startswith(problem.format(file=file))
    assert "\n" not in str(failure.value)


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        ({"checkpoint": "{}/in.csv/x"}, "checkpoint {}/in.csv/x cannot be written: its folder is a file"),
        ({"checkpoint": "{}"}, "checkpoint {} cannot be written: it is a folder"),
        ({"checkpoint": "{}/x", "checkpoint_every": 0.0}, "checkpoint interval 0.0 s must be a positive number"),
        ({"checkpoint_every": 0.5}, "a checkpoint interval needs a file for the checkpoint"),
    ],
)
def test_a_checkpoint_that_cannot_be_written_is_told_before_the_run(folder, options, problem):
    path = describe(folder)
    options = {k: v.format(folder) if isinstance(v, str) else v for k, v in options.items()}
    with load(path) as loaded, pytest.raises(TwipError) as failure:
        simulate(loaded, step_size=STEP, sinks=lambda _: pytest.fail("a log was opened"), **options)
    assert str(failure.value) == problem.format(folder)


TWIP = "import sys\nfrom twip.cli import main\nsys.exit(main())"


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


@pytest.mark.parametrize("loop_after", ["compiled", "python"])
def test_the_robot_with_noise_goes_on_bit_for_bit(built, tmp_path, loop_after):
    path, file = built / "ssp" / "twip.ssp", tmp_path / "robot.checkpoint"

    def run_robot(stop_time, **options):
        with load(path, start_values={"imu.noise": True}) as loaded:
            table = Table(loaded.channels)
            simulate(loaded, sinks=[table], stop_time=stop_time, **options)
        return table

    whole = run_robot(3.0, loop="compiled")
    assert whole["imu.gyro"].std() > 0.0
    first = run_robot(2.0, loop="compiled", checkpoint=file)
    rest = run_robot(3.0, loop=loop_after, resume=file)
    assert first.values.tobytes() == whole.values[:2001].tobytes()
    assert rest.values.tobytes() == whole.values[2000:].tobytes()
    assert rest.times.tobytes() == whole.times[2000:].tobytes()
