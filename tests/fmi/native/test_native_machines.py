"""One result everywhere: native FMUs on Linux, Windows, 64-bit ARM and WebAssembly, and Python, plain and compiled."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from fmi_blocks import BLOCKS, face_of
from fmi_replay import replay
from native_hosts import digest, reference_plan, unpack, web_assembly

from twip.fmi.blocks import block_folders, load_block
from twip.fmi.native.package import package_native

pytestmark = pytest.mark.foreign
VERSIONS = ["2.0", "3.0"]
both = pytest.mark.parametrize("version", VERSIONS)
every = pytest.mark.parametrize("block", BLOCKS)
COMPILED = """
import sys
from pathlib import Path
from fmi_host import Fmu, Instance
from fmi_replay import kept, replay
one = Instance(Fmu(sys.argv[1], kept(Path(sys.argv[2]))))
_, _, found = replay(one, Path(sys.argv[3]))
one.free()
assert "numba" in sys.modules
Path(sys.argv[4]).write_bytes(b"".join(row[8:] for row in found))
"""


@pytest.fixture(scope="module")
def prepared(machines, tmp_path_factory):
    """A block's FMU for these machines, unpacked, and the plan of its reference run, by block and FMI version."""
    made = {}

    def prepare(block, version):
        if (block, version) not in made:
            folder = tmp_path_factory.mktemp("prepared")
            package_native(face_of(block), folder / "block.fmu", version, [m.platform for m in machines.values()])
            unpacked = unpack(folder / "block.fmu", folder / "fmu")
            size = load_block(face_of(block)).step_size
            made[block, version] = unpacked, folder / "plan", reference_plan(folder / "plan", unpacked, block, size)
        return made[block, version]

    return prepare


@every
def test_a_reference_run_has_one_result(prepared, machines, programs, instance, fmu_path, block, tmp_path):
    _, _, found = replay(instance(block), block_folders()[block])
    digests = {"plain Python": digest(b"".join(row[8:] for row in found))}
    command = [sys.executable, "-c", COMPILED, fmu_path(block), tmp_path / "kept", block_folders()[block]]
    environment = {"PYTHONPATH": str(Path(replay.__code__.co_filename).parent), "HOME": str(tmp_path)}
    subprocess.run([*map(str, command), str(tmp_path / "compiled")], env=environment, check=True)
    digests["numba"] = digest((tmp_path / "compiled").read_bytes())
    for version in VERSIONS:
        unpacked, plan, _ = prepared(block, version)
        for name, machine in machines.items():
            rows = machine.run(machine.compiled(programs, version), unpacked, version, plan, tmp_path / "rows")
            digests[f"{name}, FMI {version}"] = digest(rows)
    unpacked, plan, expected = prepared(block, "2.0")
    digests["wasm32"] = digest(web_assembly(unpacked, tmp_path, plan, tmp_path / "rows"))
    assert digests == dict.fromkeys(digests, digest(expected))
    assert len(digests) == 9


@both
@pytest.mark.parametrize("place", ["Prüfstand é", "a#b", "[1] {2} %41"])
def test_libraries_load_wherever_they_are_moved(prepared, machines, programs, version, place, tmp_path):
    unpacked, plan, expected = prepared("motor", version)
    moved = shutil.copytree(unpacked, tmp_path / place / "fmu")
    for machine in machines.values():
        rows = tmp_path / place / "rows"
        assert machine.run(machine.compiled(programs, version), moved, version, plan, rows, 2) == expected


@both
def test_a_state_goes_to_a_process_of_another_machine(prepared, machines, programs, version, tmp_path):
    """All are little-endian machines of 64 bits with one layout of the state."""
    unpacked, plan, expected = prepared("estimator", version)
    hosts = {name: machine.compiled(programs, version) for name, machine in machines.items()}
    states = set()
    for name, machine in machines.items():
        rows = tmp_path / "rows"
        machine.run(hosts[name], unpacked, version, plan, rows, 1)
        states.add(rows.with_suffix(".state").read_bytes())
        for other, elsewhere in machines.items():
            rest = elsewhere.run(hosts[other], unpacked, version, plan, rows, 0)
            assert expected.endswith(rest), (name, other)
    assert len(states) == 1


@every
@both
def test_libraries_need_nothing(prepared, machines, block, version):
    unpacked, _, _ = prepared(block, version)
    for name, machine in machines.items():
        library = machine.library(unpacked, version)
        if name == "win64":
            run = subprocess.run(
                ["x86_64-w64-mingw32-objdump", "-p", library], capture_output=True, text=True, check=True
            )
            assert set(re.findall(r"DLL Name: (\S+)", run.stdout)) <= ({"KERNEL32.dll"} if version == "3.0" else set())
        else:
            run = subprocess.run(["readelf", "-dW", "--dyn-syms", library], capture_output=True, text=True, check=True)
            assert "Dynamic section" in run.stdout
            assert "NEEDED" not in run.stdout
            assert set(re.findall(r" UND (\S+)", run.stdout)) <= ({"calloc", "free"} if version == "3.0" else set())
