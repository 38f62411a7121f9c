"""The report's file: what it holds, that it escapes what it prints, and that its samples are those of the log."""

import json
import re
import struct
import zlib
from base64 import b64decode
from math import radians

import numpy as np
import pytest
from robot_log import METADATA, columns, robot_log, write

from twip.cli import main
from twip.errors import TwipError
from twip.lab.panels import STICTION, matching, panels, rest
from twip.lab.report import report
from twip.lab.report import samples as samples_module
from twip.lab.report.page import page, short_names
from twip.lab.report.samples import LEVELS, Samples, thinned
from twip.lab.run_parameters import given, number

HOSTILE = "<script>alert(1)</script>"


def unpacked(about, text):
    """Decode as `data.js` does: sums of differences, byte planes."""
    data, at, found = zlib.decompress(b64decode(text)), 0, []
    counts = [log["count"] for log in about["logs"]]
    coded = [(log["coded"], log["count"]) for log in about["logs"] if "coded" in log]
    for one, count in [*coded, *((s, counts[s["log"]]) for s in about["series"])]:
        planes = np.frombuffer(data[at : at + 4 * count], np.uint8).reshape(4, count)
        codes = np.cumsum(np.ascontiguousarray(planes.T).view("<u4")[:, 0], dtype=np.uint32).astype(float)
        found.append(np.where(codes > 0, one["low"] + (codes - 1) * one["step"], np.nan))
        at += 4 * count
    assert at == len(data)
    return found


def test_samples_survive_packing():
    times = np.arange(5000) / 1000.0
    noise = np.random.default_rng(1).normal(size=5000)
    gaps = np.where(noise > 1.0, np.nan, noise)
    signals = [noise, gaps, np.full(5000, 7.25), np.full(5000, np.inf), 1e300 * noise, np.sin(times)]
    samples = Samples([times])
    for values in signals:
        samples.add(0, values)
    for values, found in zip(signals, unpacked(*samples.packed()), strict=True):
        finite = np.isfinite(values)
        np.testing.assert_array_equal(np.isnan(found), ~finite)
        if finite.any():
            # half a step, and the rounding of the decoder's own arithmetic
            np.testing.assert_allclose(found[finite], values[finite], atol=np.ptp(values[finite]) / LEVELS * 0.501)


def test_uneven_times_are_kept():
    times = np.array([0.0, 0.001, 0.0011, 0.5, 60.0])
    samples = Samples([times])
    samples.add(0, times)
    np.testing.assert_allclose(unpacked(*samples.packed())[0], times, atol=60.0 / 2**32)


def test_thinning_keeps_extremes_in_their_order():
    assert thinned(np.array([3.0, 9.0, 1.0, 5.0, 2.0, 2.0, 8.0]), 3).tolist() == [9.0, 1.0, 5.0, 2.0, 8.0, 8.0]
    spike = np.zeros(100_000)
    spike[77_777] = 5.0
    assert thinned(spike, 1000).max() == 5.0


def test_what_does_not_fit_is_thinned_out_and_said(tmp_path, monkeypatch):
    log = robot_log(tmp_path / "a.mcap")
    monkeypatch.setattr(samples_module, "BUDGET", 4000)
    text = page([log])
    assert "smallest and the largest value of every" in text
    assert "Every row of the log is in this file." in page([robot_log(tmp_path / "b.mcap", 0.1)])


def payload(text):
    return json.loads(re.search(r'<script id="data" type="application/json">(.*?)</script>', text, re.DOTALL)[1])


def test_the_robots_report_has_all_that_is_promised(tmp_path):
    log = robot_log(tmp_path / "robot.mcap", controller__speed_reference=np.full(4001, 0.1))
    text = page([log])
    found = {panel["title"]: [line["label"] for line in panel["lines"]] for panel in payload(text)["panels"]}
    assert found["Pitch"] == ["pitch", "estimate"]  # no reference was given
    assert found["Speed"] == ["speed", "estimate", "reference"]
    assert found["Voltage"] == ["left", "right", "supply", "−supply"]
    assert {"Yaw", "Estimator error", "Sliding surfaces", "Place"} <= set(found)
    assert not [title for title in found if "friction" in title]  # the log has none
    for words in ("steady-state error", "overshoot", "settling time", "peak voltage", "energy", "twip run robot.ssp"):
        assert words in text
    assert "plant.wheel_radius (nominal 0.05 m)" in text
    assert "left.viscous_forward (nominal 1.886e-06 N.m.s/rad)" in text
    assert "body_mass" not in text  # as nominal
    assert "coulomb_forward (" not in text
    (robot,) = payload(text)["robots"]
    assert robot["wheel_radius"] == 0.06
    assert "push" not in robot["series"]
    assert page([log]) == text


def test_nothing_is_fetched(tmp_path):
    text = page([robot_log(tmp_path / "robot.mcap", 0.1)])
    ours = re.sub(r"<script>.*?</script>", "", text, flags=re.DOTALL)
    assert not re.search(r"(src|href)=(?!.data:,)", ours)
    assert "default-src 'none'" in ours


def test_names_stay_text(tmp_path):
    times = np.arange(3) / 10.0
    metadata = {HOSTILE: {HOSTILE: HOSTILE}, f"start values {HOSTILE}": {HOSTILE: HOSTILE}}
    (tmp_path / "<b>").mkdir()
    log = write(tmp_path / "<b>" / "<i>.mcap", {f"{HOSTILE}.{HOSTILE}": times}, times, metadata)
    text = page([log, log])
    assert HOSTILE not in text
    assert "<i>" not in text.partition("<script")[0]
    assert "&lt;script&gt;alert(1)" in text
    assert payload(text)["panels"][0]["title"] == HOSTILE  # the script sets it as text


def test_logs_are_compared_panel_by_panel(tmp_path):
    logs = [robot_log(tmp_path / "one.mcap"), robot_log(tmp_path / "two.mcap", plant__push_force=np.ones(4001))]
    found = {panel["title"]: panel["lines"] for panel in payload(page(logs))["panels"]}
    assert [line["label"] for line in found["Pitch"]] == ["pitch, one", "pitch, two", "estimate, one", "estimate, two"]
    assert found["Pitch"][0]["color"] == found["Pitch"][2]["color"] != found["Pitch"][1]["color"]
    assert [line["label"] for line in found["Push"]] == ["push, two"]
    assert [line["label"] for line in found["Voltage"]].count("supply") == 1


def test_any_system_has_panels_by_component_and_unit(tmp_path):
    times = np.arange(5) / 10.0
    log = write(tmp_path / "other.mcap", {"a.voltage": times, "a.x": times, "b.x": times, "a.y": times}, times)
    assert [(p.title, p.unit, [i.label for i in p.lines]) for p in panels(log)] == [
        ("a", "V", ["voltage"]),
        ("a", "m", ["x", "y"]),
        ("b", "m", ["x"]),
    ]
    data = payload(page([log]))
    assert data["robots"] == []
    assert [p.title for p in panels(log, ["b.*", "a.x"])] == ["b", "a"]
    with pytest.raises(TwipError, match=r"'a\.vltage'; near: a\.voltage") as raised:
        matching(log, ["a.vltage", "q*", "a.x"])
    assert len(str(raised.value).splitlines()) == 2


def test_friction_is_drawn_beside_what_is_compensated_and_its_limits(tmp_path):
    """2.1 Ohm and 0.02 N.m/A turn 1 V of compensation into 9.52 mN.m, for a friction of the opposite sign."""
    times = np.arange(1001) / 1000.0
    torque = np.where(times < 0.5, 3e-4, -7e-4)
    signals = columns(times) | {
        "plant.left.friction_torque": torque,
        "plant.right.friction_torque": 0.0 * times,
        "controller.left.compensation_voltage": np.where(times < 0.5, 0.0, 0.1),
        "plant.left.static_reverse_limit": np.full(1001, 5e-4),
    }
    metadata = METADATA | {"start values controller": {"resistance": "2.1", "torque_constant": "0.02"}}
    log = write(tmp_path / "friction.mcap", signals, times, metadata)
    found = {panel.title: panel for panel in panels(log)}
    left, right = found["Dry friction, left"], found["Dry friction, right"]
    assert [(line.label, line.role) for line in left.lines] == [
        ("friction", "real"), ("compensated", "estimate"), ("static forward", "limit"), ("static reverse", "limit")
    ]  # fmt: skip
    assert [line.label for line in right.lines] == ["friction", "static forward", "static reverse"]
    values = {line.label: line.values[[100, 900]] for line in left.lines}
    assert values["friction"] == pytest.approx([0.3, -0.7])
    assert values["compensated"] == pytest.approx([0.0, -0.1 * 20.0 / 2.1])
    assert values["static forward"] == pytest.approx([-0.7, -0.7])
    assert values["static reverse"] == pytest.approx([0.5, 0.5])
    assert (left.note, right.note) == (STICTION, "")
    assert [panel["note"] for panel in payload(page([log]))["panels"] if panel["note"]] == [STICTION]


def test_rest_is_the_share_of_a_window(tmp_path):
    times = np.arange(1001) / 1000.0
    signals = columns(times) | {"plant.left.shaft_speed": np.where(times < 0.5, 0.0, np.where(times < 0.8, 2.0, -0.2))}
    log = write(tmp_path / "rest.mcap", signals, times)
    assert rest(log, "left")[[0, 400, 549, 700]] == pytest.approx([1.0, 1.0, 0.5, 0.0])


def test_given_parameters_and_their_faults(tmp_path):
    log = robot_log(tmp_path / "robot.mcap", 0.1)
    assert [(g.name, g.nominal) for g in given(log)] == [
        ("plant.wheel_radius", "0.05"),
        ("plant.pitch_start", None),
        ("left.viscous_forward", "1.886e-06"),
    ]
    assert number(log.metadata, "left", "viscous_forward") == 3e-6
    assert number(log.metadata, "right", "viscous_forward") == 1.888e-6
    times = np.arange(3) / 10.0
    bad = write(tmp_path / "bad.mcap", columns(times), times, {"start values plant": {"wheel_radius": "<b>"}})
    with pytest.raises(TwipError, match=r"plant\.wheel_radius = '<b>' is no finite number"):
        page([bad])


def test_short_names_tell_logs_apart(tmp_path):
    assert short_names([tmp_path / "a" / "x.mcap", tmp_path / "b" / "x.mcap"]) == ["a/x", "b/x"]
    assert short_names([tmp_path / "x.mcap", tmp_path / "y.mcap"]) == ["x", "y"]
    assert len(set(short_names([tmp_path / "x.mcap", tmp_path / "x.mcap"]))) == 2


def test_the_command_writes_beside_the_log_and_refuses_what_is_no_log(tmp_path, capsys):
    path = tmp_path / "robot.mcap"
    robot_log(path, 0.5)
    assert main(["report", str(path)]) == 0
    assert (tmp_path / "robot.html").stat().st_size < 3e6
    (tmp_path / "text.mcap").write_bytes(b"no log at all")
    (tmp_path / "cut.mcap").write_bytes(path.read_bytes()[:2000] + struct.pack("<Q", 7) + path.read_bytes()[2008:])
    capsys.readouterr()
    for name in ("text.mcap", "cut.mcap", "missing.mcap"):
        assert main(["report", str(tmp_path / name)]) == 1
        said = capsys.readouterr().err
        assert said.count("\n") == 1, said
        assert name in said
    assert main(["report", str(path), "--out", str(path)]) == 1
    assert main(["report", str(path), "--out", "/proc/no/such.html"]) == 1
    assert main(["report", str(path), "--signals", "plant.pich"]) == 1
    assert "near: plant.pitch" in capsys.readouterr().err


@pytest.mark.parametrize("command", ["report", "plot", "animate"])
@pytest.mark.parametrize("name", [".", "..", "/"])
def test_a_folder_is_refused_in_one_line(command, name, capsys):
    assert main([command, name]) == 1
    said = capsys.readouterr().err
    assert said.count("\n") == 1, said
    assert "must be a file" in said


def test_a_log_without_rows_is_refused(tmp_path):
    log = write(tmp_path / "empty.mcap", columns(np.zeros(0)), np.zeros(0))
    with pytest.raises(TwipError, match="has no rows to show"):
        report([log], tmp_path / "empty.html")


def test_radians_become_degrees(tmp_path):
    pitch = panels(robot_log(tmp_path / "robot.mcap", 0.1))[0]
    assert (pitch.unit, pitch.lines[0].values[0]) == ("°", pytest.approx(20.0))
    assert radians(pitch.lines[0].values[0]) == pytest.approx(0.3490658504)


def test_a_robot_with_another_controller_is_compared_in_the_robots_panels(tmp_path):
    ours = robot_log(tmp_path / "ours.mcap")
    signals = {name: values for name, values in ours.signals.items() if not name.startswith("controller.")}
    theirs = write(tmp_path / "pid.mcap", signals | {"controller.u": signals["left.voltage"]}, ours.times)
    text = page([ours, theirs])
    found = {panel["title"]: [line["label"] for line in panel["lines"]] for panel in payload(text)["panels"]}
    assert found["Pitch"] == ["pitch, ours", "pitch, pid", "estimate, ours", "estimate, pid"]
    assert {"left, ours", "left, pid"} <= set(found["Voltage"])
    assert found["Sliding surfaces"] == ["s1 balance, ours", "s2 yaw, ours"]
    assert "controller" not in found
    assert len(payload(text)["robots"]) == 2
    assert text.count("stands") + text.count("balanced: |pitch|") >= 2
    bare = write(
        tmp_path / "bare.mcap", {n: v for n, v in signals.items() if not n.startswith("estimator.")}, ours.times
    )
    titles = {panel["title"]: len(panel["lines"]) for panel in payload(page([bare]))["panels"]}
    assert titles["Pitch"] == 1
    assert not {"Estimator error", "Sliding surfaces"} & set(titles)


def test_the_json_of_a_robot_with_another_controller_has_metrics(tmp_path, capsys):
    ours = robot_log(tmp_path / "ours.mcap")
    kept = {n: v for n, v in ours.signals.items() if not n.startswith(("controller.", "estimator."))}
    log = write(tmp_path / "pid.mcap", kept, ours.times)
    assert main(["report", str(log.path), "--json"]) == 0
    (metrics,) = json.loads(capsys.readouterr().out)["metrics"].values()
    assert metrics["peak_voltage"] == pytest.approx(3.0, rel=1e-3)
    assert metrics["estimator_error"] is None
