"""Recordings of other people's programs become time series, FMUs and bench data, exactly."""

import math
import struct
import sys

import fmpy
import numpy as np
import pytest
from fmpy.validation import validate_fmu
from foreign_logs import START, write_json, write_protobuf, write_ros2
from google.protobuf.descriptor_pb2 import FileDescriptorProto, FileDescriptorSet
from identification_motor import Motor
from mcap.writer import Writer

from twip.cli import main
from twip.errors import TwipError
from twip.lab.identification.columns import Columns
from twip.lab.identification.reading import read_data
from twip.lab.recordings import open_log, ros2
from twip.lab.replay_signals import replay_signals

MS = 1_000_000


def imu(k):
    return {
        "header": {"stamp": {"sec": k, "nanosec": 5}, "frame_id": "base" + "x" * k},  # moves what follows
        "angular_velocity": {"x": math.sin(k), "y": math.cos(k), "z": -0.0},
        "linear_acceleration": {"x": 1e-300 * k, "y": math.pi * k, "z": 9.81},
        "covariance": [k + i / 7 for i in range(9)],
        "flags": [k % 2 == 0] * 3,
        "level": -k,
        "points": [{"x": k, "y": 0.0, "z": 0.5}] * 2,
    }


def test_ros2_messages_are_read_as_they_were_written(tmp_path):
    log = open_log(write_ros2(tmp_path / "r.mcap", [(k * 10 * MS, imu(k)) for k in range(7)]))
    expected = {
        "/imu/data.angular_velocity.y": ("Real", [math.cos(k) for k in range(7)]),
        "/imu/data.linear_acceleration.x": ("Real", [1e-300 * k for k in range(7)]),
        "/imu/data.covariance[8]": ("Real", [k + 8 / 7 for k in range(7)]),
        "/imu/data.flags[2]": ("Boolean", [k % 2 == 0 for k in range(7)]),
        "/imu/data.level": ("Integer", [-k for k in range(7)]),
        "/imu/data.points[1].x": ("Real", list(range(7))),
        "/imu/data.header.stamp.sec": ("Integer", list(range(7))),
    }
    found = log.series(expected)
    for name, (kind, values) in expected.items():
        assert (found[name].kind, found[name].values.tolist()) == (kind, values), name
        assert found[name].times.tolist() == [k * 10 * MS / 1e9 for k in range(7)]
    names = log.fields("/imu/data")
    assert "/imu/data.covariance[0…8]" in names
    assert "/imu/data.points[0…1].z" in names
    assert not any("frame_id" in name for name in names)


def test_cdr_in_either_byte_order_with_its_alignment():
    decode = ros2.decoder("a/msg/A", b"uint8 a\nfloat64 b\nuint16[] c\nstring<=5 d 'x # y'\nB e\n===\nMSG: a/B\n")
    for mark, order in ((1, "<"), (0, ">")):
        body = struct.pack(f"{order}B7xdIHH", 3, 0.1, 2, 4, 5) + struct.pack(f"{order}I2sB", 2, b"x\0", 0)
        found = decode(bytes([0, mark, 0, 0]) + body)
        assert (found["a"], found["b"], found["c"].tolist(), found["d"], found["e"]) == (3, 0.1, [4, 5], None, {})


def test_protobuf_messages_are_read_as_they_were_written(tmp_path):
    messages = [(0, "ticks: [5, -7] force { x: 0.1 y: 0.5 } on: true label: 'a'"), (MS, "ticks: [6]"),
                (2 * MS, "ticks: [7, 9] force { }")]  # fmt: skip
    log = open_log(write_protobuf(tmp_path / "p.mcap", messages))
    found = log.series(["/joints.ticks[1]", "/joints.force.x", "/joints.force.y", "/joints.on"])
    assert [(s.kind, s.times.tolist(), s.values.tolist()) for s in found.values()] == [
        ("Integer", [0.0, 0.002], [-7, 9]),
        ("Real", [0.0, 0.002], [0.1, 0.0]),
        ("Real", [0.0, 0.002], [0.5, 0.0]),
        ("Boolean", [0.0, 0.001, 0.002], [1, 0, 0]),
    ]
    assert "/joints.label" not in log.fields("/joints")


def test_json_of_any_shape(tmp_path):
    path = write_json(tmp_path / "j.mcap", {
        "late": [(7 * MS, {"n": 1}), (5 * MS, {"n": 2**40, "m": None}), (5 * MS, {"n": 3, "m": 4.0})],
        "a.b": [(0, {"c.d": {"e": [[1, 2], [3, 4]]}, "word": "x", "mixed": 1}), (MS, {"mixed": 0.5})],
        "/bare": [(0, 4.5)],
    })  # fmt: skip
    found = open_log(path).series(["late.n", "late.m", "a.b.c.d.e[1][0]", "a.b.mixed", "/bare"])
    assert [(s.kind, s.times.tolist(), s.values.tolist()) for s in found.values()] == [
        ("Integer", [0.005, 0.007], [3, 1]),  # by time; at one time the last counts
        ("Real", [0.005], [4.0]),
        ("Integer", [0.0], [3]),
        ("Real", [0.0, 0.001], [1.0, 0.5]),
        ("Real", [0.0], [4.5]),
    ]


def test_the_fmu_plays_signals_of_topics_with_other_rates(tmp_path):
    fast = [(k * 10 * MS, {"w": math.sin(k), "on": k % 3 == 0, "n": k}) for k in range(31)]
    slow = [(50 * MS + k * 100 * MS, {"v": 10.0 * k}) for k in range(3)]
    log = write_json(tmp_path / "robot.mcap", {"/imu": fast, "/volt": slow})
    words = ["gyro.y=/imu.w:rad/s", "on=/imu.on", "n=/imu.n", "volts=/volt.v:V", "again=/imu.n:V"]
    times = [k * 10 * MS / 1e9 for k in range(31)]
    for linear in ([], ["--linear"]):
        out = tmp_path / "imu.fmu"
        assert main(["replay", str(log), "--as", str(out), *linear, "--signals", *words]) == 0
        assert validate_fmu(str(out)) == []
        rows = fmpy.simulate_fmu(str(out), stop_time=0.3, step_size=0.01, output_interval=0.01,
                                 output=["gyro.y", "on", "n", "volts", "again"])  # fmt: skip
        assert rows["gyro.y"].tolist() == [math.sin(k) for k in range(31)]
        assert rows["on"].tolist() == [k % 3 == 0 for k in range(31)]
        assert rows["n"].tolist() == rows["again"].tolist() == list(range(31))
        held = [0.0] * 15 + [10.0] * 10 + [20.0] * 6
        expected = np.interp(times, [0.05, 0.15, 0.25], [0.0, 10.0, 20.0]).tolist() if linear else held
        assert rows["volts"].tolist() == expected
    variables = {v.name: v for v in fmpy.read_model_description(str(out)).modelVariables}
    assert (variables["gyro.y"].unit, variables["gyro.y"].type, variables["n"].type) == ("rad/s", "Real", "Integer")
    assert variables["gyro.y"].description == "recorded /imu.w"


def test_a_user_sees_what_there_is(tmp_path, capsys):
    log = write_json(tmp_path / "r.mcap", {"/imu": [(0, {"w": 1.5, "list": [1, 2, 3], "\x1b[2J": 1})],
                                           "/text": [(0, {"a": "b"})], "/bad": [(0, b"{")]})  # fmt: skip
    assert main(["replay", str(log), "--list"]) == 0
    said = capsys.readouterr()
    assert said.out.splitlines() == ["/imu (1 messages)", "  /imu.w", "  /imu.list[0…2]", "  /imu.\\x1b[2J",
                                     "/text (1 messages, no numbers)"]  # fmt: skip
    assert "left out" in said.err
    assert "message 1 of /bad cannot be decoded: JSONDecodeError" in said.err
    assert main(["replay", str(log), "--as", str(tmp_path / "imu.fmu")]) == 1
    line = capsys.readouterr().err
    assert "it is not a log of twip, so --signals NAME=TOPIC.FIELD … must say what to play; there are /imu.w" in line
    assert line.count("\n") == 1
    assert main(["replay", str(log)]) == 1
    assert "--as FILE.fmu must say where" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["/imu.w"], "must be NAME=TOPIC.FIELD"),
        (["1=/imu.w"], "must be made of identifiers"),
        (["for=/imu.w"], "must be made of identifiers"),
        (["a=/imu.w", "a=/imu.on"], "two outputs of the name a"),
        (["a=/imu.v"], "there is no signal '/imu.v'; near: /imu.w"),
        (["a=/imu.list[2]"], r"there is no signal '/imu.list\[2\]'"),
        (["a=/gps.x"], "there is no signal '/gps.x'; there are /imu.w, /imu.on"),
        (["a=/imu.on:V"], "a is Boolean and has no unit"),
    ],
)
def test_a_wrong_choice_is_told(tmp_path, words, message):
    log = write_json(tmp_path / "r.mcap", {"/imu": [(0, {"w": 1.5, "on": True, "list": [1, 2]})]})
    with pytest.raises(TwipError, match=message):
        replay_signals(log, words, tmp_path / "a.fmu")


def one_message(path, encoding, data, schema=None):
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        channel = writer.register_channel("/t", encoding, writer.register_schema(*schema) if schema else 0)
        writer.add_message(channel, START, data, START)
        writer.finish()
    return path


CDR = b"\0\1\0\0"
CIRCLE = FileDescriptorSet(
    file=[FileDescriptorProto(name="a", dependency=["b"]), FileDescriptorProto(name="b", dependency=["a"])]
).SerializeToString()
HOSTILE = {
    "nested": ("json", b'{"x":' * 100_000 + b"1" + b"}" * 100_000, None, "RecursionError"),
    "digits": ("json", b'{"x": 1' + b"0" * 400 + b"}", None, "/t.x has a number that is too large"),
    "no text": ("json", b'{"x": "\xff"}', None, "UnicodeDecodeError"),
    "unknown": ("ros1", b"", ("a/A", "ros1msg", b"int8 x"), "encoded as 'ros1' with a schema in 'ros1msg'"),
    "no schema": ("cdr", b"", None, "encoded as 'cdr' with a schema in ''"),
    "descriptor": ("protobuf", b"", ("A", "protobuf", b"\xff\xff"), "the schema of /t is damaged"),
    "no type": ("protobuf", b"", ("A", "protobuf", b""), "the schema of /t is damaged"),
    "files": ("protobuf", b"", ("A", "protobuf", CIRCLE), "the schema of /t is damaged: CycleError"),
    "short": ("cdr", CDR + b"\0", ("a/A", "ros2msg", b"float64 x"), "it ends at byte 5"),
    "length": ("cdr", CDR + b"\xff" * 4, ("a/A", "ros2msg", b"float64[] x"), "it ends at byte 8"),
    "empties": ("cdr", CDR + b"\xff" * 4, ("a/A", "ros2msg", b"B[] x\n===\nMSG: a/B\n"), "it ends within x"),
    "size 0": ("cdr", CDR, ("a/A", "ros2msg", b"int8[0] x"), "array of size 0"),
    "circle": ("cdr", CDR, ("a/A", "ros2msg", b"A x"), "RecursionError"),
    "undefined": ("cdr", CDR, ("a/A", "ros2msg", b"c/C x"), "does not define the type c/C"),
    "no field": ("cdr", CDR, ("a/A", "ros2msg", b"int8"), "has a line that is no field: 'int8'"),
    "kind": ("cdr", b"\0\x07\0\0\0", ("a/A", "ros2msg", b"int8 x"), "not in plain CDR"),
}


@pytest.mark.parametrize("case", HOSTILE)
def test_hostile_messages_are_one_line(tmp_path, capsys, case):
    encoding, data, schema, message = HOSTILE[case]
    log = one_message(tmp_path / "h.mcap", encoding, data, schema)
    assert main(["replay", str(log), "--as", str(tmp_path / "a.fmu"), "--signals", "a=/t.x"]) == 1
    said = capsys.readouterr().err
    assert message in said
    assert said.count("\n") == 1
    assert main(["replay", str(log), "--list"]) == 0


def test_deep_messages_are_listed_to_a_depth(tmp_path):
    depth = sys.getrecursionlimit() // 2
    path = write_json(tmp_path / "d.mcap", {"/t": [(0, b'{"w": 1, "x":' + b"[" * depth + b"1" + b"]" * depth + b"}")]})
    assert open_log(path).fields("/t") == ["/t.w"]


def test_damaged_files_are_one_line(tmp_path):
    whole = write_ros2(tmp_path / "r.mcap", [(k * MS, imu(k)) for k in range(3)]).read_bytes()
    random = np.random.default_rng(5)
    broken = tmp_path / "b.mcap"
    told = []
    for _ in range(150):
        data = bytearray(whole)
        for place in random.integers(8, len(data), 3):
            data[place] ^= int(random.integers(1, 256))
        broken.write_bytes(data)
        try:
            open_log(broken).series(["/imu/data.level"])
        except TwipError as error:
            told.append(str(error))
    assert len(told) > 100
    assert not any("\n" in line for line in told)
    for data, message in ((b"", "is empty"), (b"PK\3\4", "no MCAP file")):
        broken.write_bytes(data)
        with pytest.raises(TwipError, match=message):
            open_log(broken)


def test_bench_data_from_two_topics(tmp_path):
    recording = Motor().record(((4.0, 0.0), (6.0, 0.09)), 1, zero=0.0)
    rows = range(4500, 5500)
    ticks = np.round(recording.angle / recording.angle_step)
    log = write_json(tmp_path / "robot.mcap", {
        "/motor": [(i * MS, {"current": recording.current[i] * 1e3}) for i in rows],
        "/joints": [(i * MS, {"ticks": [0, int(ticks[i])]}) for i in rows[7:-5]],
    })  # fmt: skip
    columns = {"current": "/motor.current:mA", "count": "/joints.ticks[1]"}
    found = read_data(log, Columns(columns), 2048.0, 0.0)
    assert np.array_equal(found.current, recording.current[4507:5495] * 1e3 * 1e-3)
    assert np.array_equal(found.angle, ticks[4507:5495] * found.angle_step)
    assert found.time == pytest.approx(np.arange(7, 995) * 1e-3, abs=1e-12)
    for given, message in (
        ({}, "name the current by --current; there are /joints.ticks"),
        ({"current": "/motor.i"}, "there is no signal '/motor.i'; near: /motor.current"),
        ({"current": "/motor.current"}, "no column for the shaft"),
    ):
        with pytest.raises(TwipError, match=message):
            read_data(log, Columns(given), 2048.0, 0.0)


def test_what_is_not_finite_stays(tmp_path):
    found = open_log(write_json(tmp_path / "j.mcap", {"/t": [(0, [math.nan, math.inf])]})).series(["/t[0]", "/t[1]"])
    assert math.isnan(found["/t[0]"].values[0])
    assert found["/t[1]"].values[0] == math.inf
