"""A run that is saved and goes on elsewhere is the run that never stopped, bit for bit."""

import os
import signal
import zipfile
from collections import Counter

import numpy as np
import pytest
from checkpoint_runs import STEP, describe, run
from flat_options import grouped
from ssp_writer import bind, component, system, write

from twip.cosim import Algorithm, Checkpoints, Inputs, Runtime, Table, load, simulate
from twip.cosim.fmus.component import Instance
from twip.cosim.run.checkpoint import Checkpoint, Saving
from twip.errors import TwipError


@pytest.fixture
def folder(state_folder):
    """The FMUs, able to serialize their state, and `in.csv`."""
    return state_folder


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
            loaded,
            sinks=[table],
            step_size=STEP,
            algorithm=Algorithm(coupling="gauss-seidel", mid_step=["a.u", "b.u"]),
            stop_time=2.0,
            inputs=Inputs(file=folder / "in.csv"),
            checkpoints=Checkpoints(file=file, every=max(steps, 1) * STEP),
            runtime=Runtime(loop="python"),
        )
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


@pytest.mark.parametrize("loop_after", ["compiled", "python"])
def test_the_robot_with_noise_goes_on_bit_for_bit(built, tmp_path, loop_after):
    path, file = built / "ssp" / "twip.ssp", tmp_path / "robot.checkpoint"

    def run_robot(stop_time, **options):
        with load(path, start_values={"imu.noise": True}) as loaded:
            table = Table(loaded.channels)
            simulate(loaded, sinks=[table], stop_time=stop_time, **grouped(**options))
        return table

    whole = run_robot(3.0, loop="compiled")
    assert whole["imu.gyro"].std() > 0.0
    first = run_robot(2.0, loop="compiled", checkpoint=file)
    rest = run_robot(3.0, loop=loop_after, resume=file)
    assert first.values.tobytes() == whole.values[:2001].tobytes()
    assert rest.values.tobytes() == whole.values[2000:].tobytes()
    assert rest.times.tobytes() == whole.times[2000:].tobytes()
