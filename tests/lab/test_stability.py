"""Conditions (58) and (63) on robots that differ from the controller's model, and what docs/stability.md says."""

import argparse
import math
import re
import signal
from itertools import pairwise
from operator import attrgetter
from pathlib import Path

import numpy as np
import pytest

from twip.cli import main
from twip.commands import stability as command
from twip.cosim import Observer, Runtime, simulate
from twip.lab import stability, stability_report
from twip.lab.stability import (
    BALANCE,
    DRIFTS,
    FRICTION,
    LOOPS,
    PITCH_LAW,
    RELEASE,
    Mismatch,
    Trial,
    attempt,
    disturbance,
    run,
    study,
)
from twip.lab.stability_report import smallest, tables
from twip.robot.parameters import value

PAGE = (Path(__file__).parents[2] / "docs" / "stability.md").read_text(encoding="utf-8")
DRIFT = {drift.title: drift.start_values for drift in DRIFTS}


def documented():
    """Return {(loop, mismatch): {factor: (stands from, condition met from)}} of the page's tables."""
    found = {}
    for loop, title, factors, stands, met in re.findall(
        r"^\| (\w+): (.+), × nominal \| (.+) \|\n.+\n\| stands from .+? \| (.+) \|\n\| condition met .+? \| (.+) \|$",
        PAGE, re.MULTILINE,
    ):  # fmt: skip
        rows = ([float(cell) for cell in row.split(" | ")] for row in (factors, stands, met))
        found[loop, title] = {factor: rest for factor, *rest in zip(*rows, strict=True)}
    return found


@pytest.fixture(scope="module")
def ssp(built):
    return built / "ssp" / "twip.ssp"


def test_the_page_has_all_loops_mismatches_and_epsilons():
    assert {key: tuple(rows) for key, rows in documented().items()} == {
        (loop.name, mismatch.title): mismatch.factors for loop in LOOPS for mismatch in loop.mismatches
    }
    for loop in LOOPS:
        assert ", ".join(f"{e:g}" for e in loop.epsilons) in PAGE


@pytest.mark.parametrize(
    ("loop", "mismatch"),
    [(loop, mismatch) for loop in LOOPS for mismatch in loop.mismatches],
    ids=lambda x: getattr(x, "name", None) or x.title.replace(" ", "-"),
)
def test_the_border_lies_where_the_page_says(ssp, loop, mismatch):
    """The largest factor: where it stands and meets the condition, and that it does neither one epsilon below."""
    factor = mismatch.factors[-1]
    stands, met = documented()[loop.name, mismatch.title][factor]
    below = max((e for e in loop.epsilons if e < stands), default=None)
    assert attempt(ssp, loop, mismatch, factor, stands).stands
    assert attempt(ssp, loop, mismatch, factor, met).meets()
    if below is not None:
        trial = attempt(ssp, loop, mismatch, factor, below)
        assert not trial.stands
        assert not trial.meets()


def test_an_easier_robot_stands_although_the_condition_is_not_met(ssp):
    """Half the mass: the law's surplus drives the surface home, but its magnitude is 26 rad/s2."""
    trial = attempt(ssp, BALANCE, BALANCE.mismatches[0], 0.5, 10.0)
    assert trial.stands
    assert not trial.meets()


def test_unknown_coulomb_friction_is_4_17_rad_s2(ssp):
    """(M22 + M24) n sum(T_c)/D per unit of mismatch: a closed form for Delta1.

    The larger lean it leaves makes the robot gain speed faster, which the delay of some 5 ms turns into 5 % more.
    """
    coulomb = Mismatch("", tuple(name for name in FRICTION if "viscous" not in name), ())
    means = []
    for factor in (0.75, 1.25):
        table = run(ssp, PITCH_LAW | coulomb.start_values(factor), RELEASE + 2.5)
        means.append(np.mean(disturbance(table, BALANCE, 30.0)[1000:]))
    assert means[1] - means[0] == pytest.approx(0.5 * 4.17 * 1.05, rel=0.05)


def test_a_layer_that_widens_with_epsilon_gains_nothing(ssp):
    """Twice the mass at epsilon1 = 200: stands with the nominal layer, falls with 200/10."""
    heavy = PITCH_LAW | {"plant.body_mass": 4.0, "controller.epsilon1": 200.0}
    fallen = [run(ssp, heavy | {"controller.boundary1": width}, 3.5)["plant.fallen"][-1] for width in (3.0, 20.0)]
    assert fallen == [0.0, 1.0]


def test_the_pitch_law_runs_away_until_it_falls(ssp):
    """Without compensation after 7.5 s, when the speed needs all of the 12 V."""
    table = run(ssp, DRIFT["pitch law, friction not compensated"], RELEASE + 8.0)
    fallen = np.flatnonzero(table["plant.fallen"] > 0.5)[0]
    assert table.times[fallen] - RELEASE == pytest.approx(7.5, abs=0.1)
    speed = value("wheel_radius") * table["plant.wheel_rate"]
    assert np.max(speed[:fallen]) == pytest.approx(12.0 / 0.0134 / 13.7 * 0.05, rel=0.01)
    assert np.max(np.abs(table["controller.left.voltage"][:fallen])) == 12.0
    assert np.degrees(np.mean(table["plant.pitch"][4000:7000])) == pytest.approx(4.2, abs=0.1)


def test_without_friction_and_errors_the_speed_stays(ssp):
    """Nothing brings it back: 0.61 m/s after standing up, the same ten seconds later."""
    table = run(ssp, DRIFT["pitch law, no dry friction, perfect sensor"], RELEASE + 14.0)
    speed = value("wheel_radius") * table["plant.wheel_rate"][table.times > RELEASE + 4.0]
    assert np.mean(speed) == pytest.approx(0.61, abs=0.005)
    assert np.ptp(speed) < 0.01 * np.mean(speed)
    assert abs(math.degrees(table["plant.pitch"][-1])) < 0.02


def test_tables_and_thresholds():
    trials = [Trial(5.0, 1.0, False, 9.0), Trial(10.0, 1.0, True, 12.0), Trial(20.0, 1.0, True, 12.0)]
    trials += [Trial(epsilon, 2.0, False, 99.0) for epsilon in (5.0, 10.0, 20.0)]
    assert smallest(trials, 1.0, attrgetter("stands")) == 10.0
    assert smallest(trials, 1.0, Trial.meets) == 20.0
    assert smallest(trials, 2.0, attrgetter("stands")) is None
    assert tables({("balance", "body mass"): trials}) == [
        "| balance: body mass, × nominal | 1 | 2 |",
        "| --- | --- | --- |",
        "| stands from epsilon = | 10 | none |",
        "| condition met from epsilon = | 20 | none |",
        "",
    ]


def test_ctrl_c_within_a_run_ends_the_study(ssp, monkeypatch):
    def interrupted(system, **options):
        return simulate(
            system,
            **options,
            runtime=Runtime(loop="python"),
            observer=Observer(progress=lambda _: signal.raise_signal(signal.SIGINT)),
        )

    monkeypatch.setattr(stability, "simulate", interrupted)
    with pytest.raises(KeyboardInterrupt):
        study(ssp)


def test_a_folder_that_cannot_be_written_is_told_before_anything_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(stability_report, "build_all", lambda _: pytest.fail("it builds"))
    (tmp_path / "file").write_text("in the folder's place")
    assert main(["stability", "--out", str(tmp_path / "file")]) == 1
    assert capsys.readouterr().err == f"twip: {tmp_path / 'file'}: cannot be written: File exists\n"


@pytest.mark.heavy
def test_the_whole_map_by_the_command(tmp_path, monkeypatch, capsys):
    """322 runs: the page's tables; what meets the condition stands, and what stands does so with more epsilon."""
    found = {}

    def recorded(ssp, progress):
        found.update(study(ssp, progress))
        return found

    monkeypatch.setattr(stability_report, "study", recorded)
    parser = argparse.ArgumentParser()
    command.declare(parser)
    arguments = parser.parse_args(["--out", str(tmp_path)])
    assert arguments.run(arguments) == 0
    printed = capsys.readouterr().out
    assert printed[: printed.index("picture ")].strip() in PAGE
    for trials in found.values():
        assert not [t for t in trials if t.meets() and not t.stands]
        for a, b in pairwise(sorted(trials, key=lambda t: (t.factor, t.epsilon))):
            assert not (a.factor == b.factor and a.stands and not b.stands)
    for name in ("stability.png", "stability_drift.png"):
        assert (tmp_path / name).stat().st_size > 10_000
