"""Other people's programs take the robot's log."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from twip.cosim import load, simulate
from twip.cosim.sinks.mcap_log import McapLog

pytestmark = pytest.mark.foreign


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
