"""The robot of native FMUs, wired or as one FMU, is the robot of Python FMUs bit for bit."""

import ctypes
import hashlib
import re
import shutil
import subprocess
import zipfile

import fmi3_host
import fmi_host
import fmpy
import fmpy.validation
import numpy as np
import pytest
from flat_options import grouped
from fmi_host import DISCARD, ERROR, OK

from twip.cli import main
from twip.cosim import Table, load, simulate
from twip.fmi.build import build_native
from twip.fmi.native.toolchain import this_machine
from twip.lab.container import pack
from twip.lab.native_container import pack_native

HOSTS = {"2.0": fmi_host, "3.0": fmi3_host}
PUSHED = {"plant.pitch_start": 0.3, "imu.seed": 7, "plant.push_force": 1.0}
FALLING = {"plant.pitch_start": 1.2, "controller.speed_loop": True}
STEP = 1e-3


@pytest.fixture(scope="module")
def systems(tmp_path_factory):
    """A folder with native FMUs for this machine, the systems of them, and the robot as one FMU in both versions."""
    folder = tmp_path_factory.mktemp("systems")
    build_native(folder, platforms=[this_machine()])
    with load(folder / "ssp" / "twip_native.ssp") as system:
        for version in HOSTS:
            assert pack_native(system, version, container(folder, version), platforms=[this_machine()]) == []
    return folder


def container(folder, version):
    return folder / "fmus" / ("twip_native.fmu" if version == "2.0" else "twip_native_fmi3.fmu")


@pytest.fixture
def robot(systems, tmp_path):
    """Make instances of the container in an FMI version; they are freed after the test."""
    made = []

    def make(version="2.0"):
        host = HOSTS[version]
        made.append(host.Instance(host.Fmu(container(systems, version), tmp_path / f"robot{len(made)}")))
        return made[-1]

    yield make
    for one in made:
        one.free()


def rows(ssp, values, duration, loop="python", **options):
    """Run a system and return its table."""
    with load(ssp, start_values=values) as system:
        table = Table(system.channels)
        simulate(system, stop_time=duration, sinks=[table], **grouped(loop=loop, **options))
        return {name: table[name] for name in system.columns}


def run(instance, steps, names, size=STEP):
    """Step an initialized instance and return the values of `names` at the start and after each step."""
    found = [instance.get(*names)]
    for k in range(steps):
        assert instance.step(k * size, size) == OK, instance.log
        found.append(instance.get(*names))
    return np.array(found)


def begin(instance, values):
    return instance.begin(**{name.replace(".", "__"): value for name, value in values.items()})


@pytest.mark.parametrize("values", [PUSHED, FALLING], ids=["pushed", "falling"])
def test_the_wired_robot_is_that_of_python_fmus(systems, built, values):
    native = rows(systems / "ssp" / "twip_native.ssp", values, 1.0)
    python = rows(built / "ssp" / "twip.ssp", values, 1.0)
    assert list(native) == list(python)
    assert [n for n in native if native[n].tobytes() != python[n].tobytes()] == []


def test_both_loops_run_the_native_robot_alike(systems):
    found = [rows(systems / "ssp" / "twip_native.ssp", PUSHED, 2.0, loop) for loop in ("python", "compiled")]
    assert [n for n in found[0] if found[0][n].tobytes() != found[1][n].tobytes()] == []


@pytest.mark.parametrize("version", HOSTS)
@pytest.mark.parametrize("values", [PUSHED, FALLING], ids=["pushed", "falling"])
def test_the_robot_as_one_fmu_is_the_wired_one(systems, robot, values, version):
    expected = rows(systems / "ssp" / "twip_native.ssp", values, 10.0)
    one = begin(robot(version), values)
    names = [n for n in one.fmu.of("output") if n in expected]
    assert len(names) > 60
    found = run(one, 10000, names)
    for i, name in enumerate(names):
        assert hashlib.sha256(found[:, i].tobytes()).digest() == hashlib.sha256(expected[name].tobytes()).digest(), name


def test_fmpy_simulates_a_robot_that_balances(systems):
    result = fmpy.simulate_fmu(
        str(container(systems, "2.0")), start_values={"plant.pitch_start": 0.2}, stop_time=5.0, step_size=1e-3
    )
    assert abs(result["plant.pitch"][0]) > 0.19
    assert len(result) > 100
    assert max(abs(result["plant.pitch"][result["time"] > 4.0])) < np.radians(1.0)


@pytest.mark.parametrize("version", HOSTS)
def test_larger_steps_pass_through_the_same_values(robot, version):
    fine, coarse = begin(robot(version), PUSHED), begin(robot(version), PUSHED)
    names = fine.fmu.of("output")
    assert run(fine, 300, names)[::10].tobytes() == run(coarse, 30, names, 10 * STEP).tobytes()


@pytest.mark.parametrize(
    ("time", "size", "rule"),
    [
        (0.0, 1.5e-3, "the step from 0 s by 0.0015 s: it must be a whole multiple of the step of the inside, 0.001 s"),
        (0.0, 4e-4, "the step from 0 s by 0.0004 s: it must be a whole multiple of the step of the inside, 0.001 s"),
        (0.5, 1e-3, "the step from 0.5 s by 0.001 s: it must begin where the last one ended, at 0 s"),
    ],
)
@pytest.mark.parametrize("version", HOSTS)
def test_a_step_must_fit_the_inside(robot, version, time, size, rule):
    one = begin(robot(version), {})
    assert one.step(time, size) == ERROR
    assert one.log[-1] == (ERROR, "logStatusError", rule)


@pytest.mark.parametrize("version", HOSTS)
def test_the_robots_state_goes_to_another_instance(robot, version):
    one, other = begin(robot(version), PUSHED), robot(version)
    names = one.fmu.of("output")
    run(one, 200, names)
    state = one.save()
    data = one.serialize(state)
    one.release(state)

    def on(instance):
        found = []
        for k in range(200, 400):
            assert instance.step(k * STEP, STEP) == OK, instance.log
            found.append(instance.get(*names))
        return found

    restored = other.deserialize(data)
    other.restore(restored)
    other.release(restored)
    assert on(one) == on(other)


@pytest.mark.parametrize("version", HOSTS)
def test_reset_and_another_start_time(robot, version):
    one = begin(robot(version), PUSHED)
    names = one.fmu.of("output")
    first = run(one, 50, names)
    one.check("Reset")
    begin(one, PUSHED)
    assert run(one, 50, names).tobytes() == first.tobytes()
    one.check("Reset")
    one.begin(start=100.0, plant__pitch_start=0.3)
    for k in range(50):
        assert one.step(100.0 + k * STEP, STEP) == OK, one.log


def test_rules_of_its_components_are_told_with_their_names(robot):
    one = robot()
    one.enter()
    one.set(controller__c1=0.0, plant__bump_height=0.05)
    reference, value = ctypes.c_uint(one.fmu.references["plant.body_mass"]), ctypes.c_double(-1.0)
    assert one.call("SetReal", ctypes.byref(reference), ctypes.c_size_t(1), ctypes.byref(value)) == DISCARD
    assert one.log[-1][2] == "plant.body_mass = -1 kg must be at least 0.001 kg"
    one.set(plant__body_mass=1.0)
    assert one.call("ExitInitializationMode") == ERROR
    assert [text for _, _, text in one.log[1:]] == [
        "plant: bump_height = 0.05 m over bump_length = 0.1 m: slope 1.57 must be below 1",
        "controller: c1 = 0 1/s must be positive: s1 = 0 is stable only with c1 / c2 > 0",
    ]


@pytest.mark.parametrize("version", HOSTS)
def test_nothing_is_wrong_with_it(systems, built, version, tmp_path, capsys):
    path = container(systems, version)
    assert fmpy.validation.validate_fmu(str(path)) == []
    assert main(["check", str(path)]) == 0
    assert "nothing is wrong" in capsys.readouterr().out
    ours = fmpy.read_model_description(str(path))
    with load(built / "ssp" / "twip.ssp") as system:
        pack(system, "2.0", tmp_path / "twip.fmu")
    theirs = fmpy.read_model_description(str(tmp_path / "twip.fmu"))
    assert {v.name: v.causality for v in theirs.modelVariables} == {
        v.name: v.causality for v in ours.modelVariables if v.name != "time"
    }
    assert ours.coSimulation.canGetAndSetFMUstate
    assert ours.coSimulation.canSerializeFMUstate
    assert not ours.coSimulation.needsExecutionTool


def test_the_same_system_gives_the_same_bytes(systems, tmp_path):
    with load(systems / "ssp" / "twip_native.ssp") as system:
        pack_native(system, "2.0", tmp_path / "again.fmu", platforms=[this_machine()])
    assert (tmp_path / "again.fmu").read_bytes() == container(systems, "2.0").read_bytes()


def test_it_holds_sources_that_build(systems, tmp_path):
    with zipfile.ZipFile(container(systems, "2.0")) as archive:
        archive.extractall(tmp_path)
    sources = sorted(str(p) for p in (tmp_path / "sources").glob("*.c"))
    assert len(sources) == 7
    strict = ["cc", "-std=c99", "-O1", "-Wall", "-Wextra", "-Werror", "-pedantic", "-Wno-unused-function"]
    subprocess.run([*strict, "-shared", "-fPIC", *sources, "-o", str(tmp_path / "robot.so")], check=True)


def test_another_system_by_the_command(systems, tmp_path, monkeypatch):
    """The test bench: an order and a coupling of its own, parameters and start values by the command."""
    monkeypatch.chdir(tmp_path)
    ssp = systems / "ssp" / "bench_native.ssp"
    arguments = ["container", str(ssp), "--native", "--output-file", "bench.fmu", "--start-values",
                 "bench.shaft_speed_start", "20"]  # fmt: skip
    assert main(arguments) == 0
    expected = rows(ssp, {"bench.shaft_speed_start": 20.0}, 1.0)
    one = fmi_host.Instance(fmi_host.Fmu(tmp_path / "bench.fmu", tmp_path / "unpacked")).begin()
    names = [n for n in one.fmu.of("output") if n in expected]
    found = run(one, len(expected[names[0]]) - 1, names, one.fmu.step_size)
    one.free()
    assert len(names) > 5
    assert [n for i, n in enumerate(names) if found[:, i].tobytes() != expected[n].tobytes()] == []


GYRO = '<ssd:Connection startElement="imu" startConnector="gyro" endElement="estimator" endConnector="gyro"/>'


@pytest.mark.parametrize("coupling", ["jacobi", "gauss-seidel"])
def test_couplings_and_conversions_are_the_systems(systems, tmp_path, coupling):
    """Jacobi and Gauss–Seidel, and a connection with factor and offset."""
    folder = tmp_path / "system"
    shutil.unpack_archive(systems / "ssp" / "twip_native.ssp", folder, "zip")
    ssd = folder / "SystemStructure.ssd"
    text = ssd.read_text(encoding="utf-8")
    scaled = GYRO[:-2] + '><ssc:LinearTransformation factor="0.98" offset="-0.001"/></ssd:Connection>'
    assert text.count(GYRO) == 1
    text = text.replace(GYRO, scaled).replace('coupling="gauss-seidel"', f'coupling="{coupling}"')
    if coupling == "jacobi":
        text = re.sub(r"<twip:MidStep[^>]*>", "", text)
    ssd.write_text(text, encoding="utf-8")
    with load(folder) as system:
        assert pack_native(system, "2.0", tmp_path / "robot.fmu", platforms=[this_machine()]) == []
    expected = rows(folder, PUSHED, 1.0)
    one = begin(fmi_host.Instance(fmi_host.Fmu(tmp_path / "robot.fmu", tmp_path / "unpacked")), PUSHED)
    names = [n for n in one.fmu.of("output") if n in expected]
    found = run(one, 1000, names)
    one.free()
    assert [n for i, n in enumerate(names) if found[:, i].tobytes() != expected[n].tobytes()] == []
    with zipfile.ZipFile(tmp_path / "robot.fmu") as archive:
        source = archive.read("sources/twip_system.c").decode()
    assert re.search(r"= 0\.98 \* m\[\d+\] \+ -0\.001; /\* imu\.gyro → estimator\.gyro \*/", source)


def test_what_is_no_native_fmu_is_refused(built, tmp_path, capsys):
    output = tmp_path / "robot.fmu"
    assert main(["container", str(built / "ssp" / "twip.ssp"), "--native", "--output-file", str(output)]) == 1
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 5
    assert all("holds no C of a block: a native container is made of native FMUs" in line for line in lines)
    assert not output.exists()


def test_a_coupling_it_cannot_do_is_refused(systems, tmp_path, capsys):
    folder = tmp_path / "system"
    shutil.unpack_archive(systems / "ssp" / "twip_native.ssp", folder, "zip")
    ssd = folder / "SystemStructure.ssd"
    text = ssd.read_text(encoding="utf-8")
    assert 'coupling="gauss-seidel"' in text
    text = re.sub(r"<twip:MidStep[^>]*>", "", text).replace('coupling="gauss-seidel"', 'coupling="iterated"')
    ssd.write_text(text, encoding="utf-8")
    assert main(["container", str(folder), "--native", "--output-file", str(tmp_path / "robot.fmu")]) == 1
    assert "iterated coupling: a native container steps by jacobi or gauss-seidel" in capsys.readouterr().err
