"""The live view and what steers it: Foxglove's protocol by a client that is not ours, keys through a terminal."""

import asyncio
import json
import os
import pty
import re
import socket
import struct
import sys
import time
from importlib import import_module
from math import radians
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from robot_log import METADATA, columns

from twip.cli import main
from twip.commands.parts.keyboard import keys, split
from twip.cosim import load
from twip.cosim.record import Channel, Signal
from twip.cosim.scenario.live_inputs import LiveInputs
from twip.errors import TwipError
from twip.lab import live
from twip.lab.live import LiveView
from twip.lab.metrics import BLOCKS, REQUIRED
from twip.lab.teleop import DURATION, FORCE, PUSH, SPEED, SPEED_LIMIT, SPEED_STEP, YAW, Teleop

ROOT = Path(__file__).parents[2]


class Inputs(dict):
    """Stands for `LiveInputs`: names and values."""

    @property
    def names(self):
        return tuple(self)

    def __setitem__(self, name, value):
        if name not in self:
            raise TwipError(f"there is no input {name}")
        super().__setitem__(name, value)

    def offer(self, name, value):
        known = name in self and isinstance(value, int | float) and not isinstance(value, bool)
        if known:
            self[name] = value
        return known


def test_a_viewer_sets_what_an_input_takes_and_hears_of_the_rest(built):
    with load(built / "ssp" / "twip.ssp") as system:
        inputs = LiveInputs(system, [PUSH, SPEED, "controller.enable"])
    listener = live._Listener(inputs, lambda name, value: (name, value))

    def sent(name, value):
        return SimpleNamespace(name=name, get_value=lambda: value)

    wrong = [(PUSH, 1e308), (PUSH, True), (SPEED, float("nan")), ("controller.enable", 1.5), ("x", 1.0), (SPEED, [1.0])]
    told = listener.on_set_parameters(None, [*(sent(*one) for one in wrong), sent(SPEED, 1)])
    assert dict(told) == {PUSH: 0.0, SPEED: 1.0, "controller.enable": 1.0}
    assert inputs.refusals() == [
        f"refused, and left as it was: {why}"
        for why in (
            "plant.push_force cannot take 1e+308, which is above 1000",
            "plant.push_force cannot take True, which is no number",
            "controller.speed_reference cannot take nan, which is not finite",
            "controller.enable cannot take 1.5, which is above 1",
            f"there is no input x to set, only {PUSH}, {SPEED}, controller.enable",
            "controller.speed_reference cannot take [1.0], which is no number",
        )
    ]
    assert inputs.refusals() == []


def test_a_key_beyond_the_bounds_changes_nothing():
    said = []

    class Narrow(Inputs):
        def offer(self, name, value):
            return abs(value) < 0.07 and super().offer(name, value)

    teleop = Teleop(Narrow({SPEED: 0.0}), said.append)
    teleop.press("up")
    teleop.press("up")
    assert said == ["speed +0.05 m/s"]


def test_keys_steer_within_limits():
    inputs, said = Inputs({SPEED: 0.0, YAW: 0.0, PUSH: 0.0}), []
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
    inputs = Inputs({PUSH: 0.0})
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
    inputs = Inputs({"other.u": 1.0})
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


def test_without_foxglove_the_extra_is_named(monkeypatch):
    monkeypatch.setattr(live, "find_spec", lambda _: None)
    with pytest.raises(TwipError, match=r"pip install -e '.\[view\]'"):
        LiveView([], {}, Inputs())


def test_a_wrong_address_is_refused(built, capsys):
    for address in ("8765", "127.0.0.1:x", "127.0.0.1:99999"):
        assert main(["run", str(built / "ssp" / "bench.ssp"), "--no-log", "--live", address]) == 1
        assert "must be HOST:PORT" in capsys.readouterr().err


async def collect(address, send):
    """Connect as Foxglove does, subscribe to all, run `send` in a thread, and return messages by topic and texts."""
    websockets = import_module("websockets")
    topics, found, texts = {}, {}, []
    async with websockets.connect(address, subprotocols=["foxglove.sdk.v1"]) as socket_:
        sending = None
        while True:
            try:
                message = await asyncio.wait_for(socket_.recv(), 3.0)
            except TimeoutError:
                return found, texts
            if isinstance(message, bytes):
                channel, log_time = struct.unpack_from("<IQ", message, 1)
                found.setdefault(topics[channel], []).append((log_time, message[13:]))
                continue
            texts.append(json.loads(message))
            if texts[-1]["op"] == "advertise":
                new = {c["id"]: c["topic"] for c in texts[-1]["channels"] if c["id"] not in topics}
                topics.update(new)
                wanted = [{"id": i, "channelId": i} for i in new]
                await socket_.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))
            if sending is None and topics:
                values = [{"name": YAW, "value": 0.5}, {"name": "no.such", "value": 1.0}, {"name": SPEED, "value": "x"}]
                values.append({"name": SPEED, "value": True})
                await socket_.send(json.dumps({"op": "setParameters", "parameters": values, "id": "1"}))
                await asyncio.sleep(0.5)  # until the server has noted the subscriptions
                sending = asyncio.get_running_loop().run_in_executor(None, send)


@pytest.mark.foreign
def test_foxglove_gets_rows_poses_and_shapes_and_sets_inputs():
    times = np.arange(1001) / 1000.0
    signals = columns(times)
    grouped = {}
    for name in signals:
        component, _, variable = name.partition(".")
        grouped.setdefault(component, []).append(Signal(variable, "Real", None, "output"))
    channels = [Channel(component, tuple(of)) for component, of in grouped.items()]
    rows = np.column_stack([signals[f"{c.component}.{s.name}"] for c in channels for s in c.signals])
    inputs = Inputs({YAW: 0.0, SPEED: 0.0})
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    view = LiveView(channels, METADATA, inputs, port=port)
    assert view.address == f"ws://127.0.0.1:{port}"
    with pytest.raises(TwipError, match="cannot listen there"):
        LiveView(channels, METADATA, inputs, port=port)

    def send():
        for part in np.array_split(np.arange(len(times)), 100):
            view.write(times[part], rows[part])
        view.event(1.0, "warning", "plant", "a word")

    found, texts = asyncio.run(collect(view.address, send))
    view.close()
    assert [time for time, _ in found["/tf"]] == [10_000_000 * k for k in range(101)]
    assert 49 <= len(found["/plant"]) <= 51
    assert b"<robot name=" in found["/robot_description"][0][1]
    assert b"a word" in found["/log"][0][1]
    assert inputs == {YAW: 0.5, SPEED: 0.0}
    told = [text for text in texts if text["op"] == "parameterValues"][-1]["parameters"]
    assert {parameter["name"]: parameter["value"] for parameter in told} == {YAW: 0.5, SPEED: 0.0}
    advertised = {c["topic"]: c["schemaName"] for text in texts if text["op"] == "advertise" for c in text["channels"]}
    assert advertised["/tf"] == "foxglove.FrameTransforms"


def test_the_foxglove_layout_names_what_the_log_has():
    layout = json.loads((ROOT / "docs" / "foxglove_layout.json").read_text(encoding="utf-8"))
    text = json.dumps(layout)
    signals = {f"/{name}" for name in (*REQUIRED, *BLOCKS)}
    for path in re.findall(r'"value": "([^"]+)"', text):
        assert path.removesuffix(".@degrees") in signals, path
    panels = set(re.findall(r'"(?:first|second)": "([^"]+)"', text))
    assert panels == set(layout["configById"])
    assert '"topic": "/robot_description"' in text
