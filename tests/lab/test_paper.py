"""The paper's experiments run through the built FMUs, and their pictures and tables are written."""

import argparse
import json
import re
import resource
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from twip.commands import paper
from twip.errors import TwipError
from twip.lab.paper import programme
from twip.lab.paper.checks import Check, Result
from twip.lab.paper.laboratory import Experiment, Laboratory
from twip.lab.paper.programme import FIGURES, run_figure
from twip.lab.paper.swing import (
    PRINTED_SIGNS,
    STOP,
    encoder_pitch,
    hand_torque,
    slow_then_fast,
    swings,
)
from twip.robot.attitude import lever_arm_force
from twip.robot.parameters import value

PAGES = Path(__file__).parents[2] / "docs" / "paper"


@pytest.fixture(scope="module")
def laboratory(built, tmp_path_factory):
    """One seed: what a figure measures lies as close to its expectation with any."""
    return Laboratory(built, tmp_path_factory.mktemp("paper"), seeds=1)


def command(*words):
    parser = argparse.ArgumentParser()
    paper.declare(parser)
    return paper.run(parser.parse_args(list(words)))


def test_the_hand_holds_the_body_still_against_gravity_alone():
    times = np.linspace(0.0, 1.0, 5)
    torque = hand_torque(times, lambda t: np.full_like(t, 0.3))
    weight = value("body_mass") * value("gravity") * value("cog_height")
    # differences over 0.1 ms leave rounding of 1e-16 / 1e-8 s^2 times the inertia 0.02 kg m^2
    np.testing.assert_allclose(torque, -weight * np.sin(0.3), atol=1e-8)


def test_the_body_follows_its_path_and_the_encoder_sees_it(laboratory):
    run = swings(laboratory).runs[0]
    path = np.degrees(slow_then_fast(run.times))
    assert run.times[-1] == STOP
    assert np.ptp(path) > 39.0
    # the motors guide it by the estimate: its biases (0.29 deg) and the delay of a sample, 5 ms at 226 deg/s
    assert np.max(np.abs(run.degrees("plant.pitch") - path)) < 0.3 + 226.0 * 0.005
    half_count = np.pi / value("encoder_resolution") / value("gear_ratio")
    extrapolated = 74.0 * 1e-3**2 / 8.0  # the count at a step's end follows from the mean speed: psi'' h^2 / 8
    assert np.max(np.abs(encoder_pitch(run) - run["plant.pitch"])) <= half_count + extrapolated


def test_the_printed_signs_are_those_of_both_sine_terms():
    rate, acceleration, distance, elevation = 2.0, 30.0, value("sensor_distance"), value("sensor_elevation")
    force = lever_arm_force(rate, acceleration, distance, PRINTED_SIGNS["estimator.sensor_elevation"])
    sine, cosine = distance * np.sin(elevation), distance * np.cos(elevation)
    printed = (-sine * acceleration - cosine * rate**2, -cosine * acceleration + sine * rate**2)
    np.testing.assert_allclose(force, printed, rtol=1e-12)


def test_an_experiment_says_how_it_is_repeated_on_the_command_line():
    experiment = Experiment(6.0, {"plant.pitch_start": 0.5}, ("pid",), "ssp/inputs/yaw_turn.csv")
    assert experiment.command(3) == (
        "twip run ssp/twip.ssp --stop-time 6 --parameters ssp/parameters/pid.ssv"
        " --input-file ssp/inputs/yaw_turn.csv --start-values imu.seed 3 plant.pitch_start 0.5"
    )


@pytest.mark.parametrize("name", ["fig07", "fig10", "fig11", "fig12", "fig15", "fig19"])
def test_a_figure_is_as_expected(laboratory, name):
    result = run_figure(laboratory, name).result
    assert result.name == name
    assert [f"{c.quantity}: {c.measured_text}, expected {c.expected_text}" for c in result.checks if not c.met] == []
    with Image.open(laboratory.out / f"{name}.png") as picture:
        assert picture.width == 1170  # 9 inches at 130 dots per inch


def fake(measured):
    def run(laboratory):
        return Result("fig07", "A figure", (Check("Fig 7", "a claim", "a value", [measured], 0, 1, "°", "test"),))

    return run


@pytest.mark.parametrize(("measured", "status"), [(0.5, 0), (1.5, 1)])
def test_the_command_fails_when_an_expectation_is_missed(monkeypatch, capsys, tmp_path, measured, status):
    monkeypatch.setitem(FIGURES, "fig07", fake(measured))
    monkeypatch.setattr(programme, "build_all", lambda _: None)
    monkeypatch.setattr(Laboratory, "run", lambda *_: None)
    assert command("fig07", "--jobs", "1", "--out", str(tmp_path)) == status
    said = capsys.readouterr()
    assert ("MISSED" in said.out) == bool(status)
    assert f"{1 - status} of 1 values" in said.out
    assert "fig07 done" in said.err
    assert json.loads((tmp_path / "results.json").read_text())[0]["checks"][0]["measured"] == [measured]


def test_a_wrong_name_or_count_is_said_before_anything_runs(tmp_path):
    with pytest.raises(TwipError, match="no experiment fig17"):
        command("fig17", "--out", str(tmp_path))
    with pytest.raises(TwipError, match="--seeds 0 must be at least 1"):
        command("--seeds", "0", "--out", str(tmp_path))


def test_the_kept_results_show_every_figure_and_nothing_missed():
    page = (PAGES / "results.md").read_text(encoding="utf-8")
    results = json.loads((PAGES / "results.json").read_text(encoding="utf-8"))
    assert [result["name"] for result in results] == list(FIGURES)
    assert all(check["met"] for result in results for check in result["checks"])
    assert re.findall(r"\((fig\d\d)\.png\)", page) == list(FIGURES)
    assert all((PAGES / f"{name}.png").is_file() for name in FIGURES)


@pytest.mark.heavy
def test_the_whole_paper_is_reproduced_in_time(tmp_path):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    own = resource.getrusage(resource.RUSAGE_SELF)
    assert command("--jobs", "2", "--out", str(tmp_path)) == 0
    after, mine = resource.getrusage(resource.RUSAGE_CHILDREN), resource.getrusage(resource.RUSAGE_SELF)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    spent += mine.ru_utime + mine.ru_stime - own.ru_utime - own.ru_stime
    assert spent < 2 * 300.0  # 5 minutes on two processors, whoever else uses them meanwhile
    assert {path.stem for path in tmp_path.glob("fig*.png")} == set(FIGURES)


def test_a_folder_that_cannot_be_written_is_told_before_anything_runs(tmp_path, monkeypatch):
    monkeypatch.setattr(programme, "build_all", lambda _: pytest.fail("it builds"))
    (tmp_path / "file").write_text("in the folder's place")
    with pytest.raises(TwipError, match="file: cannot be written: File exists"):
        command("fig14", "--out", str(tmp_path / "file"))
