"""What the commands print for scripts, and what a terminal shows while they run."""

import json
import subprocess
import sys
from math import inf, nan
from pathlib import Path

import pytest
from rich.progress import Progress

from twip.cli import main
from twip.commands.parts.progress import RateColumn, progress_bar
from twip.commands.parts.terminal import print_json
from twip.cosim.log.playback import read
from twip.lab.metrics import judge


def test_numbers_that_are_not_finite_become_null(capsys):
    print_json({"a": inf, "b": nan, "c": (1.5, True, None, "ä"), "d": Path("x"), "e": {"f": 2}})
    assert json.loads(capsys.readouterr().out) == {
        "a": None, "b": None, "c": [1.5, True, None, "ä"], "d": "x", "e": {"f": 2}
    }  # fmt: skip


def test_a_run_tells_a_script_what_it_did(built, tmp_path, capsys):
    log = tmp_path / "bench.mcap"
    words = ["run", str(built / "ssp" / "bench.ssp"), "--stop-time", "0.1", "--loop", "python", "--log", str(log)]
    assert main([*words, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["time"] == 0.1
    assert told["steps"] * told["step_size"] == 0.1
    assert told["interrupted"] is False
    assert told["log"] == str(log)
    assert told["go_on_by"] is None
    assert "bench.voltage" in told["values"]
    assert told["verdict"] is told["balanced"] is told["metrics"] is None  # the bench is not the robot
    assert main(["report", str(log), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert set(told) == {"report", "bytes", "logs", "metrics"}
    assert told["report"] == str(log.with_suffix(".html"))
    assert told["metrics"] == {str(log): None}
    assert told["logs"][str(log)]["rows"] == 101
    assert Path(told["report"]).stat().st_size == told["bytes"]


@pytest.mark.parametrize(
    ("options", "verdict", "balanced"),
    [
        (["--stop-time", "5"], "balanced: |pitch| < 1° from 3 s after release on", True),
        (["--stop-time", "5", "--start-values", "plant.body_mass", "7"], "fell at ", False),
        (["--stop-time", "2"], "ended 1 s after release, too early to tell", None),
    ],
)
def test_a_run_of_the_robot_ends_with_the_verdict(built, tmp_path, capsys, options, verdict, balanced):
    log = tmp_path / "twip.mcap"
    words = ["run", str(built / "ssp" / "twip.ssp"), *options, "--log", str(log)]
    assert main(words) == 0
    label, _, sentence = capsys.readouterr().out.splitlines()[-1].partition(" ")
    assert label == "verdict"
    assert sentence.strip().startswith(verdict)
    assert sentence.strip() == judge(read(log)).sentence()
    assert main([*words, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["verdict"], told["balanced"]) == (sentence.strip(), balanced)
    assert main(["report", str(log), "--json"]) == 0
    reported = json.loads(capsys.readouterr().out)["metrics"][str(log)]
    expected = {name: reported[name] for name in told["metrics"]}
    assert told["metrics"] == pytest.approx(expected, abs=1e-9)  # the log counts nanoseconds
    if balanced is False:
        standing = ("steady_state_error", "peak_pitch_settled", "pitch_overshoot", "settling_time", "estimator_error")
        assert [reported[name] for name in standing] == [None] * 5
        assert reported["fallen_at"] > 1.0
        text = log.with_suffix(".html").read_text(encoding="utf-8")
        assert "<th scope=row>overshoot</th><td>–</td>" in text


def test_the_bench_run_prints_no_verdict(built, tmp_path, capsys):
    assert main(["run", str(built / "ssp" / "bench.ssp"), "--stop-time", "0.1", "--no-log"]) == 0
    assert "verdict" not in capsys.readouterr().out


def test_the_command_that_runs_loads_no_library_for_pictures_or_statistics():
    code = "import sys, twip.commands.run; print([m for m in ('scipy', 'matplotlib', 'PIL') if m in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"


def test_the_bar_tells_the_rate_and_is_silent_without_a_terminal(capsys):
    with progress_bar("run", 10.0, "s") as update:
        update(5.0)
    assert capsys.readouterr().err == ""
    now = iter(range(100))
    with Progress(get_time=lambda: float(next(now)), disable=not sys.stdout.isatty()) as progress:
        task = progress.add_task("run", total=100.0)
        for done in (20.0, 40.0, 60.0):
            progress.update(task, completed=done)
    (shown,) = progress.tasks
    assert shown.speed
    assert RateColumn("s").render(shown).plain == f"{shown.speed:.1f}× real time"
    assert RateColumn("runs").render(shown).plain.endswith(" runs/s")
