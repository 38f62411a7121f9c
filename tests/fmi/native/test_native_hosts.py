"""Native FMUs run in a program without Python: reference runs, states, resets, fifty times over."""

import os
import shutil
import subprocess

import pytest
from fmi_blocks import BLOCKS, face_of
from native_hosts import CYCLES, HERE, reference_plan, run, token, unpack

from twip.fmi.blocks import load_block

VERSIONS = ["2.0", "3.0"]
both = pytest.mark.parametrize("version", VERSIONS)
every = pytest.mark.parametrize("block", BLOCKS)


@pytest.fixture(scope="module")
def program(programs):
    """The host for this machine by FMI version."""
    return lambda version: HERE.compiled(programs, version)


@pytest.fixture(scope="module")
def prepared(native_path, tmp_path_factory):
    """An unpacked FMU, the plan of its reference run, and the outputs it should have, by block and FMI version."""
    made = {}

    def prepare(block, version):
        if (block, version) not in made:
            folder = tmp_path_factory.mktemp("prepared")
            unpacked = unpack(native_path(block, version), folder / "fmu")
            size = load_block(face_of(block)).step_size
            made[block, version] = unpacked, folder / "plan", reference_plan(folder / "plan", unpacked, block, size)
        return made[block, version]

    return prepare


@every
@both
def test_it_runs_where_no_python_can_be_found(prepared, program, block, version, tmp_path):
    unpacked, plan, expected = prepared(block, version)
    assert HERE.run(program(version), unpacked, version, plan, tmp_path / "rows") == expected


@every
@both
@pytest.mark.parametrize("place", ["Prüfstand é", "a#b", "[1] {2} %41"])
def test_it_runs_wherever_it_is_moved(prepared, program, block, version, place, tmp_path):
    unpacked, plan, expected = prepared(block, version)
    moved = shutil.copytree(unpacked, tmp_path / place / "fmu")
    assert HERE.run(program(version), moved, version, plan, tmp_path / place / "rows") == expected


@every
@both
def test_a_state_goes_to_another_process(prepared, program, block, version, tmp_path):
    unpacked, plan, expected = prepared(block, version)
    rows = tmp_path / "rows"
    HERE.run(program(version), unpacked, version, plan, rows, 1)
    rows.unlink()
    rest = HERE.run(program(version), unpacked, version, plan, rows, 0)
    assert 0.4 < len(rest) / len(expected) < 0.51
    assert expected.endswith(rest)


@pytest.mark.skipif(os.geteuid() != 0, reason="only root may change what the root folder is")
@both
def test_it_runs_where_there_is_nothing_else(prepared, program, version, tmp_path):
    """A root folder that holds the host, its loader and the C library, and the FMU; nothing else."""
    root = tmp_path / "root"
    listed = subprocess.run(["ldd", program(version)], capture_output=True, text=True, check=True).stdout
    needed = [w for w in listed.split() if w.startswith("/")]
    assert 2 <= len(needed) <= 3, listed
    for path in needed:
        (root / path[1:]).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(path, root / path[1:])
    shutil.copy(program(version), root / "host")
    for block in BLOCKS:
        unpacked, plan, expected = prepared(block, version)
        library = shutil.copy(HERE.library(unpacked, version), root / f"{block}.so")
        shutil.copy(plan, root / "plan")
        words = [f"/{library.name}", token(unpacked), "/plan", "/rows", "/state", CYCLES]
        run([shutil.which("chroot", path=f"{os.environ['PATH']}:/usr/sbin:/sbin"), root, "/host", *words], {"PATH": ""})
        assert (root / "rows").read_bytes() == expected, block


def test_the_host_tells_what_differs(prepared, program, tmp_path):
    """It is no host that says yes to everything."""
    unpacked, plan, _ = prepared("motor", "2.0")
    other, _, _ = prepared("imu", "2.0")
    words = [HERE.library(unpacked, "2.0"), token(other), plan, tmp_path / "rows", tmp_path / "state", 1]
    done = subprocess.run([program("2.0"), *map(str, words)], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert done.stderr.splitlines() == ["host: the GUID is not that of this FMU", "host: Instantiate"]
    HERE.run(program("2.0"), unpacked, "2.0", plan, tmp_path / "rows", 1)
    state = tmp_path / "rows.state"
    state.write_bytes(state.read_bytes()[:-8])
    words[1], words[4], words[5] = token(unpacked), state, 0
    done = subprocess.run([program("2.0"), *map(str, words)], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "the state of block motor is incomplete" in done.stderr
