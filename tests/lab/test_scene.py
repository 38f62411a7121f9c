"""The robot in 3D: poses on /tf and the URDF in a log, as the public schemas' own decoders read them."""

import re
import struct
import subprocess
from math import atan2, pi
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from robot_log import METADATA, columns

from twip.cosim.log.playback import read
from twip.cosim.model.signals import Channel, Signal
from twip.cosim.sinks.mcap_log import McapLog
from twip.lab.rerun_view import recording, rerun
from twip.lab.scene import One, scene

GEAR, RADIUS, TRACK = 13.7, 0.06, 0.2
"""Of the made-up robot: its wheel radius is not the nominal one."""


def written(path, times, pieces=(), extra_components=(), **given):
    """Write the robot's log with its scene, in pieces of rows; return it read back."""
    signals = columns(times, **given)
    by_component = {}
    for name in signals:
        component, _, variable = name.partition(".")
        by_component.setdefault(component, []).append(variable)
    channels = [Channel(c, tuple(Signal(v, "Real", None, "output") for v in vs)) for c, vs in by_component.items()]
    channels += [Channel(c, (Signal("v", "Real", None, "output"),)) for c in extra_components]
    rows = np.column_stack([*signals.values(), *(times for _ in extra_components)])
    with McapLog(path, channels, METADATA, extras=scene(channels, METADATA)) as log:
        for part in np.split(np.arange(len(times)), pieces):
            log.write(times[part], rows[part])
            if len(part):
                log.event(times[part[-1]], "info", "", "a piece is done")
    return read(path)


def decoded(path, topic):
    with path.open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        return [(m.log_time, d) for _, _, m, d in reader.iter_decoded_messages(topics=[topic])]


def test_poses_are_those_of_the_signals(tmp_path):
    path = tmp_path / "robot.mcap"
    times = np.arange(2001) / 1000.0
    turned = {f"plant__{side}__shaft_angle": factor * times for side, factor in (("left", 3.0), ("right", -5.0))}
    log = written(path, times, **turned)
    messages = decoded(path, "/tf")
    assert [time for time, _ in messages] == [10_000_000 * k for k in range(201)]
    for time, message in messages[::20]:
        row = time // 1_000_000
        base, body, left, right = message.transforms
        assert base.timestamp.ToNanoseconds() == time
        frames = [(t.parent_frame_id, t.child_frame_id) for t in message.transforms]
        assert frames == [("world", "base"), ("base", "body"), ("body", "left_wheel"), ("body", "right_wheel")]
        assert [base.translation.x, base.translation.y] == [log["plant.x"][row], log["plant.y"][row]]
        assert base.translation.z == RADIUS
        assert [left.translation.y, right.translation.y] == [TRACK / 2, -TRACK / 2]
        angles = [
            2.0 * atan2(q.rotation.z if q is base else q.rotation.y, q.rotation.w) for q in (base, body, left, right)
        ]
        wheels = [log[f"plant.{side}.shaft_angle"][row] / GEAR for side in ("left", "right")]
        np.testing.assert_allclose(angles, [log["plant.yaw"][row], log["plant.pitch"][row], *wheels], atol=1e-15)
        assert all(t.rotation.x == 0.0 for t in message.transforms)


def test_wheels_roll_without_slip(tmp_path):
    """The plant's shaft angles, as its equations give them, turn the wheels by the way over the radius."""
    path = tmp_path / "robot.mcap"
    times = np.arange(1001) / 1000.0
    log = written(path, times)
    rolled = log["plant.x"] / RADIUS
    shaft = GEAR * (rolled - log["plant.pitch"])
    path = tmp_path / "rolling.mcap"
    written(path, times, plant__left__shaft_angle=shaft)
    _, message = decoded(path, "/tf")[-1]
    body, wheel = (2.0 * atan2(t.rotation.y, t.rotation.w) for t in message.transforms[1:3])
    assert body + wheel == pytest.approx(rolled[-1])


def test_the_description_has_the_frames_and_sizes(tmp_path):
    path = tmp_path / "robot.mcap"
    written(path, np.arange(501) / 1000.0)
    with path.open("rb") as stream:
        ((schema, channel, message),) = make_reader(stream).iter_messages(topics=["/robot_description"])
    assert (schema.name, schema.encoding, channel.message_encoding) == ("std_msgs/msg/String", "ros2msg", "cdr")
    (size,) = struct.unpack_from("<I", message.data, 4)
    assert message.data[:4] == b"\0\1\0\0"
    assert len(message.data) == 8 + size
    robot = ET.fromstring(message.data[8:-1].decode())
    assert {link.get("name") for link in robot.iter("link")} == {"base", "body", "left_wheel", "right_wheel"}
    tyre = robot.find(".//link[@name='left_wheel']/visual/geometry/cylinder")
    assert float(tyre.get("radius")) == RADIUS
    assert float(robot.find(".//link[@name='left_wheel']/visual/origin").get("rpy").split()[0]) == pytest.approx(pi / 2)
    joints = {j.find("child").get("link"): j.find("origin").get("xyz").split() for j in robot.iter("joint")}
    assert float(joints["left_wheel"][1]) == TRACK / 2


@pytest.mark.parametrize("step", [0.001, 0.003, 0.01, 0.025])
def test_any_step_gives_at_most_a_hundred_poses_a_second(tmp_path, step):
    path = tmp_path / "robot.mcap"
    times = step * np.arange(round(2.0 / step) + 1)
    written(path, times)
    at = np.array([time for time, _ in decoded(path, "/tf")]) / 1e9
    assert set(np.rint(at / step)) <= set(range(len(times)))
    assert len(at) == min(len(times), 1 + round(times[-1] * 100 - 1e-9))


def test_pieces_do_not_matter_and_the_signals_stay_as_they_are(tmp_path):
    times = np.arange(1501) / 1000.0
    one = written(tmp_path / "one.mcap", times)
    written(tmp_path / "two.mcap", times)
    many = written(tmp_path / "many.mcap", times, pieces=(0, 1, 7, 8, 300, 301, 1400))
    assert (tmp_path / "one.mcap").read_bytes() == (tmp_path / "two.mcap").read_bytes()
    poses = [
        [(time, message.SerializeToString()) for time, message in decoded(tmp_path / name, "/tf")]
        for name in ("one.mcap", "many.mcap")
    ]
    assert poses[0] == poses[1]
    assert list(one.signals) == list(many.signals) == list(columns(times))
    for name, values in columns(times).items():
        np.testing.assert_array_equal(one[name], values)
        np.testing.assert_array_equal(many[name], values)
    assert len(many.events) == 7


def test_a_component_makes_way_for_the_topics(tmp_path):
    path = tmp_path / "robot.mcap"
    log = written(path, np.arange(11) / 1000.0, extra_components=("tf",))
    assert "tf.v" in log.signals
    with path.open("rb") as stream:
        topics = [c.topic for c in make_reader(stream).get_summary().channels.values()]
    assert len(set(topics)) == len(topics)
    assert {"/tf", "/tf_2", "/robot_description"} <= set(topics)


def test_one_of_several_robots_has_topics_frames_a_place_and_a_colour_of_its_own(tmp_path):
    times = np.arange(101) / 1000.0
    signals = columns(times)
    by_component = {}
    for name in signals:
        component, _, variable = name.partition(".")
        by_component.setdefault(component, []).append(Signal(variable, "Real", None, "output"))
    plain = [Channel(component, tuple(of)) for component, of in by_component.items()]
    rows = np.column_stack([signals[f"{c.component}.{s.name}"] for c in plain for s in c.signals])
    path = tmp_path / "one.mcap"
    with McapLog(path, plain, METADATA, extras=scene(plain, METADATA, One("left_one", 0.4, "#0072b2"))) as log:
        log.write(times, rows)
    (_, message), *_ = decoded(path, "/left_one/tf")
    frames = [(t.parent_frame_id, t.child_frame_id) for t in message.transforms]
    assert frames == [
        ("world", "left_one_ground"),
        ("left_one_ground", "left_one_base"),
        ("left_one_base", "left_one_body"),
        ("left_one_body", "left_one_left_wheel"),
        ("left_one_body", "left_one_right_wheel"),
    ]
    ground = message.transforms[0]
    assert (ground.translation.x, ground.translation.y, ground.rotation.w) == (0.0, 0.4, 1.0)
    with path.open("rb") as stream:
        ((_, _, text),) = make_reader(stream).iter_messages(topics=["/left_one/robot_description"])
    robot = ET.fromstring(text.data[8:-1].decode())
    assert {link.get("name") for link in robot.findall("link")} == {child for _, child in frames[1:]}
    colour = robot.find("material[@name='body']/color").get("rgba")
    # sRGB 0x72 stands for 0.168 of the light, 0xb2 for 0.445 (IEC 61966-2-1)
    np.testing.assert_allclose([float(x) for x in colour.split()], [0.0, 0.1683, 0.4452, 1.0], atol=1e-4)


def test_other_systems_have_no_scene():
    assert scene([Channel("plant", (Signal("pitch", "Real", "rad", "output"),))], {}) == []


@pytest.mark.foreign
def test_rerun_takes_poses_and_shapes(tmp_path):
    log = written(tmp_path / "robot.mcap", np.arange(2001) / 1000.0)
    path = recording([log], tmp_path / "robot.rrd")
    stats = subprocess.run([rerun(), "rrd", "stats", path], capture_output=True, text=True, check=True).stdout
    for entity in ("/tf", "/robot_description", "/twip/visual_geometries/left_wheel/visual_0"):
        assert f"\n{entity}: " in stats, entity
    printed = subprocess.run([rerun(), "rrd", "print", path], capture_output=True, text=True, check=True).stdout
    rows = [int(n) for n in re.findall(r"with (\d+) rows .* - /tf - .*Transform3D:quaternion", printed)]
    assert sum(rows) == 4 * 201  # each pose of each frame
