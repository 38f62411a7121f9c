"""Other people's programs take the robot: its log, and its `.ssp` as it is."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from twip.cosim import load, simulate
from twip.cosim.log import McapLog

pytestmark = pytest.mark.foreign
TIMES = (0.5, 1.2, 3.0)
"""When the pitch is compared, in s: held, standing up, balancing."""

ECOS = """
import sys, json
from ecospy import EcosSimulation
simulation = EcosSimulation(ssp_path=sys.argv[1], step_size=0.001)
simulation.init(parameter_set="nominal")  # Ecos applies parameter sets by name
pitch, done = [], 0
for time in json.loads(sys.argv[2]):
    simulation.step(round(time * 1000) - done)
    done = round(time * 1000)
    pitch.append(simulation.get_real("plant::pitch"))
simulation.terminate()
print("pitch", json.dumps(pitch), flush=True)
"""

LIBCOSIM = """
import sys, json
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimObserver import CosimObserver
execution = CosimExecution.from_ssp_file(ssp_path=sys.argv[1], step_size=1_000_000)
observer = CosimObserver.create_last_value()
execution.add_observer(observer)
index = {s.name: s.index for s in execution.slave_infos()}[b"plant"]
pitch, done = [], 0
for time in json.loads(sys.argv[2]):
    assert execution.step(step_count=round(time * 1000) - done)
    done = round(time * 1000)
    pitch.append(observer.last_real_values(slave_index=index, variable_references=[int(sys.argv[3])])[0])
print("pitch", json.dumps(pitch), flush=True)
"""


def tool(name):
    """Return a program beside this Python or on the path; the extra `foreign` brings it."""
    found = shutil.which(name, path=os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]]))
    assert found, f"{name} is missing: pip install -e '.[foreign]'"
    return found


def test_checkers_find_nothing_in_the_robots_log(built, tmp_path):
    path = tmp_path / "robot.mcap"
    with load(built / "ssp" / "twip.ssp") as system:
        simulate(system, stop_time=3.0, sinks=[McapLog(path, system.channels, system.provenance())])
    checked = subprocess.run(
        [tool("rerun"), "mcap", "check", "--full", path], capture_output=True, text=True, check=False
    )
    assert checked.returncode == 0, checked.stdout + checked.stderr
    topics = ("/left", "/right", "/plant", "/imu", "/estimator", "/controller")
    lines = [line.split() for line in checked.stdout.splitlines() if line.split()[3:4] and line.split()[3] in topics]
    assert {line[3]: line[0] for line in lines} == dict.fromkeys(topics, "ok"), checked.stdout
    command = [tool("pymcap-cli"), "doctor", "--format", "jsonl", path]
    findings = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()
    assert not [f for f in map(json.loads, findings) if f.get("severity") in ("warning", "error")]


@pytest.fixture(scope="module")
def ours(built):
    """Our pitch under Jacobi, the coupling of both other masters, at `TIMES`, and the value reference of the pitch."""
    with load(built / "ssp" / "twip.ssp") as system:
        result = simulate(system, stop_time=TIMES[-1], coupling="jacobi")
        reference = next(c for c in system.components if c.name == "plant").fmu.variables["pitch"].reference
    return [result["plant.pitch"][round(t * 1000)] for t in TIMES], reference


def run(script, *arguments):
    command = [sys.executable, "-c", script, *map(str, arguments)]
    libraries = {**os.environ, "LD_LIBRARY_PATH": str(Path(sys.prefix) / "lib")}
    result = subprocess.run(command, capture_output=True, text=True, check=False, env=libraries, timeout=300)
    assert result.returncode == 0, result.stderr[-2000:]
    return json.loads(next(line for line in result.stdout.splitlines() if line.startswith("pitch "))[6:])


def test_ecos_runs_the_ssp_as_it_is(built, ours):
    pitch = run(ECOS, built / "ssp" / "twip.ssp", json.dumps(TIMES))
    assert pitch[0] == ours[0][0] == np.radians(27.0)  # held where the file's parameters put it
    # the masters order their exchanges differently, by up to a step of delay per connection
    np.testing.assert_allclose(pitch, ours[0], atol=np.radians(1.0))


def test_libcosim_runs_the_ssp_as_it_is(built, ours, tmp_path):
    shutil.unpack_archive(built / "ssp" / "twip.ssp", tmp_path / "twip", "zip")
    pitch = run(LIBCOSIM, tmp_path / "twip", json.dumps(TIMES), ours[1])
    assert pitch[0] == ours[0][0] == np.radians(27.0)
    np.testing.assert_allclose(pitch, ours[0], atol=np.radians(1.0))
