"""What the commands print for scripts, and what a terminal shows while they run."""

import json
import sys
from math import inf, nan
from pathlib import Path

from rich.progress import Progress

from twip.cli import main
from twip.commands.progress import RateColumn, progress_bar
from twip.commands.terminal import print_json


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
    assert main(["report", str(log), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert set(told) == {"report", "bytes", "logs", "metrics"}
    assert told["report"] == str(log.with_suffix(".html"))
    assert told["metrics"] == {str(log): None}
    assert told["logs"][str(log)]["rows"] == 101
    assert Path(told["report"]).stat().st_size == told["bytes"]


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
