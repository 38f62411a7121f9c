"""A viewer of a live view, with the blocking client of `websockets`, and a view of a robot that is made up."""

import json
import struct
import time

import numpy as np
from robot_log import METADATA, columns
from websockets.sync.client import connect

from twip.cosim.model.signals import Channel, Signal
from twip.errors import TwipError
from twip.lab.live import LiveView

PATIENCE = 20.0
"""Longest that an answer is waited for, in s."""
NO_ROWS = np.zeros(0), np.zeros((0, 0))


class PlainInputs(dict):
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

    def present(self):
        return dict(self)


class Client:
    """A viewer as Foxglove is one; `turning` stands for the run, which lets the view work between its steps."""

    def __init__(self, view, turning=True, subprotocol="foxglove.sdk.v1", origin=None):
        self._connection = connect(
            view.address, subprotocols=[subprotocol], origin=origin, compression=None, close_timeout=0.5
        )
        self.socket = self._connection.__enter__()
        self.info, advertised = self.hear(), self.hear()
        assert (self.info["op"], advertised["op"]) == ("serverInfo", "advertise")
        self.channels = {channel["topic"]: channel for channel in advertised["channels"]}
        self._view = view if turning else None

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self._connection.__exit__(*error)

    def say(self, **message):
        self.socket.send(json.dumps(message))

    def hear(self):
        """Return the next message: (subscription, time in ns, bytes), or an object."""
        message = self.socket.recv(PATIENCE)
        if isinstance(message, str):
            return json.loads(message)
        opcode, subscription, log_time = struct.unpack_from("<BIQ", message)
        assert opcode == 1
        return subscription, log_time, message[13:]

    def subscribe(self, *topics):
        """Subscribe, and wait until the server has noted it."""
        wanted = [self.channels[topic]["id"] for topic in topics or self.channels]
        self.say(op="subscribe", subscriptions=[{"id": 1000 + number, "channelId": number} for number in wanted])
        self.say(op="getParameters", parameterNames=[], id="subscribed")
        assert self.hear()["id"] == "subscribed"

    def set(self, pairs):
        """Set parameters, and return the values that the server answers with."""
        self.say(op="setParameters", parameters=[{"name": name, "value": value} for name, value in pairs], id="set")
        end = time.monotonic() + PATIENCE
        while self._view is not None and time.monotonic() < end:
            self._view.write(*NO_ROWS)
            try:
                answer = json.loads(self.socket.recv(0.01))
            except TimeoutError:
                continue
            break
        else:
            answer = self.hear()
        while not isinstance(answer, dict) or answer.get("id") != "set":
            answer = self.hear()
        assert answer["op"] == "parameterValues"
        return {parameter["name"]: parameter["value"] for parameter in answer["parameters"]}

    def values(self):
        """Return the values that the server tells of next."""
        return {parameter["name"]: parameter["value"] for parameter in self.hear()["parameters"]}

    def until(self, last):
        """Return messages (time in ns, bytes) by topic, up to the first of topic `last`."""
        topics = {1000 + channel["id"]: topic for topic, channel in self.channels.items()}
        found = {}
        while last not in found:
            subscription, log_time, message = self.hear()
            found.setdefault(topics[subscription], []).append((log_time, message))
        return found


def robot_view(inputs, **given):
    """Return a view at a free port, and times and rows of a second of a robot."""
    times = np.arange(1001) / 1000.0
    signals = columns(times)
    grouped = {}
    for name in signals:
        component, _, variable = name.partition(".")
        grouped.setdefault(component, []).append(Signal(variable, "Real", None, "output"))
    channels = [Channel(component, tuple(of)) for component, of in grouped.items()]
    rows = np.column_stack([signals[f"{c.component}.{s.name}"] for c in channels for s in c.signals])
    return LiveView(channels, METADATA, inputs, port=0, **given), times, rows
