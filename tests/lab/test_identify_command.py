"""`twip identify`: its words, its exit status, and the numbers that the documentation shows."""

import contextlib
import io
import re
import signal
from pathlib import Path

import numpy as np
import pytest
from identification_motor import Motor

from twip.cli import parser
from twip.cosim import Observer, Runtime, load, simulate
from twip.cosim.log.playback import read
from twip.errors import TwipError
from twip.lab.identification import experiments
from twip.lab.identification.campaign import different_motor, with_both_ways
from twip.lab.identification.experiments import Bench, motor_values, staircase

DOCUMENT = Path(__file__).parents[2] / "docs" / "identification.md"
MOTOR = Motor()


def twip(*words):
    arguments = parser("identify").parse_args(["identify", *map(str, words)])
    return arguments.run(arguments)


@pytest.fixture(scope="module")
def bench_csv(tmp_path_factory):
    recording = MOTOR.record(staircase().steps, 1, zero=0.0)
    path = tmp_path_factory.mktemp("data") / "bench.csv"
    rows = np.column_stack([recording.time, 1e3 * recording.current, np.round(recording.angle / recording.angle_step)])
    np.savetxt(path, rows, delimiter=",", header="t,I,enc", comments="", fmt="%.9g")
    return path


def test_own_data_give_a_table_and_both_parameter_sets(bench_csv, built, tmp_path, capsys):
    robot, bench = tmp_path / "left.ssv", tmp_path / "left_bench.ssv"
    columns = ("--current", "I:mA", "--count", "enc", "--zero", "4")
    assert twip(bench_csv, "--side", "left", *columns, "--out", robot, "--bench-out", bench) == 0
    printed = capsys.readouterr().out
    rows = {line.split()[0]: line for line in printed.splitlines() if line.startswith("left.")}
    assert len(rows) == 9
    assert rows["left.coulomb_forward"].endswith("yes")
    assert re.search(r"left\.static_forward\s+-\s+-\s+N\.m\s+no: .*slower", printed)
    assert "eq (12) estimates 1.3028e-06" in printed
    load(built / "ssp" / "twip.ssp", parameters=[robot]).close()
    load(built / "ssp" / "bench.ssp", parameters=[bench]).close()


def test_without_zero_the_reader_is_told(bench_csv, capsys):
    assert twip(bench_csv, "--side", "left", "--current", "I:mA", "--count", "enc") == 0
    assert "--zero" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ((), "no data"),
        (("data.csv",), "--side"),
        (("data.csv", "--side", "left"), "cannot be read"),
        (("data.csv", "--side", "left", "--torque-constant", "0"), "--torque-constant 0 must be positive"),
        (("data.csv", "--bench", "folder"), "either DATA or --bench"),
    ],
)
def test_mistakes_are_told_in_one_line(words, message):
    with pytest.raises(TwipError, match=message) as error:
        twip(*words)
    assert "\n" not in str(error.value)


def test_help_begins_with_examples_and_options_have_defaults(capsys):
    with pytest.raises(SystemExit):
        twip("--help")
    text = capsys.readouterr().out
    assert text.index("examples:") < text.index("Identify one motor's friction")
    for option in re.findall(r"^  (--[a-z-]+)", text, re.MULTILINE):
        if option not in ("--side", "--bench"):
            described = re.search(rf"^  {option} .*?(?=^  --|\Z)", text, re.MULTILINE | re.DOTALL)
            assert "default" in described.group(), option


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    """The folder of a whole simulated bench campaign, its output and its exit status."""
    folder = tmp_path_factory.mktemp("campaign")
    output = io.StringIO()
    with contextlib.chdir(folder), contextlib.redirect_stdout(output):
        status = twip("--bench", "logs/bench")
    return folder / "logs" / "bench", output.getvalue(), status


def test_the_circle_closes(campaign):
    """A robot unlike the nominal one, logs, blind identification, held-out run: identified beats nominal by far."""
    _, printed, status = campaign
    assert status == 0
    held = re.findall(
        r"held-out run: speed off by (\S+) rad/s rms as identified, (\S+) rad/s as nominal: better", printed
    )
    assert len(held) == 2
    for identified, nominal in held:
        assert float(identified) < 0.01 * float(nominal)


@pytest.mark.parametrize("side", ["left", "right"])
def test_what_is_identified_is_within_one_percent(campaign, side):
    truth = with_both_ways(different_motor(side, 1))
    rows = [line.split() for line in campaign[1].splitlines() if line.startswith(f"{side}.")]
    assert len(rows) == 9
    for name, number, *_ in rows:
        kind = name.partition(".")[2]
        limit = 0.05 if kind.startswith("stribeck") else 0.01  # the interval of v_s is a few percent wide
        assert float(number) == pytest.approx(truth[kind], rel=limit)


def test_the_logs_hold_truth_and_readings(campaign):
    log = read(campaign[0] / "logs" / "left_staircase.mcap")
    difference = log["sensor.current"] - log["motor.current"]
    assert np.std(difference) == pytest.approx(1e-3, rel=0.02)
    assert log["sensor.current"][:50] / 1e-4 == pytest.approx(np.round(log["sensor.current"][:50] / 1e-4), abs=1e-6)
    assert np.max(np.abs(log["sensor.encoder_count"] - log["motor.encoder_count"])) <= 1.0


def test_the_logs_are_data_for_the_command(campaign, tmp_path, capsys):
    logs = sorted((campaign[0] / "logs").glob("left_*.mcap"))
    assert len(logs) == 3
    assert twip(*logs, "--side", "left", "--zero", "4", "--out", tmp_path / "left.ssv") == 0
    number = re.search(r"left\.coulomb_forward\s+(\S+)", campaign[1]).group(1)
    assert number in capsys.readouterr().out


def test_the_robot_and_the_bench_take_the_result(campaign, built):
    load(built / "ssp" / "twip.ssp", parameters=[campaign[0] / "identified.ssv"]).close()
    load(built / "ssp" / "bench.ssp", parameters=[campaign[0] / "right_bench.ssv"]).close()


def test_the_documentation_shows_what_the_command_prints(campaign):
    shown = DOCUMENT.read_text(encoding="utf-8").split("    $ twip identify --bench logs/bench\n")[1]
    block = [line.removeprefix("    ") for line in shown.split("\n\nThe simulated robot")[0].splitlines()]
    assert [line.rstrip() for line in block] == [line.rstrip() for line in campaign[1].splitlines()]


def test_the_documentation_names_every_option():
    text = DOCUMENT.read_text(encoding="utf-8")
    command = parser("identify")._subparsers._group_actions[0].choices["identify"]
    for action in command._actions:
        if action.option_strings and action.dest != "help":
            assert action.option_strings[-1] in text, action.option_strings


def test_ctrl_c_within_an_experiment_ends_the_campaign(built, tmp_path, monkeypatch):
    def interrupted(system, **options):
        stopping = Observer(progress=lambda _: signal.raise_signal(signal.SIGINT))
        return simulate(system, **{**options, "runtime": Runtime(loop="python"), "observer": stopping})

    monkeypatch.setattr(experiments, "simulate", interrupted)
    bench = Bench(built / "ssp" / "bench.ssp", motor_values("left"))
    with pytest.raises(KeyboardInterrupt):
        bench.run(staircase(), tmp_path)
