"""`twip sweep`: what it prints, what it draws, and that a bad sweep gets its lines before anything runs."""

import json
import os
import signal
import subprocess
import sys
import time

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from sweep_system import make_system

from twip.cli import main
from twip.cosim.log.playback import read
from twip.errors import TwipError
from twip.lab.sweep.parquet import Results
from twip.lab.sweep.pictures import draw_map

METRICS = """
def bad(table):
    raise ValueError("no\\nway")

def late(table):
    if table["d.x"][0] > 2.5:
        raise ValueError("too far")
    return {"first": table["d.x"][0], "rows": len(table.times)}
"""


@pytest.fixture(scope="module")
def system(tmp_path_factory):
    path = make_system(tmp_path_factory.mktemp("decay"))
    (path.parent / "mine.py").write_text(METRICS, encoding="utf-8")
    return path


@pytest.fixture
def folder(system, tmp_path, monkeypatch):
    """A working folder beside which the system lies."""
    monkeypatch.chdir(tmp_path)
    for file in system.parent.iterdir():
        os.symlink(file, tmp_path / file.name)
    return tmp_path


USUAL = ["--step-size", "0.25", "--metric", "final:d.x", "--jobs", "1"]


def sweep(*words):
    return main(["sweep", "decay.ssd", *words])


def test_a_sweep_with_pictures_and_logs_of_the_worst_runs(folder, capsys):
    words = [
        "--vary",
        "d.x_start=1:4:4",
        "d.rate=x0.5,1,2",
        "--success",
        "final:d.x < 1",
        "--keep",
        "worst:2:final:d.x",
    ]
    pictures = ["--map", "d.x_start", "d.rate", "--rate", "d.x_start", "d.rate", "--sensitivity", "final:d.x"]
    assert sweep(*words, *pictures, *USUAL) == 0
    told = capsys.readouterr().out
    assert "passed              7 of 12: 58.3% (32.0% to 80.7%)" in told
    assert {p.name for p in (folder / "logs").iterdir()} == {
        *("decay.parquet", "decay-runs", "decay-map.png", "decay-rate.png", "decay-sensitivity.png"),
    }
    logs = sorted((folder / "logs" / "decay-runs").iterdir())
    results = Results.read(folder / "logs" / "decay.parquet")
    assert [log.name for log in logs] == ["run-06.mcap", "run-09.mcap"]  # the slowest decay from 3 and 4
    assert read(logs[1])["d.x"][-1] == results.columns["final:d.x"][9]
    assert main(["sweep", "logs/decay.parquet", "--map", "d.x_start", "d.rate", "final:d.x"]) == 0
    with pytest.raises(TwipError, match=r"d\.z does not vary; there are d\.x_start, d\.rate"):
        draw_map(results, "d.x_start", "d.z", "success", folder / "x.png")


def test_a_metric_that_raises_later_is_a_failed_row(folder):
    assert sweep("--vary", "d.x_start=1,2,3", "--metric", "mine.py:late", "--step-size", "0.25", "--jobs", "1") == 0
    columns = Results.read(folder / "logs" / "decay.parquet").columns
    assert columns["verdict"] == ["done", "done", "error"]
    assert columns["error"][2] == "metric mine.py:late raises ValueError: too far"  # without the machine's folders
    assert (columns["first"], columns["rows"]) == ([1.0, 2.0, None], [5.0, 5.0, None])


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--vary", "d.rat=1,2"], "unknown parameter d.rat, did you mean d.rate? (start values)"),
        (["--vary", "d.rate"], "--vary d.rate: must be NAME=VALUES"),
        (["--vary", "d.rate="], "d.rate: there are no values"),
        (["--vary", "d.rate=1:2:0"], "d.rate: '1:2:0': the grid must have at least one and at most 1000000 values"),
        (["--vary", "d.rate=1,x"], "rate = 'x' must be a finite Real number (component d, start values)"),
        (["--vary", "d.rate=1,2", "d.rate=3"], "axis d.rate is there twice\nvariable d.rate is there twice"),
        (["--vary", "d.rate=norm(1, 1)"], "d.rate has a distribution: how many samples?"),
        (["--vary", "d.rate=1,2", "--samples", "3"], "samples of what? There is no distribution"),
        (["--vary", "d.fault=x1,2"], "d.fault is String and cannot be multiplied"),
        (["--vary", "d.rate=1,2", "--start-values", "d.rate", "1"], "d.rate is given a start value and varies too"),
        (
            ["--parameter-sets", "a"],
            "--parameter-sets a: must be LABEL=FILE.ssv, or LABEL= for the system as it stands",
        ),
        (["--parameter-sets", "a=", "b=none.ssv"], "none.ssv: No such file or directory"),
        ([], "nothing varies: a sweep needs an axis, parameter sets or repetitions"),
        (["--repeat", "2", "--keep", "best"], "'best' must be worst:COUNT, worst:COUNT:METRIC or runs:NUMBER,NUMBER,…"),
        (["--repeat", "2", "--jobs", "0"], "jobs = 0 must be at least 1"),
        (["--repeat", "2", "--metric", "mine.py:bad"], "mine.py:bad raises ValueError: no way (run 0)"),
        (
            ["--repeat", "2", "--success", "x < 1"],
            "condition on x: there is no such metric; there are final:d.x",
        ),
    ],
)
def test_a_bad_sweep_gets_its_lines_and_writes_nothing(folder, capsys, words, message):
    usual = [w for w in USUAL if w not in words]
    usual = usual[:2] if "--metric" in words else USUAL[:4] if "--jobs" in words else USUAL
    assert sweep(*words, *usual) == 1
    told = capsys.readouterr().err
    lines = [line.removeprefix("twip: ") for line in told.splitlines() if "trying" not in line]
    assert len(lines) == len(message.splitlines())
    assert all(line.endswith(part) for line, part in zip(lines, message.splitlines(), strict=True)), told
    assert not (folder / "logs").exists() or not list((folder / "logs").iterdir())


def test_an_unreachable_scheduler_gets_one_line(folder, capsys, monkeypatch):
    monkeypatch.setattr("twip.lab.sweep.engine._CONNECT", 1)
    assert sweep("--repeat", "2", "--dask", "tcp://127.0.0.1:9", *USUAL) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("twip: the Dask scheduler tcp://127.0.0.1:9 cannot be reached: Timed out")


def test_what_is_no_result_of_a_sweep_gets_one_line(folder, capsys, monkeypatch):
    (folder / "x.parquet").write_bytes(b"PAR1 and then nothing")
    pq.write_table(pa.table({"run": [1]}), folder / "y.parquet")
    bare = pa.table({"run": [1], "verdict": ["done"]}).replace_schema_metadata(
        {"twip": '{"sweep": {"axes": [3]}, "runs": 1}'}
    )
    pq.write_table(bare, folder / "z.parquet")
    for name in ("x", "y", "z"):
        assert main(["sweep", f"{name}.parquet", "--rate", "d.x"]) == 1
        assert capsys.readouterr().err == f"twip: {name}.parquet is not the Parquet file of a sweep\n"
    assert main(["sweep", "none.parquet", "--rate", "d.x"]) == 1
    assert capsys.readouterr().err == "twip: none.parquet: no such file\n"
    assert main(["sweep", "x.parquet", "--repeat", "3"]) == 1
    assert capsys.readouterr().err == "twip: --repeat: x.parquet is there already: it is only drawn\n"
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    assert sweep("--repeat", "3", *USUAL) == 1
    assert "pip install -e '.[sweep]'" in capsys.readouterr().err


def test_ctrl_c_says_how_to_go_on(folder):
    words = [sys.executable, "-m", "twip.cli", "sweep", "decay.ssd", "--vary", "d.x_start=1:200:200", *USUAL]
    words += ["--start-values", "d.fault", "slow"]
    process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    journal = folder / "logs" / "decay.parquet.runs"
    deadline = time.monotonic() + 60
    while not (journal.exists() and journal.read_text().count("\n") > 3):
        assert time.monotonic() < deadline
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    out, _ = process.communicate(timeout=30)
    assert process.returncode == 130
    assert out.splitlines()[-1].endswith("--start-values d.fault slow --resume")
    kept = Results.read(folder / "logs" / "decay.parquet").columns["run"]
    assert 3 <= len(kept) < 200


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--map", "d.rate"], "--map takes two axes and perhaps a metric"),
        (
            ["--map", "d.rat", "d.rate", "final:d.x"],
            "--map: d.rat does not vary; there are d.rate, d.x_start",
        ),
        (["--map", "d.rate", "d.rate", "final:d.x"], "--map: d.rate, d.rate: an axis is named twice"),
        (["--map", "d.rate", "d.x_start"], "--map: the sweep has no conditions, so no run passes or fails"),
        (
            ["--map", "d.rate", "d.x_start", "final:x"],
            "--map: the sweep has no metric final:x, did you mean final:d.x?",
        ),
        (["--rate", "d.rate"], "--rate: the sweep has no conditions, so no run passes or fails"),
        (["--sensitivity", "final:d.x"], "--sensitivity: ranking needs 8 runs, and there are 4"),
        (["--keep", "runs:0,4"], "--keep: there is no run 4: the runs are 0 to 3"),
        (["--keep", "worst:1:n"], "--keep: there is no metric n to tell the worst runs by; there are final:d.x"),
        (["--out", "x.csv"], "x.csv: the ending must be .parquet"),
        (
            ["--map", "a", "d.rate", "m", "--keep", "runs:7"],
            "--map: a does not vary; there are d.rate, d.x_start\n"
            "--map: the sweep has no metric m; there are final:d.x, success\n"
            "--keep: there is no run 7: the runs are 0 to 3",
        ),
    ],
)
def test_what_a_sweep_cannot_answer_is_told_before_its_first_run(folder, capsys, words, message):
    assert sweep("--vary", "d.rate=1,2", "d.x_start=1,2", *words, *USUAL) == 1
    said = capsys.readouterr()
    assert said.err.splitlines() == [f"twip: {line}" for line in message.splitlines()]  # no "trying the first run"
    assert said.out == ""
    assert not (folder / "logs").exists()


def test_names_that_a_function_tells_are_checked_when_one_run_has_told_them(folder, capsys):
    varied = ["--vary", "d.x_start=1,2", "d.rate=1,2", "--metric", "mine.py:late", "--step-size", "0.25", "--jobs", "1"]
    assert sweep(*varied, "--map", "d.x_start", "d.rate", "frist", "--keep", "worst:1:second") == 1
    assert capsys.readouterr().err.splitlines()[1:] == [
        "twip: --map: the sweep has no metric frist, did you mean first?",
        "twip: --keep: there is no metric second to tell the worst runs by; there are first, rows",
    ]
    assert not list((folder / "logs").iterdir())
    assert sweep(*varied, "--map", "d.x_start", "d.rate", "first", "--keep", "worst:1:first") == 0


def test_what_only_the_runs_tell_keeps_no_other_picture_from_being_drawn(folder, capsys):
    words = ["--vary", "d.x_start=1:2:4", "d.rate=1,2", "--success", "final:d.x < 9", *USUAL]
    assert sweep(*words, "--sensitivity", "success", "--rate", "d.rate") == 1
    said = capsys.readouterr()
    assert said.err.endswith("twip: --sensitivity: success is 1 in every run: it depends on nothing\n")
    assert (folder / "logs" / "decay-rate.png").exists()


def test_a_script_gets_one_object(folder, capsys):
    words = ["--vary", "d.x_start=1:4:4", "d.rate=x0.5,1,2", "--success", "final:d.x < 1", "--keep", "worst:1", *USUAL]
    assert sweep(*words, "--map", "d.x_start", "d.rate", "--sensitivity", "final:d.x", "--json") == 0
    (line,) = capsys.readouterr().out.splitlines()
    told = json.loads(line)
    assert {name: told[name] for name in ("runs", "finished", "done_now", "passed", "failed", "errors")} == {
        "runs": 12, "finished": 12, "done_now": 12, "passed": 7, "failed": 5, "errors": 0
    }  # fmt: skip
    assert told["pass_rate"] == 7 / 12
    assert told["pass_rate_interval"] == pytest.approx([0.320, 0.807], abs=5e-4)  # Wilson, as printed without --json
    assert told["results"] == "logs/decay.parquet"
    assert told["pictures"] == {"map": "logs/decay-map.png", "sensitivity": "logs/decay-sensitivity.png"}
    assert told["logs"] == ["logs/decay-runs/run-09.mcap"]
    assert told["interrupted"] is False
    assert len(told["sensitivity"]) == 3
    assert main(["sweep", "logs/decay.parquet", "--rate", "d.rate", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told == {"results": "logs/decay.parquet", "pictures": {"rate": "logs/decay-rate.png"}, "sensitivity": None}


def test_a_run_that_fails_has_not_passed(folder, capsys):
    words = ["--vary", "d.x_start=1,2,3", "--metric", "mine.py:late", "--success", "first < 9", "--step-size", "0.25"]
    assert sweep(*words, "--jobs", "1", "--json") == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["passed"], told["errors"], told["pass_rate"]) == (2, 1, 2 / 3)


def test_a_new_sweep_removes_what_the_earlier_one_left_and_nothing_else(folder):
    logs = folder / "logs"
    assert sweep("--vary", "d.x_start=1:4:11", "--keep", "runs:2,9", "--rate", "d.x_start", *USUAL,
                 "--success", "final:d.x < 1") == 0  # fmt: skip
    for mine in ("decay-notes.png", "decay-runs/run-mine.mcap", "decay-sweep.html"):
        (logs / mine).write_text("the user's")
    assert sweep("--vary", "d.x_start=1:4:2", "--keep", "runs:1", *USUAL) == 0
    left = {path.relative_to(logs).as_posix() for path in logs.rglob("*") if path.is_file()}
    assert left == {
        *("decay.parquet", "decay-notes.png", "decay-sweep.html", "decay-runs/run-1.mcap", "decay-runs/run-mine.mcap"),
    }


def test_a_condition_on_no_metric_is_told_before_the_first_run(folder, capsys):
    assert sweep("--repeat", "2", "--success", "final:d.y < 1", *USUAL) == 1
    assert capsys.readouterr().err == (
        "twip: condition on final:d.y: there is no such metric, did you mean final:d.x?\n"  # nothing was tried
    )


def test_a_log_that_is_not_kept_is_told(folder, capsys):
    words = ["--vary", "d.x_start=1,2", "--metric", "final:d.x", "--jobs", "1", "--step-size", "1e-12"]
    assert sweep(*words, "--stop-time", "4e-12", "--keep", "runs:1") == 1
    told = capsys.readouterr()
    assert "run 1: its log is not kept: log 'logs/decay-runs/run-1.mcap': step size 1e-12 s is below" in told.err
