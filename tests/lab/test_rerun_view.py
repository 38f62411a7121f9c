"""The log in Rerun: every signal and pose arrives, the layout belongs to it, and what is wrong is said."""

import re
import subprocess

import pytest
from robot_log import robot_log, write

from twip.cli import main
from twip.cosim.log.playback import read
from twip.errors import TwipError
from twip.lab import rerun_view
from twip.lab.metrics import BLOCKS, REQUIRED
from twip.lab.rerun_view import Place, places, recording, rerun


def test_places_follow_the_logs_own_table(tmp_path):
    log = robot_log(tmp_path / "robot.mcap", 0.1)
    found = places(log)
    assert set(found) == {*REQUIRED, *BLOCKS}
    assert found["plant.pitch"] == Place("/plant", "twip.plant:message", "pitch")
    assert found["controller.left.voltage"] == Place("/controller", "twip.controller:message", "left_voltage")


def test_without_rerun_the_extra_is_named(tmp_path, monkeypatch, capsys):
    path = robot_log(tmp_path / "robot.mcap", 0.1).path
    monkeypatch.setattr(rerun_view.shutil, "which", lambda *_, **__: None)
    assert main(["view", str(path)]) == 1
    assert "pip install -e '.[view]'" in capsys.readouterr().err


@pytest.mark.foreign
def test_rerun_finds_every_signal_and_pose(tmp_path):
    log = robot_log(tmp_path / "robot.mcap", 2.0)
    path = recording([log], tmp_path / "robot.rrd")
    assert sorted(file.name for file in tmp_path.iterdir()) == ["robot.mcap", "robot.rrd"]
    verified = subprocess.run([rerun(), "rrd", "verify", path], capture_output=True, text=True, check=True)
    assert "verified without error" in verified.stdout + verified.stderr
    stats = subprocess.run([rerun(), "rrd", "stats", path], capture_output=True, text=True, check=True).stdout
    entities = set(re.findall(r"^(/\S+): \d+$", stats, re.MULTILINE))
    assert {f"/{name}" for name in ("plant", "left", "right", "estimator", "controller")} <= entities
    printed = subprocess.run([rerun(), "rrd", "print", "-v", path], capture_output=True, text=True, check=True).stdout
    for name in ("twip.plant:message", "twip.controller:message", "VisualizerInstruction:component_map"):
        assert name in printed, name


@pytest.mark.foreign
def test_any_system_opens_with_plots(tmp_path):
    log = robot_log(tmp_path / "robot.mcap", 0.1)
    other = write(tmp_path / "other.mcap", {"a.x": log.times, "a.y": log.times}, log.times)
    assert recording([other], tmp_path / "other.rrd").stat().st_size > 1000


@pytest.mark.foreign
def test_what_cannot_be_written_is_said(tmp_path):
    log = robot_log(tmp_path / "robot.mcap", 0.1)
    with pytest.raises(TwipError):
        recording([log], tmp_path / "robot.mcap" / "sub" / "robot.rrd")


@pytest.mark.foreign
def test_compared_robots_have_topics_frames_and_places_of_their_own(tmp_path):
    logs = [robot_log(tmp_path / "one.mcap", 0.5), robot_log(tmp_path / "two.mcap", 0.3)]
    path = recording(logs, tmp_path / "both.rrd", apart=0.5)
    stats = subprocess.run([rerun(), "rrd", "stats", path], capture_output=True, text=True, check=True).stdout
    entities = set(re.findall(r"^(/\S+): \d+$", stats, re.MULTILINE))
    for name in ("one", "two"):
        shape = f"/{name}_twip/visual_geometries/{name}_left_wheel/visual_0"
        assert {f"/{name}/plant", f"/{name}/controller", f"/{name}/tf", shape} <= entities
    printed = subprocess.run([rerun(), "rrd", "print", path], capture_output=True, text=True, check=True).stdout
    rows = [int(n) for n in re.findall(r"with (\d+) rows .* - /(?:one|two)/tf - .*Transform3D:quaternion", printed)]
    assert sum(rows) == 5 * (51 + 31)  # ground, base, body and wheels of each, 100 times a second
    assert set(re.findall(r"Recording,\n +\"(\w+)\",\n +\"(\w+)\"", printed)) == {("twip", "twip")}  # one recording


@pytest.mark.foreign
def test_a_log_that_is_cut_off_is_shown_as_far_as_it_goes(tmp_path):
    whole = robot_log(tmp_path / "whole.mcap").path.read_bytes()
    (tmp_path / "cut.mcap").write_bytes(whole[: len(whole) // 2])
    log = read(tmp_path / "cut.mcap")
    assert not log.complete
    path = recording([log], tmp_path / "cut.rrd")
    printed = subprocess.run([rerun(), "rrd", "print", path], capture_output=True, text=True, check=True).stdout
    rows = [int(n) for n in re.findall(r"with (\d+) rows .* - /plant - .*twip.plant:message", printed)]
    assert sum(rows) == len(log.times) > 500
