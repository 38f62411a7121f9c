"""A process that holds one FMU instance of a run: `python -m twip.cosim.fmus.isolation_child SOCKET MEMORY PARENT`."""

import contextlib
import json
import math
import os
import pickle
import signal
import socket
import sys
import threading

import numpy as np

from ...errors import TwipError
from ...platform import END_SIGNALS, end_with
from ..model.message import Message
from ..values import strings
from .instantiate import instantiate
from .isolation_wire import (
    ADVANCE,
    DONE,
    FAILED,
    GETTING,
    MESSAGE,
    NUMBER,
    NUMBER_OF,
    SETTING,
    STEP,
    STEPPING,
    TEXT_OF,
    SharedValues,
    Start,
    Wire,
    write_failure,
)
from .ports import Ports


class Outbox(list[Message]):
    """Sends messages as they come, so that those before a crash arrive; keeps none."""

    def __init__(self, wire: Wire):
        super().__init__()
        self._wire = wire
        self._lock = threading.Lock()  # an FMU may log from a thread of its own

    def append(self, message: Message) -> None:
        """Send a message."""
        text = json.dumps([message.time, message.level, message.source, message.text])
        self.send(MESSAGE, text.encode())

    def send(self, kind: int, payload: bytes = b"") -> None:
        """Send any reply."""
        with self._lock:
            self._wire.send(kind, payload)

    def number_of(self, text: str) -> float:
        """Ask the run for the number of a text."""
        (number,) = NUMBER.unpack(self._ask(NUMBER_OF, text.encode("utf-8", "surrogatepass")))
        return float(number)

    def text_of(self, number: float) -> str:
        """Ask the run for the text of a number."""
        return self._ask(TEXT_OF, NUMBER.pack(number)).decode("utf-8", "surrogatepass")

    def _ask(self, kind: int, payload: bytes) -> bytes:
        self.send(kind, payload)
        return self._wire.receive()[1]  # the run sends nothing else before it has a reply


class Server:
    """The instance, and what the run asks of it."""

    def __init__(self, start: Start, shared: SharedValues, outbox: Outbox):
        self._doing, self._index, self._process = shared.doing, start.index, os.getpid()
        self._clock = np.array([start.time])
        self._instance = instantiate(start.component, start.folder, outbox, set(), self._clock)
        self._ports = Ports(start.ports, self._instance, shared.values)
        self._targets = {"instance": self._instance, "ports": self._ports}

    def answer(self, kind: int, payload: bytes) -> bytes:
        """Do what a request asks for and return its result."""
        if kind == ADVANCE:
            self._advance(*STEP.unpack(payload))
            return b""
        self._clock[0], target, method, arguments = pickle.loads(payload)
        result = getattr(self._targets[target], method)(*arguments)
        if isinstance(result, int):
            return result.to_bytes(8, "little")
        return result if isinstance(result, bytes) else b""

    def _advance(self, set_at: float, step_at: float, begin: float, step_size: float, get_at: float) -> None:
        if not math.isnan(set_at):
            self._doing[self._index], self._clock[0] = SETTING, set_at
            self._ports.set_inputs()
        if not math.isnan(step_at):
            self._doing[self._index], self._clock[0] = STEPPING, step_at
            self._instance.step(begin, step_size)
            end_copy(self._process)  # before it writes old outputs beside the new ones
        self._doing[self._index], self._clock[0] = GETTING, get_at
        self._ports.get_outputs()


def serve(wire: Wire, memory: int) -> None:
    """Answer requests until the run closes the connection (`ConnectionError`) or the instance cannot be made."""
    start: Start = pickle.loads(wire.receive()[1])
    outbox, process = Outbox(wire), os.getpid()
    strings.ask(outbox.number_of, outbox.text_of)
    try:
        server = Server(start, SharedValues(start.columns, start.components, memory), outbox)
    except TwipError as error:
        outbox.send(FAILED, write_failure(error))
        return
    outbox.send(DONE)
    while True:
        request = wire.receive()
        try:
            result = server.answer(*request)
        except TwipError as error:
            end_copy(process)
            outbox.send(FAILED, write_failure(error))
        else:
            end_copy(process)
            outbox.send(DONE, result)


def end_copy(process: int) -> None:
    """End a copy of the process that the FMU has made by `fork`: the run has one to talk to."""
    if os.getpid() != process:
        os._exit(1)


def die_with(parent: int) -> None:
    """Let the kernel kill this process when its parent is gone, whatever the FMU is doing, and before others when
    memory runs out. Signals to the whole session are the parent's business.
    """
    for number in END_SIGNALS:
        signal.signal(number, signal.SIG_IGN)
    end_with(parent)


if __name__ == "__main__":
    die_with(int(sys.argv[3]))
    for descriptor in sys.argv[1:3]:
        os.set_inheritable(int(descriptor), False)  # what the FMU starts must not keep the connection open
    with contextlib.suppress(ConnectionError):
        serve(Wire(socket.socket(fileno=int(sys.argv[1]))), int(sys.argv[2]))
