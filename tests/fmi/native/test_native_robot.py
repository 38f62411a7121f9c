"""The whole robot as one native FMU, on every machine, is the robot of Python blocks in the master."""

import json
import os
import shutil
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import fmpy
import native_robot
import pytest
from native_hosts import HERE, digest, run, web_assembly
from native_robot import SCENARIOS, bits, robot_plan, simulated

from twip.fmi.native.toolchain import this_machine

VERSIONS = ["2.0", "3.0"]


def outputs_of(unpacked, table):
    """Return the outputs of the robot that the master shows too."""
    described = fmpy.read_model_description(str(unpacked)).modelVariables
    outputs = [v.name for v in described if v.causality == "output"]
    for name in outputs:
        assert len(table[name]) > 1
    return outputs


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("scenario", ["noise and friction", "a fall"])
def test_it_runs_fifty_times_where_no_python_can_be_found(
    robots, native_systems, programs, version, scenario, tmp_path
):
    unpacked = shutil.copytree(robots(version, [this_machine()]), tmp_path / "[1] Prüfstand é #2" / "fmu")
    table = simulated(native_systems / "twip_native.ssp", scenario, "python", 0.4)
    outputs = outputs_of(unpacked, table)
    plan = robot_plan(tmp_path / "plan", unpacked, scenario, table, outputs)
    found = HERE.run(HERE.compiled(programs, version), unpacked, version, plan, tmp_path / "rows")
    assert found == bits(table, outputs)


@pytest.fixture(scope="module")
def reference(built):
    """Tables of the robot of Python FMUs in the compiled loop, by scenario."""
    return {s: simulated(built / "ssp" / "twip.ssp", s, "compiled") for s in SCENARIOS}


@pytest.fixture(scope="module")
def everywhere(robots, machines):
    """The robot for all machines by FMI version."""
    return {version: robots(version, [m.platform for m in machines.values()]) for version in VERSIONS}


@pytest.mark.foreign
def test_the_scenarios_are_what_they_say(reference):
    assert reference["a fall"]["plant.fallen"][-1] == 1.0
    assert reference["a push"]["plant.push_force"].max() == 10.0
    for name in ("noise and friction", "a push"):
        assert abs(reference[name]["plant.pitch"][-1000:]).max() < 0.1
        assert abs(reference[name]["plant.pitch"]).max() > 0.01


@pytest.mark.foreign
@pytest.mark.parametrize("scenario", SCENARIOS)
def test_ten_seconds_have_one_result(reference, everywhere, machines, programs, built, scenario, tmp_path):
    table = reference[scenario]
    outputs = outputs_of(everywhere["2.0"], table)
    expected = bits(table, outputs)
    environment = {**os.environ, "PYTHONPATH": str(Path(native_robot.__file__).parents[1])}
    command = [sys.executable, native_robot.__file__, built / "ssp" / "twip.ssp", scenario, json.dumps(outputs)]
    digests = {"numba": digest(expected)}
    with ThreadPoolExecutor(1) as pool:
        plain = pool.submit(run, [*command, tmp_path / "plain"], environment)
        for version, unpacked in everywhere.items():
            plan = robot_plan(tmp_path / "plan", unpacked, scenario, table, outputs)
            for name, machine in machines.items():
                program = machine.compiled(programs, version)
                rows = machine.run(program, unpacked, version, plan, tmp_path / "rows", 1)
                digests[f"{name}, FMI {version}"] = digest(rows)
        plan = robot_plan(tmp_path / "plan", everywhere["2.0"], scenario, table, outputs)
        digests["wasm32"] = digest(web_assembly(everywhere["2.0"], tmp_path, plan, tmp_path / "rows"))
        plain.result()
    digests["plain Python"] = digest((tmp_path / "plain").read_bytes())
    assert len(expected) == 8 * len(outputs) * 10001
    assert digests == dict.fromkeys(digests, digest(expected))
    assert len(digests) == 9
