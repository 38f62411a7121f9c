"""The live view and what steers it: Foxglove's protocol by a client, keys through a terminal."""

import json
import os
import pty
import re
import signal
import sys
import time
from base64 import b64decode
from importlib import import_module
from math import radians
from pathlib import Path
from threading import Thread
from types import SimpleNamespace

import pytest
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from live_client import Client, PlainInputs, robot_view

from twip.cli import main
from twip.commands.parts.keyboard import keys, split
from twip.cosim import Inputs, Runtime, Table, load, simulate
from twip.cosim.scenario.live_inputs import LiveInputs
from twip.errors import TwipError
from twip.lab.live import LiveView
from twip.lab.metrics import BLOCKS, REQUIRED
from twip.lab.teleop import DURATION, FORCE, PUSH, SPEED, SPEED_LIMIT, SPEED_STEP, YAW, Teleop

ROOT = Path(__file__).parents[2]


def test_a_viewer_sets_what_an_input_takes_and_hears_of_the_rest(built):
    with load(built / "ssp" / "twip.ssp") as system:
        inputs = LiveInputs(system, [PUSH, SPEED, "controller.enable"])
    wrong = [
        ((PUSH, 1e308), "plant.push_force cannot take 1e+308, which is above 1000"),
        ((PUSH, True), "plant.push_force cannot take True, which is no number"),
        ((PUSH, None), "plant.push_force cannot take None, which is no number"),
        ((SPEED, float("nan")), "controller.speed_reference cannot take nan, which is not finite"),
        ((SPEED, 10**180), f"controller.speed_reference cannot take {10**180}, which is above 1e+12"),
        (("controller.enable", 1.5), "controller.enable cannot take 1.5, which is above 1"),
        (("x\n\ud800", 1.0), f"there is no input x\ufffd\ufffd to set, only {PUSH}, {SPEED}, controller.enable"),
        ((SPEED, [1.0]), "controller.speed_reference cannot take [1.0], which is no number"),
        ((SPEED, {"a": 1}), "controller.speed_reference cannot take {'a': 1}, which is no number"),
    ]
    view = LiveView([], {}, inputs, port=0)
    with Client(view) as client:
        told = client.set([*(one for one, _ in wrong), (SPEED, 1)])
    view.close()
    assert told == {PUSH: 0.0, SPEED: 1.0, "controller.enable": 1.0}
    assert inputs.refusals() == [f"refused, and left as it was: {why}" for _, why in wrong]
    assert inputs.refusals() == []
    assert not inputs.offer(SPEED, 10**400)
    assert "beyond the range of float64" in inputs.refusals()[0]


def test_a_key_beyond_the_bounds_changes_nothing():
    said = []

    class Narrow(PlainInputs):
        def offer(self, name, value):
            return abs(value) < 0.07 and super().offer(name, value)

    teleop = Teleop(Narrow({SPEED: 0.0}), said.append)
    teleop.press("up")
    teleop.press("up")
    assert said == ["speed +0.05 m/s"]


def test_keys_steer_within_limits():
    inputs, said = PlainInputs({SPEED: 0.0, YAW: 0.0, PUSH: 0.0}), []
    teleop = Teleop(inputs, said.append)
    for _ in range(20):
        assert teleop.press("up")
    assert inputs[SPEED] == SPEED_LIMIT
    teleop.press("down")
    assert inputs[SPEED] == pytest.approx(SPEED_LIMIT - SPEED_STEP)
    teleop.press("0")
    assert inputs[SPEED] == 0.0
    teleop.press("left")
    assert inputs[YAW] == radians(15.0)  # yaw is positive to the left
    teleop.press("right")
    assert inputs[YAW] == 0.0
    assert teleop.press("x")
    assert not teleop.press("q")
    assert said[0] == "speed +0.05 m/s  yaw +0°"


def test_a_push_ends_by_itself_and_with_the_run():
    inputs = PlainInputs({PUSH: 0.0})
    teleop = Teleop(inputs, lambda _: None)
    teleop.press(" ")
    assert inputs[PUSH] == FORCE
    end = time.monotonic() + 50.0 * DURATION
    while inputs[PUSH] and time.monotonic() < end:
        time.sleep(0.01)
    assert inputs[PUSH] == 0.0
    teleop.press(" ")
    teleop.close()
    assert inputs[PUSH] == 0.0


def test_keys_without_their_inputs_do_nothing():
    inputs = PlainInputs({"other.u": 1.0})
    teleop = Teleop(inputs, lambda _: None)
    for key in ("up", "left", " ", "0"):
        assert teleop.press(key)
    teleop.close()
    assert inputs == {"other.u": 1.0}


def test_arrows_are_told_from_letters():
    assert list(split(b"a\x1b[A\x1b[D q")) == ["a", "up", "left", " ", "q"]
    assert list(split(b"\x1b[99~x")) == []


def test_a_terminal_is_read_and_left_as_it_was(monkeypatch):
    ours, theirs = pty.openpty()
    with os.fdopen(theirs, "r", closefd=True) as terminal:
        monkeypatch.setattr(sys, "stdin", terminal)
        before, pressed = import_module("termios").tcgetattr(theirs), []
        with keys(pressed.append) as heard:
            assert heard
            os.write(ours, b"\x1b[Aq")
            end = time.monotonic() + 10.0
            while len(pressed) < 2 and time.monotonic() < end:
                time.sleep(0.01)
        assert pressed == ["up", "q"]
        assert import_module("termios").tcgetattr(theirs) == before
    os.close(ours)


def test_no_terminal_no_keys(monkeypatch):
    monkeypatch.setattr(sys, "stdin", SimpleNamespace(isatty=lambda: False))
    with keys(lambda _: None) as heard:
        assert not heard


def test_without_websockets_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "websockets", None)
    with pytest.raises(TwipError, match=r"pip install -e '.\[view\]'"):
        LiveView([], {}, PlainInputs())


def test_a_wrong_address_is_refused(built, capsys):
    for address in ("8765", "127.0.0.1:x", "127.0.0.1:99999"):
        assert main(["run", str(built / "ssp" / "bench.ssp"), "--no-log", "--live", address]) == 1
        assert "must be HOST:PORT" in capsys.readouterr().err


def test_foxglove_gets_rows_poses_and_shapes_and_sets_inputs():
    inputs = PlainInputs({YAW: 0.0, SPEED: 0.0})
    view, times, rows = robot_view(inputs)
    port = int(view.address.rpartition(":")[2])
    assert view.address == f"ws://127.0.0.1:{port}"
    with pytest.raises(TwipError, match="cannot listen there"):
        LiveView([], {}, inputs, port=port)
    with Client(view) as client:
        told = client.set([(YAW, 0.5), ("no.such", 1.0), (SPEED, "x"), (SPEED, True)])
        client.subscribe()
        for first in range(0, len(times), 10):
            view.write(times[first : first + 10], rows[first : first + 10])
        view.event(1.0, "warning", "plant", "a word")
        found = client.until("/log")
    view.close()
    assert told == inputs == {YAW: 0.5, SPEED: 0.0}
    assert [time for time, _ in found["/tf"]] == [10_000_000 * k for k in range(101)]
    assert 49 <= len(found["/plant"]) <= 51
    assert b"<robot name=" in found["/robot_description"][0][1]
    assert b"a word" in found["/log"][0][1]
    assert client.channels["/tf"]["schemaName"] == "foxglove.FrameTransforms"
    assert client.channels["/robot_description"]["schema"] == "string data"
    assert client.channels["/robot_description"]["encoding"] == "cdr"
    schema = FileDescriptorSet.FromString(b64decode(client.channels["/plant"]["schema"]))
    assert [file.message_type[0].name for file in schema.file] == ["plant"]


def test_what_a_viewer_sets_counts_in_the_run_and_stands_in_its_rows(built):
    """Also what the keyboard sets is shown to it."""
    with load(built / "ssp" / "twip.ssp") as system:
        inputs = LiveInputs(system, [PUSH, YAW])
        view, heard = LiveView(system.channels, {}, inputs, port=0), []

        def steer():
            try:
                with Client(view, turning=False) as client:
                    client.say(op="subscribeParameterUpdates", parameterNames=[YAW])
                    heard.append(client.set([(PUSH, 3.0)]))
                    inputs[YAW] = 0.25
                    heard.append(client.values())
            finally:
                time.sleep(0.1)
                os.kill(os.getpid(), signal.SIGINT)  # ends the run between two steps

        class Steered(Table):
            """A table that is steered from its first row on: until then blocks are compiled."""

            def write(self, times, rows):
                super().write(times, rows)
                if not steering.ident:
                    steering.start()

        steering, table = Thread(target=steer), Steered(system.channels)
        result = simulate(
            system, stop_time=60.0, runtime=Runtime(real_time=1.0), inputs=Inputs(live=inputs), sinks=[view, table]
        )
        steering.join()
    assert result.interrupted
    assert heard == [{PUSH: 3.0, YAW: 0.0}, {YAW: 0.25}]
    assert set(table[PUSH]) == {0.0, 3.0}
    assert table[YAW][-1] == 0.25


def test_the_foxglove_layout_names_what_the_log_has():
    layout = json.loads((ROOT / "docs" / "foxglove_layout.json").read_text(encoding="utf-8"))
    text = json.dumps(layout)
    signals = {f"/{name}" for name in (*REQUIRED, *BLOCKS)}
    for path in re.findall(r'"value": "([^"]+)"', text):
        assert path.removesuffix(".@degrees") in signals, path
    panels = set(re.findall(r'"(?:first|second)": "([^"]+)"', text))
    assert panels == set(layout["configById"])
    assert '"topic": "/robot_description"' in text
