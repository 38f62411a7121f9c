"""A host that is not Python runs every FMU, in both versions of FMI, without a crash, also at its exit."""

import os
import shutil
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path

import fmpy
import pytest

from twip.commands.build import built_containers
from twip.fmi.blocks import block_folders
from twip.fmi.build import build_fmi3

SOURCE = Path(__file__).parent / "host" / "host.c"
LEAK = 5.0
"""Most that pythonfmu may leak per instance, in kB; 0.4 to 3.2 measured."""
INSTANCES = {"twip": 6}
"""How many instances an FMU makes; else one."""


def interpreters():
    """Return the environments of a C host: of this Python, and of the system's where it has its library."""
    clean = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "LD_"))}
    library = Path(sysconfig.get_config_var("LIBDIR")) / sysconfig.get_config_var("INSTSONAME")
    own = {"LD_PRELOAD": str(library), "PYTHONHOME": sys.base_prefix, "PYTHONPATH": sysconfig.get_path("purelib")}
    found = {"own": {**clean, **own}}
    system = sorted(Path("/usr/lib").glob("*-linux-gnu/libpython3.*.so.1.0"))
    if system:
        found["system"] = {**clean, "LD_PRELOAD": str(system[-1])}
    return found


INTERPRETERS = interpreters()
FMUS = [*((name, version) for name in (*block_folders(), "twip") for version in "23")]


@pytest.fixture(scope="session")
def host(tmp_path_factory):
    """The compiled host."""
    compiler = shutil.which("cc")
    assert compiler, "a C compiler is missing: apt-get install gcc"
    program = tmp_path_factory.mktemp("host") / "host"
    headers = Path(fmpy.__file__).parent / "c-code"
    command = [compiler, "-O1", "-Wall", "-Wextra", "-Werror", f"-I{headers}", "-o", program, SOURCE, "-ldl"]
    subprocess.run(command, check=True)
    return program


@pytest.fixture(scope="session")
def drive(host, built, tmp_path_factory):
    """A function that runs the host on an FMU: (block, version), interpreter, steps, cycles → finished process."""
    folder = tmp_path_factory.mktemp("hosted")
    build_fmi3(folder)
    (folder / "ssp").symlink_to(built / "ssp")
    built_containers(folder, [folder / "ssp" / "twip.ssp"])
    for name in block_folders():
        (folder / "fmus" / f"{name}.fmu").symlink_to(built / "fmus" / f"{name}.fmu")

    def run(fmu, interpreter, steps, cycles=1):
        name, version = fmu
        path = folder / "fmus" / f"{name}{'' if version == '2' else '_fmi3'}.fmu"
        unpacked = folder / path.stem
        if not unpacked.exists():
            with zipfile.ZipFile(path) as archive:
                archive.extractall(unpacked)
        description = fmpy.read_model_description(str(path))
        identifier = description.coSimulation.modelIdentifier
        library = unpacked / "binaries" / {"2": "linux64", "3": "x86_64-linux"}[version] / f"{identifier}.so"
        resources = (unpacked / "resources").as_uri() if version == "2" else f"{unpacked}/resources/"
        references = [v.valueReference for v in description.modelVariables if v.causality == "output"]
        token = description.guid or description.instantiationToken
        command = [host, version, library, token, resources, 0.001, steps, cycles, *references]
        return subprocess.run(
            list(map(str, command)), env=INTERPRETERS[interpreter], capture_output=True, text=True, check=False
        )

    return run


def values(run):
    """Return the outputs that a finished host has printed, as hexadecimal floats."""
    assert (run.returncode, run.stderr) == (0, "")
    return run.stdout.splitlines()[:-1]


@pytest.mark.parametrize("name", [*block_folders(), "twip"])
def test_every_fmu_runs_alike_in_both_versions_and_interpreters(drive, name):
    results = [values(drive((name, version), i, 30)) for version in "23" for i in INTERPRETERS]
    assert len(results[0]) > 0
    assert all(result == results[0] for result in results)


def test_the_host_steps_the_robot_as_fmpy_does(drive, built):
    found = [float.fromhex(text) for text in values(drive(("imu", "2"), "own", 30))]
    rows = fmpy.simulate_fmu(str(built / "fmus" / "imu.fmu"), stop_time=0.03, step_size=0.001, output_interval=0.001)
    assert found == list(rows[-1])[1:]


def test_instances_come_and_go(drive):
    for fmu in (("motor", "2"), ("motor", "3"), ("twip", "2")):
        grows_little(drive(fmu, "own", 2, 30), fmu, 30)


def grows_little(run, fmu, cycles):
    """Fail if memory grows by more than the known leak between a tenth of the cycles and the end."""
    values(run)
    early, late = map(int, run.stdout.splitlines()[-1].split())
    assert late - early <= LEAK * INSTANCES.get(fmu[0], 1) * cycles + 1000  # kB; the allocator's own steps


def test_without_the_preload_the_library_does_not_load(drive):
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(INTERPRETERS, "none", {k: v for k, v in INTERPRETERS["own"].items() if k != "LD_PRELOAD"})
        run = drive(("motor", "2"), "none", 1)
    assert run.returncode == 1
    assert "undefined symbol: _Py" in run.stderr or "undefined symbol: Py" in run.stderr


@pytest.mark.heavy
@pytest.mark.parametrize("interpreter", INTERPRETERS)
@pytest.mark.parametrize("fmu", FMUS, ids="-".join)
def test_none_of_fifty_runs_crashes(drive, fmu, interpreter):
    assert [drive(fmu, interpreter, 5).returncode for _ in range(50)] == [0] * 50


@pytest.mark.heavy
@pytest.mark.parametrize("fmu", FMUS, ids="-".join)
def test_two_hundred_instances_come_and_go(drive, fmu):
    grows_little(drive(fmu, "own", 2, 200), fmu, 200)
