"""The guide's example runs as printed; foreign blocks take the controller's place: plain pythonfmu's, C, FMI 3.0."""

import re
import shlex
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.validation import validate_fmu

from twip.cosim import Algorithm, Table, load, simulate
from twip.cosim.log.playback import read
from twip.fmi.build import build_fmi3

ROOT = Path(__file__).parents[1]
GUIDE = (ROOT / "docs" / "own_block.md").read_text(encoding="utf-8").partition("## A recording as a block")[0]
C_FILES = ROOT / "docs" / "own_block"
VOLTAGES = ("controller.left.voltage", "controller.right.voltage")


def blocks(language):
    """Return the guide's code blocks of a language."""
    return re.findall(rf"```{language}\n(.*?)```", GUIDE, re.DOTALL)


@pytest.fixture(scope="module")
def followed(built, tmp_path_factory):
    """The folder in which the guide's commands have been run as printed, and what its last lines print."""
    folder = tmp_path_factory.mktemp("guide")
    (folder / "ssp").symlink_to(built / "ssp")
    script, comparison = blocks("python")
    (folder / "pid.py").write_text(script, encoding="utf-8")
    (folder / "pid.toml").write_text(blocks("toml")[0], encoding="utf-8")
    (folder / "compare.py").write_text(comparison, encoding="utf-8")
    programs = {"twip": [sys.executable, "-m", "twip.cli"], "pythonfmu": [sys.executable, "-m", "pythonfmu"]}
    commands = re.findall(r"^    ((?:twip|pythonfmu) .*)$", GUIDE, re.MULTILINE)
    assert len(commands) == 4
    for program, *words in map(shlex.split, commands):
        run = subprocess.run([*programs[program], *words], cwd=folder, capture_output=True, text=True, check=False)
        assert run.returncode == 0, (words, run.stderr)
    printed = subprocess.run([sys.executable, "compare.py"], cwd=folder, capture_output=True, text=True, check=True)
    return folder, printed.stdout


def test_the_guides_example_balances_as_printed(followed):
    folder, printed = followed
    assert [line.split()[0] for line in printed.splitlines()] == ["ours.mcap", "pid.mcap"]
    for line in printed.splitlines():
        assert float(line.split()[1]) < np.radians(1.0)
    page = (folder / "compared.html").read_text(encoding="utf-8")
    for name in ("ours", "pid"):
        assert f"{name}: balanced: " in page
        assert f'"pitch, {name}"' in page
        assert f'"left, {name}"' in page
    log = read(folder / "pid.mcap")
    assert np.array_equal(log[VOLTAGES[0]], log[VOLTAGES[1]])
    assert max(log[VOLTAGES[0]]) == 12.0


def test_without_the_map_the_guides_controller_is_refused(followed):
    folder, _ = followed
    command = [sys.executable, "-m", "twip.cli", "run", "ssp/twip.ssp", "--swap", "controller=Pid.fmu", "--no-log"]
    run = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert run.returncode == 1
    assert "has no input yaw" in run.stderr


@pytest.fixture(scope="module")
def pid_in_c(tmp_path_factory):
    """The controller in C, compiled and packed as its first lines say."""
    folder = tmp_path_factory.mktemp("c")
    for file in C_FILES.iterdir():
        shutil.copyfile(file, folder / file.name)
    (folder / "binaries" / "linux64").mkdir(parents=True)
    lines = re.search(r"(cc -O2 .*?pid\.c)\n", (folder / "pid.c").read_text(encoding="utf-8"), re.DOTALL)[1]
    command = " ".join(line.strip().removesuffix("\\") for line in lines.splitlines())
    command = re.sub(r"-I\$\(.*?\)\)\"\)/c-code", f"-I{Path(fmpy.__file__).parent}/c-code", command)
    subprocess.run([*shlex.split(command), "-Wall"], cwd=folder, check=True)
    with zipfile.ZipFile(folder / "pid.fmu", "w") as archive:
        for name in ("modelDescription.xml", "binaries/linux64/pid.so"):
            archive.write(folder / name, name)
    return folder / "pid.fmu"


def test_the_controller_in_c_gives_the_bits_of_the_one_in_python(followed, pid_in_c, built, tmp_path):
    assert validate_fmu(str(pid_in_c)) == []
    folder, _ = followed
    (tmp_path / "pid.toml").write_text(blocks("toml")[0].splitlines()[0], encoding="utf-8")
    tables = []
    for fmu, terms in ((pid_in_c, tmp_path / "pid.toml"), (folder / "Pid.fmu", folder / "pid.toml")):
        swap = {"swap": {"controller": fmu}, "swap_map": {"controller": terms}}
        with load(built / "ssp" / "twip.ssp", **swap) as system:
            tables.append(Table(system.channels))
            # by Jacobi: else the loop that missing dependencies close changes the order of the components
            simulate(system, stop_time=1.5, algorithm=Algorithm(coupling="jacobi"), sinks=[tables[-1]])
    for name in (*VOLTAGES, "plant.pitch", "estimator.pitch"):
        assert np.array_equal(tables[0][name], tables[1][name]), name
    assert max(tables[0][VOLTAGES[0]]) == 12.0


def test_a_controller_in_fmi3_gives_the_same_bits(built, tmp_path):
    build_fmi3(tmp_path, ["controller"])
    tables = []
    for swap in ({}, {"controller": tmp_path / "fmus" / "controller_fmi3.fmu"}):
        with load(built / "ssp" / "twip.ssp", swap=swap) as system:
            tables.append(Table(system.channels))
            simulate(system, stop_time=1.5, sinks=[tables[-1]])
    for name in (*VOLTAGES, "plant.pitch", "controller.s1"):
        assert np.array_equal(tables[0][name], tables[1][name]), name
