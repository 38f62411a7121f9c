"""The command line: what it prints, its exit statuses, and one clear line for each of a user's mistakes."""

import os
import re
import shutil
import signal
import subprocess
import sys
import time
import zipfile

import numpy as np
import pytest
from lxml import etree

from twip.cli import COMMANDS
from twip.cosim.log.playback import read

SSD = "{http://ssp-standard.org/SSP1/SystemStructureDescription}"


def twip(*words, cwd, **environment):
    command = [sys.executable, "-m", "twip.cli", *map(str, words)]
    return subprocess.run(
        command, cwd=cwd, capture_output=True, text=True, timeout=200, check=False, env={**os.environ, **environment}
    )


def refused(result, *words):
    """The command failed with one clear line, that holds the words."""
    assert result.returncode not in (0, 130)
    assert "Traceback" not in result.stderr
    told = [line for line in result.stderr.splitlines() if line.startswith("twip: ")]
    lines = [line for line in told if not line.startswith("twip: compiling")]  # the first run of all
    assert len(lines) == 1, result.stderr
    for word in words:
        assert str(word) in lines[0], lines[0]


@pytest.fixture
def ssp(built, tmp_path):
    """A copy of the robot's SSP in the test's own folder."""
    return shutil.copy(built / "ssp" / "twip.ssp", tmp_path / "robot.ssp")


def test_the_demo_balances_and_says_so(tmp_path):
    result = twip("demo", cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    rows = dict(re.findall(r"^(.{19}) (.*)$", result.stdout, re.MULTILINE))
    rows = {label.strip(): text for label, text in rows.items()}
    assert rows["verdict"].startswith("balanced: |pitch| < 1° from 3 s after release on")
    assert rows["start"] == "27.0°, released at 1 s"
    assert set(rows) >= {"steady-state error", "estimator error", "peak voltage", "real-time factor", "log", "picture"}
    log = read(tmp_path / rows["log"])
    settled = np.degrees(np.abs(log["plant.pitch"][log.times >= 4.0]))
    assert settled.max() < 1.0
    assert float(rows["peak voltage"].split()[0]) == pytest.approx(
        max(np.abs(log["controller.left.voltage"]).max(), np.abs(log["controller.right.voltage"]).max()), abs=0.005
    )  # two decimals are printed
    assert (tmp_path / rows["picture"]).read_bytes().startswith(b"\x89PNG")
    assert {p.name for p in (tmp_path / "fmus").iterdir()} >= {"plant.fmu", "motor.fmu", "bench.fmu"}


def test_run_writes_log_and_csv(ssp, tmp_path):
    result = twip("run", ssp, "--stop-time", 0.5, "--output-file", "out.csv", cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    assert "simulated to        0.5 s in 500 steps of 0.001 s (gauss-seidel)" in result.stdout
    log = read(tmp_path / "logs" / "robot.mcap")
    with open(tmp_path / "out.csv", encoding="utf-8") as file:
        header = file.readline().strip().split(",")
        rows = [line.strip().split(",") for line in file]
    assert header[0] == "time"
    assert "plant.left.shaft_speed" in header
    assert "plant.push_force" not in header  # outputs only
    assert len(rows) == 501
    assert [float(row[header.index("plant.pitch")]) for row in rows] == log["plant.pitch"].tolist()
    assert "run" in log.metadata
    assert {a.name for a in log.attachments} >= {"robot.ssp"}


def test_what_a_push_does_is_seen_in_the_log(built, ssp, tmp_path):
    result = twip("run", ssp, "--input-file", built / "ssp" / "inputs" / "push.csv", cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    log = read(tmp_path / "logs" / "robot.mcap")
    assert log["plant.push_force"][log.times <= 5.0].max() == 0.0
    assert log["plant.push_force"].max() == 10.0
    pushed = np.abs(np.degrees(log["plant.pitch"]))[(log.times > 5.0) & (log.times < 6.0)].max()
    assert pushed > 2.0  # 1 N s at 0.15 m on the body: it leans
    assert log["plant.fallen"].max() == 0.0


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--step-size", "0"], ["step size 0.0 s must be a positive number"]),
        (["--step-size", "0.003", "--stop-time", "1"], ["step size 0.003 s does not divide", "1.0 s"]),
        (["--stop-time", "-1"], ["stop time -1.0 s must be later than start time 0.0 s"]),
        (
            ["--start-values", "plant.body_mas", "2"],
            ["unknown parameter plant.body_mas", "did you mean plant.body_mass"],
        ),
        (["--start-values", "plant.body_mass", "-2"], ["body_mass = -2.0 kg must be at least 0.001 kg", "plant"]),
        (["--start-values", "plant.body_mass", "nan"], ["body_mass", "nan", "finite"]),
        (["--start-values", "plant.body_mass"], ["names and values must come in pairs"]),
        (["--parameters", "none.ssv"], ["none.ssv"]),
        (["--input-file", "none.csv"], ["none.csv", "No such file"]),
        (["--log", "/proc/none/log.mcap"], ["/proc/none"]),
        (["--output-file", "/proc/none.csv"], ["/proc/none.csv"]),
    ],
)
def test_bad_options_are_one_clear_line(ssp, tmp_path, words, told):
    (tmp_path / "logs").mkdir()
    (tmp_path / "logs" / "robot.mcap").write_text("an earlier log")
    refused(twip("run", ssp, *words, cwd=tmp_path), *told)
    if "--output-file" not in words:
        assert (tmp_path / "logs" / "robot.mcap").read_text() == "an earlier log"  # nothing is lost


def test_a_bad_number_in_a_csv_names_its_line(ssp, tmp_path):
    (tmp_path / "in.csv").write_text("time,plant.push_force\n0,0\n1,nan\n")
    refused(twip("run", ssp, "--input-file", "in.csv", cwd=tmp_path), "plant.push_force", "nan", "in.csv line 3")


def test_a_connected_input_cannot_be_driven(ssp, tmp_path):
    (tmp_path / "in.csv").write_text("time,left.voltage\n0,0\n1,1\n")
    refused(twip("run", ssp, "--input-file", "in.csv", cwd=tmp_path), "left.voltage", "connected", "in.csv line 1")


@pytest.mark.parametrize("share", [0.0, 0.3, 0.999])
def test_a_truncated_ssp(ssp, tmp_path, share):
    with open(ssp, "rb") as file:
        data = file.read()
    (tmp_path / "cut.ssp").write_bytes(data[: int(share * len(data))])
    refused(twip("run", "cut.ssp", cwd=tmp_path), "cut.ssp")


def test_a_missing_ssp(tmp_path):
    refused(twip("run", "none.ssp", cwd=tmp_path), "none.ssp", "no such file")


def edited(ssp, tmp_path, change):
    """Return an unpacked copy of the SSP with a changed SSD."""
    folder = tmp_path / "edited"
    with zipfile.ZipFile(ssp) as archive:
        archive.extractall(folder)
    tree = etree.parse(folder / "SystemStructure.ssd")
    change(tree, folder)
    tree.write(folder / "SystemStructure.ssd")
    return folder


def test_a_missing_fmu(ssp, tmp_path):
    folder = edited(ssp, tmp_path, lambda _, folder: (folder / "resources" / "imu.fmu").unlink())
    refused(twip("run", folder, cwd=tmp_path), "resources/imu.fmu does not exist", "SystemStructure.ssd line")


def test_a_connection_to_nowhere(ssp, tmp_path):
    def change(tree, _):
        next(tree.iter(f"{SSD}Connection")).set("endConnector", "voltages")

    refused(twip("run", edited(ssp, tmp_path, change), cwd=tmp_path), "left.voltages", "SystemStructure.ssd line")


def test_units_that_do_not_fit(ssp, tmp_path):
    def change(tree, _):
        first = next(c for c in tree.iter(f"{SSD}Connection") if c.get("startConnector") == "drive_torque")
        first.set("endConnector", "left.stribeck_speed_limit")
        other = [c for c in tree.iter(f"{SSD}Connection") if c.get("endConnector") == "left.stribeck_speed_limit"]
        other[-1].getparent().remove(other[-1])

    told = "left.drive_torque [N.m] → plant.left.stribeck_speed_limit [rad/s]: units differ"
    refused(twip("run", edited(ssp, tmp_path, change), cwd=tmp_path), told, "SystemStructure.ssd line")


def test_an_fmu_that_fails_in_the_middle_keeps_the_log_up_to_there(ssp, tmp_path):
    """The plant takes no value that would do it, so a fault makes a torque that nothing withstands."""
    (tmp_path / "s.toml").write_text(
        '[[faults]]\nsignal = "left.drive_torque"\nkind = "bias"\nvalue = 1e306\nstart = 0.2\n'
    )
    result = twip("run", ssp, "--scenario", "s.toml", "--start-values", "plant.hold_time", "0", cwd=tmp_path)
    refused(result, "plant failed at t = 0.2", "fmi2DoStep returned discard")
    log = read(tmp_path / "logs" / "robot.mcap")
    assert log.complete
    assert 0.19 < log.times[-1] < 0.21
    assert any(event.level == "error" and "plant" in event.text for event in log.events)


@pytest.mark.parametrize(
    "words",
    [
        ["--log", "robot.ssp"],
        ["--output-file", "robot.ssp"],
        ["--checkpoint", "robot.ssp"],
        ["--input-file", "in.csv", "--output-file", "in.csv"],
        ["--parameters", "some.ssv", "--log", "some.ssv"],
        ["--log", "same", "--output-file", "same"],
        ["--log", "same", "--checkpoint", "same"],
        ["--resume", "some.checkpoint", "--log", "some.checkpoint"],
        ["--log", "link.mcap"],
    ],
    ids=" ".join,
)
def test_nothing_is_written_over_what_is_read_or_written_too(ssp, tmp_path, words):
    (tmp_path / "in.csv").write_text("time,plant.push_force\n0,0\n")
    (tmp_path / "link.mcap").symlink_to(ssp)
    assert twip("parameters", ssp, "--output-file", "some.ssv", cwd=tmp_path).returncode == 0
    made = twip("run", ssp, "--stop-time", 0.01, "--no-log", "--checkpoint", "some.checkpoint", cwd=tmp_path)
    assert made.returncode == 0
    before = {p.name: p.read_bytes() for p in tmp_path.iterdir() if p.is_file()}
    refused(twip("run", ssp, *words, cwd=tmp_path), "the command also")
    assert {p.name: p.read_bytes() for p in tmp_path.iterdir() if p.is_file()} == before


def test_parameters_are_not_written_over_the_system(ssp, tmp_path):
    refused(twip("parameters", ssp, "--output-file", ssp, cwd=tmp_path), "the command also reads it")


def test_options_that_exclude_each_other(ssp, tmp_path):
    refused(twip("run", ssp, "--log", "a.mcap", "--no-log", cwd=tmp_path), "a.mcap")
    twice = ["--start-values", "imu.seed", "1", "imu.seed", "2"]
    refused(twip("run", ssp, *twice, cwd=tmp_path), "imu.seed is given more than once")


def test_warnings_of_components_are_told(ssp, tmp_path):
    words = ["--stop-time", 0.1, "--no-log", "--start-values", "imu.sample_time", 0.0017]
    result = twip("run", ssp, *words, cwd=tmp_path)
    assert result.returncode == 0
    told = [line for line in result.stderr.splitlines() if "warning" in line]
    assert len(told) == 1
    assert "imu" in told[0]
    assert "sample_time = 0.0017 s is not a multiple of the step 0.001 s" in told[0]


def test_a_build_that_cannot_be_written_is_one_line(tmp_path):
    (tmp_path / "file").write_text("")
    refused(twip("build", "--out", "file", cwd=tmp_path), "file/fmus", "cannot be written")
    refused(twip("demo", "--out", "file", cwd=tmp_path), "file/fmus", "cannot be written")


def test_a_reader_that_has_seen_enough(ssp, tmp_path):
    command = f"{sys.executable} -m twip.cli parameters {ssp} | head -1"
    result = subprocess.run(["bash", "-c", command], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert result.stdout.startswith("left.coulomb_forward")
    assert result.stderr == ""


def test_a_terminal_without_degrees(tmp_path):
    result = twip("demo", cwd=tmp_path, PYTHONIOENCODING="ascii", PYTHONUTF8="0")
    assert result.returncode == 0, result.stderr
    assert "27.0?" in result.stdout


@pytest.mark.parametrize("delay", [0.15, 0.6, 1.5, 2.5])
@pytest.mark.parametrize("command", ["demo", "run"])
def test_ctrl_c_at_any_time_is_no_traceback(ssp, tmp_path, command, delay):
    """During the interpreter's own start it is Python that ends; afterwards it is one line or a summary."""
    words = ["run", ssp, "--stop-time", "100"] if command == "run" else ["demo"]
    environment = {**os.environ, "TWIP_CACHE": str(tmp_path / "cold")}
    process = subprocess.Popen(
        [sys.executable, "-m", "twip.cli", *map(str, words)],
        cwd=tmp_path, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    time.sleep(delay)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode in (130, -signal.SIGINT)
    if "site.py" not in errors and "runpy" not in errors:
        assert "Traceback" not in errors


def test_build_names_the_blocks_there_are(tmp_path):
    refused(twip("build", "motors", "--out", tmp_path, cwd=tmp_path), "no block motors", "motor")


def test_parameters_can_be_edited_and_given_back(ssp, tmp_path):
    assert twip("parameters", ssp, "--output-file", "all.ssv", cwd=tmp_path).returncode == 0
    text = (tmp_path / "all.ssv").read_text()
    heavier = re.sub(r'(plant\.body_mass">\s*<ssv:Real value=")2\.0', r"\g<1>2.25", text)
    assert heavier != text
    (tmp_path / "heavier.ssv").write_text(heavier)
    result = twip("run", ssp, "--parameters", "heavier.ssv", "--stop-time", 0.1, cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    log = read(tmp_path / "logs" / "robot.mcap")
    assert log.metadata["start values plant"]["body_mass"] == "2.25"


@pytest.mark.parametrize("command", [[], *([name] for name in COMMANDS)], ids=str)
def test_help_begins_with_examples(tmp_path, command):
    result = twip(*command, "--help", cwd=tmp_path)
    assert result.returncode == 0
    after = result.stdout.split("\n\n")[1]
    assert after.startswith("examples:\n  twip ")


def test_without_numba_the_results_are_the_same(ssp, tmp_path):
    """The plain loop and plain kernels: numba is hidden, and the cache is another one."""
    outputs = []
    for name, hidden in (("with", ""), ("without", "import sys; sys.modules['numba'] = None; ")):
        code = f"{hidden}from twip.cli import main; raise SystemExit(main())"
        words = ["run", str(ssp), "--stop-time", "1.5", "--no-log", "--output-file", f"{name}.csv"]
        environment = {**os.environ, "TWIP_CACHE": str(tmp_path / name)}
        command = [sys.executable, "-c", code, *words]
        result = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
        assert result.returncode == 0, result.stderr
        assert ("compiling" in result.stderr) == (name == "with")
        outputs.append((tmp_path / f"{name}.csv").read_bytes())
    assert outputs[0] == outputs[1]
