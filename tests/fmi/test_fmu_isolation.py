"""Each FMU runs its own code, alone or beside others, on the standard library, and leaves its host in peace."""

import gc
import importlib.util
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from fmi_blocks import OWN, OWN_BLOCKS
from fmi_host import DISCARD, OK, Fmu, Instance

from twip.fmi.blocks import PACKAGE, block_folders
from twip.fmi.build import build_blocks

HOST = Path(__file__).with_name("fmi_host.py")

NO_TWIP = """
import sys

class Refuse:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in ("twip", "numba", "scipy"):
            raise ImportError(name + " must not be imported")

sys.meta_path.insert(0, Refuse())
"""
"""A sitecustomize module."""


def alone(fmu, folder, first, steps):
    """Run an FMU in a process that has nothing but the standard library; return what it prints."""
    command = [sys.executable, "-I", "-S", HOST, fmu, folder, "run", first, steps]
    run = subprocess.run([str(c) for c in command], capture_output=True, text=True, check=True)
    return json.loads(run.stdout)


@pytest.fixture(scope="module")
def other_walker(tmp_path_factory):
    """The FMU of a walker with another generator, under the same name."""
    folder = tmp_path_factory.mktemp("other_walker")
    text = (OWN / "walker" / "walker.py").read_text(encoding="utf-8")
    assert text.count("16807.0") == 1
    (folder / "walker.py").write_text(text.replace("16807.0", "48271.0"), encoding="utf-8")
    build_blocks([(folder / "walker.py", folder / "walker.fmu")], lambda _: None)
    return folder / "walker.fmu"


def test_it_runs_on_the_standard_library_alone(fmu_path, loaded, name, tmp_path):
    result = alone(fmu_path(name), tmp_path / "alone", 0, 30)
    assert result["foreign"] == []
    assert result["log"] == []
    here = Instance(loaded(name)).begin()
    assert here.run(0, 30) == result["rows"]
    here.free()


def test_two_versions_side_by_side(fmu_path, other_walker, loaded, tmp_path):
    ours, theirs = Instance(loaded("walker")).begin(), Instance(Fmu(other_walker, tmp_path / "other")).begin()
    rows = [(ours.run(k, 1), theirs.run(k, 1)) for k in range(20)]  # in turns
    assert [r for a, _ in rows for r in a] == alone(fmu_path("walker"), tmp_path / "a", 0, 20)["rows"]
    assert [r for _, b in rows for r in b] == alone(other_walker, tmp_path / "b", 0, 20)["rows"]
    assert rows[-1][0] != rows[-1][1]
    ours.free()
    theirs.free()


def test_states_do_not_cross_versions(other_walker, loaded, tmp_path):
    ours, theirs = Instance(loaded("walker")).begin(), Instance(Fmu(other_walker, tmp_path / "other")).begin()
    state = ours.save()
    theirs.restore(state)
    assert theirs.step(0.0, 0.01) == DISCARD
    assert "was saved by another build" in theirs.log[0][2]
    ours.release(state)
    ours.free()
    theirs.free()


def test_two_versions_of_what_blocks_share_side_by_side(loaded, tmp_path):
    project = tmp_path / "project"
    for part in ("__init__.py", "errors.py", "outputs.py", "lazy.py", "platform.py", "fmi", "robot"):
        source, target = PACKAGE / part, project / "src" / "twip" / part
        if source.is_dir():
            shutil.copytree(source, target, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(source, target)
    shutil.copyfile(PACKAGE.parents[1] / "pyproject.toml", project / "pyproject.toml")
    (project / "LICENSE").write_text("MIT License\n\nCopyright (c) 1999 Somebody Else\n", encoding="utf-8")
    slave = project / "src" / "twip" / "fmi" / "slave.py"
    text = slave.read_text(encoding="utf-8")
    assert "must be finite" in text
    slave.write_text(text.replace("must be finite", "is no number"), encoding="utf-8")
    face = OWN / "walker" / "walker.py"
    command = [sys.executable, "-m", "twip.fmi.package", str(face), str(tmp_path / "walker.fmu"), "2.0"]
    subprocess.run(command, env={**os.environ, "PYTHONPATH": str(project / "src")}, check=True)
    ours, theirs = Instance(loaded("walker")).begin(), Instance(Fmu(tmp_path / "walker.fmu", tmp_path / "fmu")).begin()
    for one, words in ((ours, "pull = nan m must be finite"), (theirs, "pull = nan m is no number"), (ours, "pull")):
        one.set(pull=float("nan"))
        assert words in one.log[-1][2]
    ours.free()
    theirs.free()


def test_instances_of_one_block_do_not_share_anything(instance, name):
    first, second, third = (instance(name).begin() for _ in range(3))
    expected = third.run(0, 20)
    rows = [(first.run(k, 1)[0], second.run(k, 1)[0]) for k in range(20)]
    assert [a for a, _ in rows] == expected
    assert [b for _, b in rows] == expected


def test_the_same_fmu_unpacked_twice(fmu_path, loaded, tmp_path):
    here, there = Instance(loaded("walker")).begin(), Instance(Fmu(fmu_path("walker"), tmp_path / "twice")).begin()
    assert here.run(0, 20) == there.run(0, 20)
    here.free()
    there.free()


def living(class_name):
    return sum(type(o).__name__ == class_name for o in gc.get_objects())


def test_three_thousand_instances_come_and_go(loaded):
    fmu = loaded("walker")
    paths, before = len(sys.path), living("Walker")
    for _ in range(3000):
        one = Instance(fmu).begin()
        assert one.step(0.0, 0.01) == OK
        one.free()
    assert living("Walker") == before
    assert len(sys.path) <= paths + 1


def fmpy_run(fmu, folder, *arguments):
    """Run `fmpy simulate` where twip cannot be imported; return the finished process."""
    stub = folder / "stub"
    stub.mkdir(exist_ok=True)
    (stub / "sitecustomize.py").write_text(NO_TWIP, encoding="utf-8")
    command = [sys.executable, "-m", "fmpy", "simulate", str(fmu), "--output-file", str(folder / "out.csv"), *arguments]
    environment = {**os.environ, "PYTHONPATH": str(stub)}
    return subprocess.run(command, env=environment, cwd=folder, capture_output=True, text=True, check=False)


def input_file(name, loaded, folder):
    """The block's reference input, or one row of its first input."""
    reference = block_folders().get(name, Path("none")) / "input.csv"
    if reference.is_file():
        return reference
    inputs = loaded(name).of("input")
    path = folder / "in.csv"
    path.write_text(f'"time","{inputs[0]}"\n0.0,0.5\n' if inputs else '"time"\n0.0\n', encoding="utf-8")
    return path


def test_fmpy_runs_it_in_a_process_without_twip(fmu_path, loaded, name, tmp_path):
    plain = fmpy_run(fmu_path(name), tmp_path, "--stop-time", "0.05")
    assert (plain.returncode, plain.stderr) == (0, "")
    rows = (tmp_path / "out.csv").read_text(encoding="utf-8").splitlines()
    assert len(rows) > 2
    if loaded(name).of("input"):
        driven = fmpy_run(
            fmu_path(name), tmp_path, "--stop-time", "0.05", "--input-file", str(input_file(name, loaded, tmp_path))
        )
        assert (driven.returncode, driven.stderr) == (0, "")


def test_the_stub_would_notice_twip(fmu_path, tmp_path):
    broken = tmp_path / "broken"
    shutil.unpack_archive(fmu_path("walker"), broken, "zip")
    face = next(broken.glob("resources/_twip_*/face.py"))
    face.write_text("import twip\n" + face.read_text(encoding="utf-8"), encoding="utf-8")
    archive = shutil.make_archive(str(tmp_path / "broken"), "zip", broken)
    assert fmpy_run(archive, tmp_path).returncode != 0
    assert importlib.util.find_spec("twip") is not None


@pytest.mark.heavy
def test_none_of_a_hundred_runs_ends_badly(fmu_path, tmp_path):
    names = [*block_folders(), *OWN_BLOCKS]
    codes = [fmpy_run(fmu_path(names[k % len(names)]), tmp_path, "--stop-time", "0.02").returncode for k in range(100)]
    assert codes == [0] * 100


def test_none_of_ten_runs_ends_badly(fmu_path, tmp_path):
    assert [fmpy_run(fmu_path("walker"), tmp_path).returncode for _ in range(10)] == [0] * 10
