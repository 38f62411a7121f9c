"""FMI 3.0 FMUs of another maker (pythonfmu3) among FMI 2.0 ones; iterated steps and reset instances."""

import shutil
import subprocess
import sys
from pathlib import Path

import fmpy
import numpy as np
import pytest
from echo_fmu import compiled, echo2, echo3
from flat_options import grouped
from ssp_writer import component, connection, linear, system, write

from twip.cosim import Runtime, Table, load, simulate
from twip.cosim.fmus.pool import InstancePool

BUILD = "import sys; from pythonfmu3.builder import FmuBuilder; FmuBuilder.build_FMU(sys.argv[1], dest=sys.argv[2])"
OSCILLATOR = "u> x< v< steps< up< word> said<"


@pytest.fixture(scope="module")
def oscillator(tmp_path_factory):
    folder = tmp_path_factory.mktemp("oscillator")
    shutil.copy(Path(__file__).parent / "slaves3" / "cosim_oscillator.py", folder)
    command = [sys.executable, "-c", BUILD, str(folder / "cosim_oscillator.py"), str(folder)]
    subprocess.run(command, check=True, capture_output=True, timeout=60)
    return folder / "CosimOscillator.fmu"


@pytest.fixture(scope="module")
def libraries(tmp_path_factory):
    folder = tmp_path_factory.mktemp("libraries")
    return {name: compiled(name, folder) for name in ("echo2", "echo3")}


def run(path, *, step_size, start_values=None, **options):
    with load(path, start_values=start_values or {}) as loaded:
        table = Table(loaded.channels)
        simulate(loaded, sinks=[table], step_size=step_size, **grouped(**options))
    return table


def test_an_oscillator_of_fmi_3_drives_an_integrator_of_fmi_2(folder, oscillator, loop):
    """Semi-implicit Euler turns by θ per step, cos θ = 1 - h²/2; the integrator sums h x of the steps before."""
    shutil.copy(oscillator, folder)
    parts = [component("o", oscillator.name, OSCILLATOR), component("i", "CosimIntegrator.fmu", "u> x<")]
    path = write(folder, system(parts, [connection("o.x -> i.u")]))
    h = 1 / 64
    table = run(path, step_size=h, loop=loop, stop_time=4.0, start_values={"o.word": "here", "o.gain": 0.0})
    k = np.arange(257)
    angle = np.arccos(1 - h**2 / 2)
    x = np.cos(k * angle) - h**2 / 2 / np.sin(angle) * np.sin(k * angle)
    assert np.abs(table["o.x"] - x).max() < 1e-11  # a few roundings per step
    assert np.abs(table["i.x"][1:] - h * np.cumsum(table["o.x"])[:-1]).max() < 1e-13
    assert table["o.steps"].tolist() == k.tolist()
    assert table["o.said"].tolist() == ["none", *(f"here at {i}" for i in k[1:])]
    assert np.array_equal(table["o.up"][1:] == 1.0, table["o.v"][1:] > 0.0)


def test_fmpy_moves_the_oscillator_alike(folder, oscillator, loop):
    shutil.copy(oscillator, folder)
    path = write(folder, system([component("o", oscillator.name, OSCILLATOR)]))
    table = run(path, step_size=1 / 64, loop=loop, start_values={"o.u": 0.25, "o.spring": 1.5})
    expected = fmpy.simulate_fmu(
        oscillator, stop_time=1.0, step_size=1 / 64, output_interval=1 / 64, output=["x", "v"],
        start_values={"u": 0.25, "spring": 1.5}, fmi_type="CoSimulation",
    )  # fmt: skip
    assert np.array_equal(table["o.x"], expected["x"])
    assert np.array_equal(table["o.v"], expected["v"])


def test_a_loop_of_both_versions_is_solved_by_iteration(libraries, tmp_path):
    """a = 1 - b / 2, b = a: both are 2/3 from the first step on, and each keeps its state over the repetitions."""
    echo3(tmp_path, libraries["echo3"])
    ports = "u> x< in_Float64> out_Float64<"
    parts = [component(name, "echo3.fmu", ports) for name in ("a", "b")]
    wires = [
        connection("a.out_Float64 -> b.in_Float64"),
        connection("b.out_Float64 -> a.in_Float64", linear(-0.5, 1.0)),
    ]
    path = write(tmp_path, system(parts, wires))
    table = run(path, step_size=0.125, coupling="iterated", start_values={"a.u": 1.0})
    assert np.abs(table["a.out_Float64"] - 2 / 3).max() < 1e-9
    assert np.abs(table["b.out_Float64"] - 2 / 3).max() < 1e-9
    assert table["a.x"].tolist() == table.times.tolist()


def test_reset_instances_serve_the_next_run(libraries, tmp_path, loop):
    """A text, an array and a state of the first run are gone in the second."""
    echo2(tmp_path, libraries["echo2"])
    echo3(tmp_path, libraries["echo3"])
    parts = [component("a", "echo3.fmu", "u> x<"), component("b", "echo2.fmu", "u> x<")]
    path = write(tmp_path, system(parts, [connection("b.x -> a.u")]))
    start_values = {"b.u": 2.0, "a.in_String": "text", "a.ins_Int8[2]": 7}
    with load(path, start_values=start_values) as loaded, InstancePool() as pool:
        tables = []
        for _ in range(2):
            tables.append(Table(loaded.channels))
            simulate(loaded, sinks=[tables[-1]], step_size=0.125, runtime=Runtime(loop=loop, pool=pool))
    assert tables[0].values.tobytes() == tables[1].values.tobytes()
    assert tables[1]["a.out_String"][-1] == "text"
