"""A system packed as one FMU runs in fmpy as in our Jacobi loop; what cannot be packed is told."""

import csv
import pickle
import subprocess
import sys
import zipfile

import fmpy
import numpy as np
import pytest
from flat_options import grouped
from fmpy.validation import validate_fmu
from ssp_writer import bind, component, connection, edit_fmu, linear, mapping, system, write

from twip.cli import main
from twip.cosim import Table, load, simulate
from twip.cosim.fmus.description import read_fmu
from twip.cosim.reading.problems import Place, Problems
from twip.errors import TwipError
from twip.fmi.interface import FMI_VERSIONS
from twip.lab.container import pack

TAIL = '<ssd:DefaultExperiment startTime="0" stopTime="1"/>'
FMPY = """
import os, pathlib, pickle, sys
import fmpy, numpy
folder = pathlib.Path(sys.argv[1]).parent
rows = fmpy.simulate_fmu(sys.argv[1], **pickle.loads((folder / "options.pickle").read_bytes()))
numpy.save(folder / "rows.npy", rows)
os._exit(0)
"""
GAIN, INTEGRATOR, MIXED = "CosimGain.fmu", "CosimIntegrator.fmu", "CosimMixed.fmu"


def packed(ssd, version, **options):
    """Pack a system; return the FMU and what is told."""
    path = ssd.parent / f"packed{version[0]}.fmu"
    with load(ssd, **options.pop("given", {})) as loaded:
        return path, pack(loaded, version, path, **options)


def ours(ssd, step_size, stop_time=1.0, **options):
    """Our Jacobi loop's table of a system."""
    with load(ssd, **options.pop("given", {})) as loaded:
        table = Table(loaded.channels)
        simulate(
            loaded, stop_time=stop_time, step_size=step_size, sinks=[table], **grouped(coupling="jacobi", **options)
        )
    return table


def theirs(fmu, step_size, stop_time=1.0, **options):
    """What fmpy records of the container, with its whole grid.

    In a process that ends at once: plain pythonfmu's library may abort one that ends in order.
    """
    options |= {"stop_time": stop_time, "step_size": step_size, "output_interval": step_size}
    (fmu.parent / "options.pickle").write_bytes(pickle.dumps(options))
    run = subprocess.run([sys.executable, "-c", FMPY, fmu], capture_output=True, text=True, check=False)
    if run.returncode:
        raise RuntimeError(run.stderr)
    return np.load(fmu.parent / "rows.npy")


def oscillator(folder, ports="", connections=(), inside=""):
    """`x'' = -4 x` by two integrators and a gain, listed against the order of the values."""
    edit_fmu(folder / INTEGRATOR, folder / "known.fmu", dependencies={"x": []})
    return write(
        folder,
        system(
            [
                component("speed", "known.fmu", "u> x<", bind({"x_start": ("Real", 0.5)})),
                component("place", "known.fmu", "u> x<", bind({"x_start": ("Real", -1.0)})),
                component("spring", GAIN, "u> y<", bind({"k": ("Real", -4.0)})),
            ],
            [connection("spring.y -> speed.u"), connection("place.x -> spring.u"), connection("speed.x -> place.u"),
             *connections],
            ports,
            inside,
        ),
        tail=TAIL,
    )  # fmt: skip


def euler(steps, h):
    """The oscillator by explicit Euler: what it is when the gain passes its input on without delay."""
    speed, place, rows = 0.5, -1.0, [(0.5, -1.0, 4.0)]
    for _ in range(steps):
        speed, place = speed + h * (-4.0 * place), place + h * speed
        rows.append((speed, place, -4.0 * place))
    return rows


@pytest.mark.parametrize("version", FMI_VERSIONS)
def test_values_travel_once_per_step_and_through_a_gain_at_once(folder, version):
    fmu, told = packed(oscillator(folder), version, step_size=0.01)
    assert told == []
    assert validate_fmu(str(fmu)) == []
    rows = theirs(fmu, 0.01)
    assert set(rows.dtype.names) == {"time", "speed.x", "place.x", "spring.y", "spring.z"}
    assert list(zip(rows["speed.x"], rows["place.x"], rows["spring.y"], strict=True)) == euler(100, 0.01)


@pytest.mark.parametrize("version", FMI_VERSIONS)
def test_inputs_and_start_values_reach_the_components(folder, version):
    ssd = write(folder, system([component("spring", GAIN, "u> y<"), component("place", INTEGRATOR, "u> x<")],
                               [connection("spring.y -> place.u")]), tail=TAIL)  # fmt: skip
    fmu, _ = packed(ssd, version, step_size=0.01)
    signal = np.array([(0.0, 1.0), (0.5, 3.0), (1.0, -1.0)], dtype=[("time", float), ("spring.u", float)])
    with (folder / "in.csv").open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([signal.dtype.names, *signal.tolist()])
    values = {"spring.k": 7.0, "place.x_start": 2.0}
    table = ours(ssd, 0.01, given={"start_values": values}, input_file=folder / "in.csv")
    rows = theirs(fmu, 0.01, start_values=values, input=signal)
    for name in ("spring.y", "place.x"):
        # fmpy sets the input before a step to what it is then; the gain shows the newest
        assert rows[name][0] == table[name][0]
    assert (
        np.abs(rows["place.x"] - table["place.x"]).max() <= 0.01 * 7.0 * 4.0 * 0.011
    )  # one step's change of the input


def test_connectors_of_the_system_keep_their_names(folder):
    ssd = oscillator(folder, "out< in>", [connection("place.x -> out"), connection("in -> free.u")])
    text = ssd.read_text(encoding="utf-8").replace(
        "</ssd:Elements>", component("free", GAIN, "u> y<") + "</ssd:Elements>"
    )
    ssd.write_text(text, encoding="utf-8")
    fmu, _ = packed(ssd, "2.0", step_size=0.01, given={"start_values": {"in": 2.5}})
    variables = {v.name: v for v in fmpy.read_model_description(str(fmu)).modelVariables}
    assert (variables["in"].causality, variables["in"].start) == ("input", "2.5")
    assert "free.u" not in variables
    assert variables["out"].causality == "output"
    rows = theirs(fmu, 0.01)
    assert set(rows["free.y"]) == {5.0}
    assert np.array_equal(rows["out"], rows["place.x"])


def test_all_types_travel(folder):
    ssd = write(
        folder,
        system(
            [component("a", MIXED, "n>:Integer on>:Boolean total<:Integer inverted<:Boolean"),
             component("b", MIXED, "n>:Integer on>:Boolean total<:Integer inverted<:Boolean")],
            [connection("a.total -> b.n"), connection("a.inverted -> b.on")],
        ),
    )  # fmt: skip
    fmu, told = packed(ssd, "2.0", step_size=0.1)
    assert any("label is not shown: a container carries no variable of type String" in line for line in told)
    table, rows = ours(ssd, 0.1), theirs(fmu, 0.1)
    for name in ("a.total", "b.total", "a.inverted", "b.inverted", "b.seen"):
        assert np.array_equal(rows[name], table[name]), name
    # the container adds up its time, we multiply
    assert np.abs(rows["a.clock"] - table["a.clock"]).max() <= 10 * np.spacing(1.0)


def test_the_step_is_a_whole_multiple_of_the_inner_one(folder):
    fmu, _ = packed(oscillator(folder), "2.0", step_size=0.01)
    assert list(theirs(fmu, 0.05)["place.x"]) == [place for _, place, _ in euler(100, 0.01)[::5]]
    with pytest.raises(RuntimeError, match="fmi2DoStep"):
        theirs(fmu, 0.0125)


def test_the_same_system_gives_the_same_bytes(folder):
    ssd = oscillator(folder)
    contents = [packed(ssd, "2.0", step_size=0.01)[0].read_bytes() for _ in range(2)]
    assert contents[0] == contents[1]
    fmu, _ = packed(ssd, "2.0", step_size=0.02)
    tokens = {fmpy.read_model_description(str(fmu)).guid}
    fmu.write_bytes(contents[0])
    assert tokens != {fmpy.read_model_description(str(fmu)).guid}


def test_the_container_holds_everything_its_parts_hold(folder):
    fmu, _ = packed(oscillator(folder), "3.0", step_size=0.01)
    with zipfile.ZipFile(fmu) as archive, zipfile.ZipFile(folder / GAIN) as part:
        inside = [n for n in part.namelist() if not n.endswith("/")]
        for name in inside:
            assert archive.read(f"resources/CosimGain/{name}") == part.read(name)
        assert sum(n.startswith("resources/known/binaries/linux64/") for n in archive.namelist()) == 1
        assert {"documentation/licenses/fmpy.txt", "documentation/index.html"} <= set(archive.namelist())


def test_what_is_lost_is_told(folder):
    ssd = write(folder, system([component("a", GAIN, "u> y<"), component("b", GAIN, "u> z<")],
                               [connection("a.y -> b.u"), connection("b.z -> a.u")]), tail=TAIL)  # fmt: skip
    _, told = packed(ssd, "2.0", step_size=0.01)
    assert told == ["initial values that depend on each other are passed on once only: b.u, a.u"]


@pytest.mark.parametrize(
    ("connections", "values", "message"),
    [
        ([connection("a.y -> b.u", linear(2.0))], {}, "a.y → b.u: a container does not convert values"),
        (
            [connection("m.total -> k.n", mapping("Integer", {3: 7}))],
            {},
            "m.total → k.n: a container does not convert values",
        ),
        ([], {"m.label": "x"}, "m.label = x: a container cannot start it with another value than its FMU's"),
    ],
)
def test_what_a_container_cannot_do_is_refused_by_name(folder, connections, values, message):
    ssd = write(
        folder,
        system([component("a", GAIN, "u> y<"), component("b", GAIN, "u> y<"),
                component("m", MIXED, "total<:Integer"), component("k", MIXED, "n>:Integer")],
               connections),
    )  # fmt: skip
    with pytest.raises(TwipError) as refused:
        packed(ssd, "2.0", step_size=0.01, given={"start_values": values})
    assert message in str(refused.value)


def test_a_unit_means_one_thing(folder):
    for k, base in enumerate(("rad=1", "rad=1 factor=2")):
        edit_fmu(folder / GAIN, folder / f"gain{k}.fmu", variables={"u": {"unit": "turn"}}, definitions=f"turn {base}")
    ssd = write(folder, system([component("a", "gain0.fmu", "y<"), component("b", "gain1.fmu", "y<")]))
    with pytest.raises(TwipError, match=r"^unit turn of b is not that of a$"):
        packed(ssd, "2.0", step_size=0.01)


@pytest.mark.parametrize("version", FMI_VERSIONS)
def test_a_difference_stays_one(folder, version):
    about = {"unit": "K", "relativeQuantity": "true"}
    edit_fmu(folder / GAIN, folder / "gain.fmu", variables={"u": about, "y": {"unit": "K"}}, definitions="K K=1")
    path, _ = packed(write(folder, system([component("a", "gain.fmu", "u> y<")])), version, step_size=0.01)
    problems = Problems()
    fmu = read_fmu(path, path.name, problems, Place("test"))
    assert problems.lines == []
    assert {name for name, variable in fmu.variables.items() if variable.relative} == {"a.u"}


@pytest.fixture(scope="module")
def robot(built, tmp_path_factory):
    """The robot in each version of FMI, and our Jacobi loop's table of its first second and a half."""
    folder = tmp_path_factory.mktemp("robot")
    paths = {}
    for version in FMI_VERSIONS:
        paths[version] = folder / f"twip{version[0]}.fmu"
        assert main(["container", str(built / "ssp" / "twip.ssp"), "--fmi", version[0],
                     "--output-file", str(paths[version])]) == 0  # fmt: skip
    return paths, ours(built / "ssp" / "twip.ssp", 0.001, stop_time=1.5)


@pytest.mark.parametrize("version", FMI_VERSIONS)
def test_the_robot_stands_up_in_fmpy_as_in_our_loop(robot, tmp_path, version):
    paths, table = robot
    assert validate_fmu(str(paths[version])) == []
    output = tmp_path / "out.csv"
    command = [sys.executable, "-m", "fmpy", "simulate", paths[version], "--stop-time", "1.5",
               "--output-interval", "0.001", "--output-file", output]  # fmt: skip
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (run.returncode, run.stderr) == (0, "")
    with output.open(encoding="utf-8", newline="") as file:
        names, *rows = csv.reader(file)
    assert len(rows) == 1501
    assert {n.split(".")[0] for n in names[1:]} == {"left", "right", "plant", "imu", "estimator", "controller"}
    for i, name in enumerate(names[1:], start=1):
        assert [float(row[i]) for row in rows] == list(table[name]), name


def test_the_robots_container_tells_units_and_values_of_its_ssp(robot):
    description = fmpy.read_model_description(str(robot[0]["3.0"]))
    variables = {v.name: v for v in description.modelVariables}
    assert variables["plant.pitch"].unit == "rad"
    assert variables["plant.pitch"].displayUnit == "deg"
    assert float(variables["left.coulomb_forward"].start) == 7.223e-4
    assert variables["plant.push_force"].causality == "input"
    assert variables["controller.pitch_offset"].causality == "input"
    assert "estimator.gyro" not in variables
    assert {v.causality for v in variables.values()} == {"independent", "input", "output", "parameter"}


def test_the_fmpy_cli_takes_start_values_and_inputs(robot, built, tmp_path):
    output = tmp_path / "out.csv"
    command = [sys.executable, "-m", "fmpy", "simulate", robot[0]["2.0"], "--stop-time", "0.5", "--output-file", output,
               "--start-values", "plant.pitch_start", "0.1", "plant.wheels_locked", "0.0",
               "--input-file", built / "ssp" / "inputs" / "push.csv", "--output-interval", "0.001"]  # fmt: skip
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (run.returncode, run.stderr) == (0, "")
    with output.open(encoding="utf-8", newline="") as file:
        names, first, *_ = csv.reader(file)
    assert float(first[names.index("plant.pitch")]) == 0.1


def test_the_command_tells_losses_as_warnings_and_what_it_cannot_write_in_one_line(folder, capsys):
    later = '<ssd:DefaultExperiment startTime="1" stopTime="2"/>'
    ssd = write(folder, system([component("a", GAIN, "u> y<")]), tail=later)
    (folder / "file").write_text("in the folder's place")
    words = ["container", str(ssd), "--step-size", "0.01", "--output-file"]
    assert main([*words, str(folder / "a.fmu")]) == 0
    assert capsys.readouterr().err == ("twip: warning: not as in the system: the proposed start time is 0 s, not 1 s\n")
    for output, told in (
        (folder / "file" / "a.fmu", f"{folder / 'file'}: cannot be written: File exists"),
        (folder / "a", f"{folder / 'a'}: the ending must be .fmu"),
    ):
        assert main([*words, str(output)]) == 1
        assert capsys.readouterr().err == f"twip: {told}\n"
