"""Checkpoints that do not belong to a run, are damaged, or cannot be written."""

import json
import shutil
import zipfile
from pathlib import Path

import pytest
from checkpoint_runs import INPUTS, STEP, describe, run
from flat_options import grouped
from ssp_writer import component, edit_fmu, system, write

from twip.cosim import Algorithm, Checkpoints, Inputs, load, simulate
from twip.errors import TwipError


@pytest.fixture
def folder(state_folder):
    """The FMUs, able to serialize their state, and `in.csv`."""
    return state_folder


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
        simulate(
            loaded,
            step_size=STEP,
            algorithm=Algorithm(coupling="gauss-seidel", mid_step=["a.u", "b.u"]),
            inputs=Inputs(file=folder / "in.csv"),
            checkpoints=Checkpoints(resume=file),
            sinks=lambda grid: opened.append(grid) or [],
        )
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
        simulate(loaded, step_size=STEP, sinks=lambda grid: opened.append(grid) or [], **grouped(**{option: file}))
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
        simulate(loaded, step_size=STEP, sinks=lambda _: pytest.fail("a log was opened"), **grouped(**options))
    assert str(failure.value) == problem.format(folder)
