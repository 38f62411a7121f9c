"""What a report says of logs that are cut off or go on from a checkpoint, and the texts of their messages."""

import json
import re

import numpy as np
import pytest
from robot_log import columns, pitch, robot_log, write

from twip.cli import main
from twip.cosim.log.playback import read
from twip.cosim.model.signals import Channel, Signal
from twip.cosim.sinks.mcap_log import McapLog
from twip.lab.remarks import cut_off, remarks
from twip.lab.report.messages import MOST_CHARACTERS, MOST_MESSAGES, messages_table
from twip.lab.report.page import page

HOSTILE = "<img src=x onerror=alert(1)> & so on"


def told(path, events):
    """Write a log with a row each second for 10 s and these (time, level, source, text), and return it read back."""
    times = np.arange(11.0)
    with McapLog(path, [Channel("a", (Signal("x", "Real", None, "output"),))], {}) as log:
        log.write(times, times[:, None])
        for event in events:
            log.event(*event)
    return read(path)


@pytest.fixture
def cut(tmp_path):
    """The log of a killed run, with as many whole chunks as a part of the file holds."""
    whole = robot_log(tmp_path / "whole.mcap").path.read_bytes()
    path = tmp_path / "cut.mcap"
    path.write_bytes(whole[: len(whole) // 2])
    return path


def head(text):
    return re.search(r"<header>.*?</header>", text, re.DOTALL)[0]


def test_a_log_that_is_cut_off_is_called_so_everywhere(cut, capsys):
    assert main(["report", str(cut), "--json"]) == 0
    said = capsys.readouterr()
    log = read(cut)
    last = float(log.times[-1])
    assert 0.5 < last < 3.9
    found = json.loads(said.out)["logs"][str(cut)]
    assert found["complete"] is False
    assert found["cut_off_at"] == found["last_time"] == last
    assert found["rows"] == len(log.times)
    sentence = f"the log is cut off at {last:g} s: its file ends early, later rows are missing"
    assert said.err == f"twip: warning: {cut}: {sentence}\n"
    assert sentence in head(page([log]))


def test_a_whole_log_is_complete_everywhere(tmp_path, capsys):
    log = robot_log(tmp_path / "whole.mcap")
    assert main(["report", str(log.path), "--json"]) == 0
    said = capsys.readouterr()
    found = json.loads(said.out)["logs"][str(log.path)]
    assert (found["complete"], found["cut_off_at"], found["continued"]) == (True, None, False)
    assert said.err == ""
    assert "remark" not in head(page([log]))


@pytest.mark.parametrize("words", [["plot"], ["animate", "--rate", "2"], ["report"]])
def test_every_command_that_shows_a_log_says_that_it_is_cut_off(cut, words, capsys):
    assert main([words[0], str(cut), *words[1:]]) == 0
    assert "the log is cut off at" in capsys.readouterr().err


def test_of_several_logs_the_one_is_named_that_is_cut_off(cut, tmp_path):
    found = head(page([read(tmp_path / "whole.mcap"), read(cut)]))
    assert found.count("cut off") == 1
    assert f"cut: {cut_off(read(cut))}" in found


def test_beside_a_robot_another_system_is_called_that(tmp_path):
    other = told(tmp_path / "other.mcap", [])
    assert "other: not the robot" in head(page([robot_log(tmp_path / "robot.mcap"), other]))
    assert "not the robot" not in head(page([other, other]))


def test_a_continuation_is_called_one_and_not_judged(tmp_path, capsys):
    times = 5.0 + np.arange(4001) / 1000.0
    moving = {"plant__pitch": pitch(times - 5.0), "plant__pitch_rate": np.full(4001, 0.01)}
    log = write(tmp_path / "later.mcap", columns(times, **moving), times)
    text = page([log])
    assert "not judged, for it was released before" in head(text)
    assert "continues a run from a checkpoint at 5 s" in head(text)
    assert main(["report", str(log.path), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["logs"][str(log.path)]["continued"] is True
    metrics = found["metrics"][str(log.path)]
    assert metrics["balanced"] is metrics["settling_time"] is metrics["release_time"] is None
    assert metrics["peak_voltage"] > 2.9


def test_a_settling_time_that_is_not_reached_stays_in_the_table(tmp_path):
    times = np.arange(4001) / 1000.0
    log = robot_log(tmp_path / "leaning.mcap", plant__pitch=pitch(times) + 0.1)
    text = page([log])
    assert "<th scope=row>settling time</th><td>not reached</td>" in text
    assert "fell at" not in text


def test_messages_are_shown_once_each_with_time_level_source_and_text(tmp_path):
    events = [(1.0, "info", "imu", "ready"), (2.0, "warning", HOSTILE, HOSTILE), (3.0, "info", "imu", "ready")]
    log = told(tmp_path / "log.mcap", events)
    text = page([log])
    rows = re.findall(r'<tr class="(\w+)"><td>(.*?)</td><td>(.*?)</td><td>(.*?)</td><td>(.*?)</td></tr>', text)
    escaped = "&lt;img src=x onerror=alert(1)&gt; &amp; so on"
    assert rows == [
        ("info", "1 s to 3 s, 2 times", "info", "imu", "ready"),
        ("warning", "2 s", "warning", escaped, escaped),
    ]
    assert "<img" not in text.partition("<script")[0]
    assert "2 info, 1 warning" in text


def test_of_many_messages_the_gravest_are_shown_and_the_others_counted(tmp_path):
    events = [(1.0 + i / 1000.0, "info", "a", f"number {i}") for i in range(MOST_MESSAGES + 20)]
    events += [(9.0, "warning", "a", "late warning"), (9.5, "error", "", "x" * (MOST_CHARACTERS + 7))]
    text = messages_table(["log"], [told(tmp_path / "log.mcap", events)])
    assert text.count("<tr class=") == MOST_MESSAGES + 1
    assert "late warning" in text
    assert text.index("number 97<") < text.index("late warning")
    assert "number 98<" not in text
    assert "… and 22 info more, in the log" in text
    assert f"{'x' * MOST_CHARACTERS} … and 7 more characters" in text


def test_without_messages_there_is_no_table(tmp_path):
    assert messages_table(["log"], [told(tmp_path / "log.mcap", [])]) == ""


def test_messages_of_several_logs_name_theirs(tmp_path):
    logs = [told(tmp_path / f"{name}.mcap", [(1.0, "info", "", "hello")]) for name in ("one", "two")]
    text = messages_table(["one", "two"], logs)
    assert text.index("<td>one</td>") < text.index("<td>two</td>")


def test_the_error_that_ended_a_run_is_in_the_head(tmp_path):
    failure = "left failed at t = 4.5 s: <b>doStep</b> returned error"
    log = told(tmp_path / "log.mcap", [(3.0, "error", "motor", "hot"), (4.5, "error", "", f"{failure}\nand why")])
    assert list(remarks(log)) == [f"an error ended the run at 4.5 s: {failure}"]
    assert "&lt;b&gt;doStep" in head(page([log]))


@pytest.mark.parametrize(
    ("command", "ending", "rule"),
    [
        ("view", ".txt", "must be .rrd"),
        ("view", "", "must be .rrd"),
        ("report", ".pdf", "must be one of .html, .htm"),
        ("plot", ".html", "must be one of .png, .svg, .pdf"),
        ("animate", ".mp4", "must be one of .gif, .webp, .png"),
    ],
)
def test_a_wrong_ending_is_refused_before_the_log_is_read(tmp_path, command, ending, rule, capsys):
    out = tmp_path / f"out{ending}"
    assert main([command, str(tmp_path / "missing.mcap"), "--out", str(out)]) == 1
    assert capsys.readouterr().err == f"twip: {out}: the ending {rule}\n"
