"""The wired robot runs: its log holds what was computed, and nothing depends on how the file is written."""

import signal
import subprocess
import sys
import time

import numpy as np
from flat_options import grouped
from lxml import etree

from twip.cosim import Table, load, simulate
from twip.cosim.log.playback import read
from twip.cosim.sinks.mcap_log import McapLog

SSD = "{http://ssp-standard.org/SSP1/SystemStructureDescription}"
TWIP = [sys.executable, "-m", "twip.cli"]


def run(path, **options):
    with load(path) as system:
        table = Table(system.channels)
        result = simulate(system, sinks=[table], **grouped(**options))
    return table, result


def test_the_log_holds_every_value_that_was_computed(built, tmp_path):
    with load(built / "ssp" / "twip.ssp") as system:
        table = Table(system.channels)
        log = McapLog(tmp_path / "log.mcap", system.channels, system.provenance())
        simulate(system, stop_time=1.5, sinks=[table, log])
    found = read(tmp_path / "log.mcap")
    assert found.table().tobytes() == table.values.tobytes()
    np.testing.assert_array_equal(np.rint(found.times * 1e9), np.rint(table.times * 1e9))  # the log counts nanoseconds
    assert len(found.times) == 1501


def test_the_robot_survives_a_bad_day(built, tmp_path):
    scenario = built / "ssp" / "scenarios" / "bad_day.toml"
    log = tmp_path / "log.mcap"
    command = [*TWIP, "run", str(built / "ssp" / "twip.ssp"), "--scenario", str(scenario), "--log", str(log)]
    subprocess.run([*command, "--real-time", "20"], check=True, capture_output=True, timeout=120)
    found = read(log)
    times, arrived = found.times, found["estimator.gyro"]
    shifted = (times > 5.0) & (times <= 10.0)
    assert arrived[shifted].tolist() == (found["imu.gyro"][shifted] + 0.02).tolist()
    assert arrived[~shifted].tolist() == found["imu.gyro"][~shifted].tolist()
    lost = (times > 6.0) & (times <= 6.05)
    assert len(set(found["estimator.left.encoder_count"][lost])) == 1
    assert len(set(found["left.encoder_count"][lost])) > 1
    assert np.degrees(np.abs(found["plant.pitch"][times > 3.0])).max() < 12.0  # 9.9 degrees at the push
    assert abs(found["plant.yaw"][-1] - 0.5) < 0.02
    assert [(e.time, e.text) for e in found.events if e.level == "info"][:4] == [
        (5.0, "fault begins: imu.gyro is biased by 0.02 rad/s"),
        (6.0, "fault begins: estimator.left.encoder_count drops out"),
        (6.05, "fault ends: estimator.left.encoder_count drops out"),
        (9.0, "parameter controller.compensation = 0.5"),
    ]
    assert {a.name for a in found.attachments} >= {"bad_day.toml"}


def test_the_same_run_gives_the_same_log_to_the_byte(built, tmp_path):
    logs = []
    for name in ("a", "b"):
        with load(built / "ssp" / "twip.ssp") as system:
            log = McapLog(tmp_path / name, system.channels, system.provenance())
            simulate(system, stop_time=1.2, sinks=[log])
        logs.append((tmp_path / name).read_bytes())
    assert logs[0] == logs[1]


def test_the_order_of_components_in_the_file_changes_no_bit_under_jacobi(built, tmp_path):
    tables = []
    for turn in range(3):
        folder = tmp_path / str(turn)
        folder.mkdir()
        subprocess.run(["unzip", "-q", str(built / "ssp" / "twip.ssp"), "-d", str(folder)], check=True)
        tree = etree.parse(folder / "SystemStructure.ssd")
        elements = next(tree.iter(f"{SSD}Elements"))
        components = list(elements)
        for component in components[turn:] + components[:turn]:
            elements.append(component)
        if turn == 2:
            elements[:] = elements[::-1]
        tree.write(folder / "SystemStructure.ssd")
        tables.append(run(folder, stop_time=1.3, coupling="jacobi")[0])
    assert tables[1].columns != tables[0].columns != tables[2].columns
    for name in tables[0].columns:
        assert tables[0][name].tobytes() == tables[1][name].tobytes() == tables[2][name].tobytes(), name
    assert np.ptp(tables[0]["plant.pitch"]) > 0.1  # the robot has moved


def started(built, tmp_path, *options):
    """Start a long run of the robot and wait until its log grows."""
    log = tmp_path / "log.mcap"
    command = [*TWIP, "run", str(built / "ssp" / "twip.ssp"), "--stop-time", "600", "--log", str(log), *options]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=tmp_path)
    deadline = time.monotonic() + 120
    size = 0
    while size < 200_000:  # more than the head of the file, which holds the attachments
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < deadline
        time.sleep(0.05)
        size = log.stat().st_size - (built / "ssp" / "twip.ssp").stat().st_size if log.exists() else 0
    return process, log


def test_ctrl_c_stops_within_a_second_with_a_complete_log(built, tmp_path):
    process, log = started(built, tmp_path)
    process.send_signal(signal.SIGINT)
    begin = time.monotonic()
    out, errors = process.communicate(timeout=30)
    assert (
        time.monotonic() - begin < 1.0 + 1.0
    )  # one second to stop, one for the interpreter to leave on a busy machine
    assert process.returncode == 130
    assert "Traceback" not in errors
    assert "interrupted at" in out
    found = read(log)
    assert found.complete
    assert len(found.times) > 200


def test_a_killed_run_leaves_every_finished_chunk(built, tmp_path):
    process, log = started(built, tmp_path)
    process.kill()
    process.communicate()
    found = read(log)
    assert not found.complete
    assert len(found.times) >= 200
    assert len(found.times) % 200 <= 1  # whole chunks, and row 0
    assert np.all(np.isfinite(found["plant.pitch"]))


def test_a_batch_systems_sigterm_ends_the_run_like_ctrl_c(built, tmp_path):
    process, log = started(built, tmp_path, "--checkpoint", str(tmp_path / "state"))
    process.send_signal(signal.SIGTERM)
    out, errors = process.communicate(timeout=30)
    assert process.returncode == 128 + signal.SIGTERM, errors
    assert "interrupted at" in out
    assert read(log).complete
    assert (tmp_path / "state").is_file()


def test_two_runs_do_not_write_one_log(built, tmp_path):
    process, log = started(built, tmp_path)
    command = [*TWIP, "run", str(built / "ssp" / "twip.ssp"), "--stop-time", "1", "--log", str(log)]
    second = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert second.returncode == 1
    assert "is being written by another run" in second.stderr
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=30)
    assert read(log).complete


def test_compiled_and_plain_loops_agree_bit_for_bit_over_ten_seconds_of_noise(built):
    tables = [run(built / "ssp" / "twip.ssp", stop_time=10.0, loop=loop)[0] for loop in ("compiled", "python")]
    assert tables[0].values.shape == (10_001, len(tables[0].columns))
    assert tables[0].values.tobytes() == tables[1].values.tobytes()
    assert np.std(tables[0]["imu.gyro"][5000:]) > 1e-4  # rad/s: the noise is on
