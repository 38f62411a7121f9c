"""Pictures of logs: every format, the same bytes each time, and what cannot be drawn is said."""

import xml.etree.ElementTree as ET

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from PIL import Image
from robot_log import robot_log, write

from twip.cli import main
from twip.cosim.log.playback import read
from twip.cosim.model.signals import Channel, Signal
from twip.cosim.sinks.mcap_log import McapLog
from twip.cosim.values.strings import number_of
from twip.errors import TwipError
from twip.lab.animation import animate
from twip.lab.drawing import PALETTE, look
from twip.lab.panels import panels
from twip.lab.plot import plot


@pytest.mark.parametrize("ending", ["png", "svg", "pdf"])
def test_every_format_has_the_same_bytes_each_time(tmp_path, ending):
    log = robot_log(tmp_path / "robot.mcap", 0.5)
    for name in ("one", "two"):
        plot([log], tmp_path / f"{name}.{ending}", ["plant.pitch", "estimator.pitch"])
    assert (tmp_path / f"one.{ending}").read_bytes() == (tmp_path / f"two.{ending}").read_bytes()


def test_the_labels_are_those_of_the_signals_and_stay_text(tmp_path):
    times = np.arange(5) / 10.0
    log = write(tmp_path / "other.mcap", {"a.<b>": times, "a.y_{2}": times, "b.pitch": times}, times)
    plot([log], tmp_path / "other.svg", ["a.*", "b.pitch"], in_degrees=True)
    texts = [e.text for e in ET.parse(tmp_path / "other.svg").iter("{http://www.w3.org/2000/svg}text")]
    assert {"<b>", "y_{2}", "pitch", "[°]", "time [s]"} <= set(texts)


def test_one_log_and_one_signal_may_stand_alone(tmp_path):
    log = robot_log(tmp_path / "robot.mcap", 0.5)
    alone, listed = plot(log, tmp_path / "1.svg", "plant.pitch"), plot([log], tmp_path / "2.svg", ["plant.pitch"])
    assert alone.read_bytes() == listed.read_bytes()


def test_peaks_of_long_logs_are_drawn(tmp_path):
    times = np.arange(20_001) / 1000.0
    values = np.where(np.arange(20_001) == 7_777, 3.0, 0.0)
    log = write(tmp_path / "long.mcap", {"a.x": values}, times)
    plot([log], tmp_path / "long.svg")
    text = (tmp_path / "long.svg").read_text()
    assert len(text) < 200_000
    assert "<!-- 3 -->" in text or ">3<" in text  # the axis reaches the peak


def test_compared_logs_keep_a_colour_each():
    assert look("real", 0, 0, 2).color == look("estimate", 1, 0, 2).color != look("real", 0, 1, 2).color
    assert look("left", 0, 0, 1).color != look("right", 1, 0, 1).color


def test_the_robot_moves_in_the_animation(tmp_path):
    log = robot_log(tmp_path / "robot.mcap", 1.5)
    for ending in ("gif", "webp", "png"):
        path = animate([log], tmp_path / f"robot.{ending}", 0.4, 1.0, rate=10.0)
        with Image.open(path) as picture:
            assert picture.n_frames == 7
            first = picture.convert("RGB").copy()
            picture.seek(6)
            assert np.any(np.asarray(first) != np.asarray(picture.convert("RGB")))
        again = animate([log], tmp_path / f"again.{ending}", 0.4, 1.0, rate=10.0)
        assert path.read_bytes() == again.read_bytes()


def test_compared_robots_keep_a_colour_each_and_none_hides_another(tmp_path):
    upright = {"plant__pitch": np.zeros(1501)}
    logs = [robot_log(tmp_path / "one.mcap", 1.5), robot_log(tmp_path / "two.mcap", 1.5, **upright)]
    shown = {}
    for apart in (0.4, 0.0):
        path = animate(logs, tmp_path / f"at{apart:g}.png", 0.6, 0.8, 10.0, apart=apart)
        with Image.open(path) as picture:
            pixels = np.asarray(picture.convert("RGB"), float)[:170]  # the robots above, without the plot
        for colour in PALETTE[: 2 if apart else 1]:
            wanted = [255.0 * part for part in to_rgb(colour)]
            where = np.argwhere(np.abs(pixels[40:] - wanted).max(axis=2) < 40.0)
            shown[apart, colour] = float(np.mean(where[:, 1]))
    first, second = PALETTE[:2]
    assert shown[0.4, second] - shown[0.4, first] > 100.0  # px
    assert shown[0.4, first] + 50.0 < shown[0.0, first] < shown[0.4, second] - 50.0  # where both are


def test_a_shorter_log_is_drawn_while_it_lasts(tmp_path):
    logs = [robot_log(tmp_path / "long.mcap", 1.5), robot_log(tmp_path / "short.mcap", 0.5)]
    with Image.open(animate(logs, tmp_path / "both.gif", None, None, rate=4.0)) as picture:
        assert picture.n_frames == 7


def test_lines_that_coincide_show_beside_each_other():
    widths = [look("real", 0, log, 3).width for log in range(3)]
    assert widths == sorted(widths, reverse=True)
    assert widths[1] - widths[2] > 1.0  # points


def test_what_cannot_be_drawn_is_said(tmp_path, capsys):
    log = robot_log(tmp_path / "robot.mcap", 0.5)
    times = np.arange(5) / 10.0
    other = write(tmp_path / "other.mcap", {"a.x": times}, times)
    with pytest.raises(TwipError, match=r"must be one of \.png, \.svg, \.pdf"):
        plot([log], tmp_path / "robot.jpg")
    with pytest.raises(TwipError, match="does not show the robot"):
        animate([other], tmp_path / "other.gif", None, None)
    with pytest.raises(TwipError, match="there is nothing to draw"):
        animate([log], tmp_path / "robot.gif", 3.0, 2.0)
    assert main(["plot", str(log.path), "plant.pich"]) == 1
    assert "near: plant.pitch" in capsys.readouterr().err
    assert main(["plot", str(log.path), "--out", "/proc/x.png"]) == 1
    assert main(["plot", str(log.path), "plant.*", "--with", str(other.path)]) == 1  # `other` has no plant
    assert main(["plot", str(log.path)]) == 0
    assert (tmp_path / "robot.png").exists()


def test_strings_are_left_out_or_named(tmp_path):
    channel = Channel("a", (Signal("mode", "String", None, "output"), Signal("x", "Int8", None, "output")))
    times = np.arange(5) / 10.0
    rows = np.column_stack([np.full(5, number_of("standing")), np.arange(5.0)])
    with McapLog(tmp_path / "a.mcap", [channel], {}) as log:
        log.write(times, rows)
    read_back = read(tmp_path / "a.mcap")
    assert [line.label for panel in panels(read_back) for line in panel.lines] == ["x"]
    assert [line.label for panel in panels(read_back, ["a.*"]) for line in panel.lines] == ["x"]
    with pytest.raises(TwipError, match=r"a\.mode is a String in .*a\.mcap, which cannot be drawn"):
        panels(read_back, ["a.mode"])
