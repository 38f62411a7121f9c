"""FMU instances in processes of their own: one that crashes or hangs ends the run as one that fails does.

The values lie in memory that the processes share, and each process does with them what a run in one process does, so
the results are the same. A process that does not answer within the time limit is killed; the kernel kills all of them
with the run's own.
"""

import contextlib
import json
import math
import os
import pathlib
import pickle
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Sequence
from typing import NoReturn

import numpy as np
from numpy.typing import NDArray

from ...platform import end_session
from ..model.message import Message
from ..model.schedule import Schedule
from ..model.system import Component
from ..model.vector import Vector
from ..values.strings import number_of, text_of
from ..values.written import StartValue
from .component import ComponentError, one_line
from .isolation_wire import (
    ADVANCE,
    CALL,
    DONE,
    MESSAGE,
    NUMBER,
    NUMBER_OF,
    START,
    STEP,
    TEXT_OF,
    SharedValues,
    Start,
    Wire,
    read_failure,
)

TIME_LIMIT = 10.0
"""Longest that a call may take by default, in s."""
START_LIMIT = 120.0
"""The same until the first step is done, if that is more, in s: an FMU may compile its code."""
_PATH = os.pathsep.join(dict.fromkeys(filter(None, sys.path)))
"""Where this package and what it needs was found; later every FMU of pythonfmu adds its folder, thousands in time."""
_CHILD = "twip.cosim.fmus.isolation_child"
_IN_STEP = ("setting the inputs", "doStep", "getting the outputs")
_ACTIONS = {
    "setup": "entering initialization mode",
    "finish_initialization": "leaving initialization mode",
    "set_value": "setting a parameter",
    "save_state": "saving the state",
    "restore_state": "restoring the state",
    "expect_rollback": "saving the state",
    "keep_state": "saving the state",
    "return_to": "restoring the state",
    "free_state": "freeing a state",
    "forget_inputs": "setting the inputs",
    "read_inputs": "getting the inputs",
    "set_inputs": "setting the inputs",
    "get_outputs": "getting the outputs",
    "get_some": "getting the outputs",
    "close": "termination",
}


class Isolation:
    """The instances of a run, each in a process of its own, and the value vector that they share."""

    def __init__(self, schedule: Schedule, time_limit: float):
        self._schedule = schedule
        self._limit = time_limit
        self._shared = SharedValues(schedule.columns, len(schedule.components))
        self._count = 0

    @property
    def values(self) -> Vector:
        """The value vector."""
        return self._shared.values

    def instance(
        self, component: Component, folder: pathlib.Path, messages: list[Message], clock: NDArray[np.float64]
    ) -> "IsolatedInstance":
        """Start a process for the next component in the order of the file, see `Instance`; `load` must follow."""
        index = self._count
        self._count += 1
        plan = self._schedule
        start = Start(
            component, folder, plan.components[index], index, plan.columns, len(plan.components), float(clock[0])
        )
        return IsolatedInstance(start, self._shared, messages, clock, self._limit)

    def close(self) -> None:
        """Release the shared memory; the values stay readable."""
        self._shared.close()


class IsolatedInstance:
    """An instance in a process of its own, with the methods of both `Instance` and `Ports`."""

    def __init__(
        self,
        start: Start,
        shared: SharedValues,
        messages: list[Message],
        clock: NDArray[np.float64],
        limit: float,
    ):
        self.name = start.component.name
        self._start = start
        self._doing = shared.doing
        self._messages = messages
        self._clock = clock
        self._limit = limit
        self._current_limit = max(limit, START_LIMIT)
        self._said: list[str] = []
        self._set_at = self._step_at = self._begin = self._size = math.nan
        self._deadline = 0.0
        self._asked = False
        self._action = "instantiation"
        own, child = socket.socketpair()
        self._wire = Wire(own)
        descriptors = (child.fileno(), shared.descriptor)
        try:
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-m", _CHILD, *map(str, descriptors), str(os.getpid())],
                stdin=subprocess.DEVNULL,
                env={**os.environ, "PYTHONPATH": _PATH},
                pass_fds=descriptors,
                start_new_session=True,  # Ctrl-C is for the run alone
            )
        except OSError as error:
            self._wire.close()
            text = f"{self.name}: no process can be started for it ({error.strerror})"
            raise ComponentError(text, component=self.name) from None
        finally:
            child.close()

    def load(self) -> None:
        """Load the FMU and instantiate it."""
        self._request(START, pickle.dumps(self._start))
        self._reply()

    def setup(self, start_time: float, stop_time: float) -> None:
        """Apply the start values and enter initialization mode."""
        self._call("instance", "setup", start_time, stop_time)

    def finish_initialization(self) -> None:
        """Leave initialization mode: the instance may be stepped."""
        self._call("instance", "finish_initialization")

    def set_value(self, start: StartValue) -> None:
        """Set a variable before initialization, or a tunable parameter between two steps."""
        self._call("instance", "set_value", start)

    def save_state(self) -> bytes:
        """Return the serialized state between two steps."""
        return self._call("instance", "save_state")

    def restore_state(self, data: bytes) -> None:
        """Take over a state that `save_state` of an instance of the same FMU has returned."""
        self._call("instance", "restore_state", data)

    def expect_rollback(self) -> None:
        """Be ready to be put back to a time before the last step's beginning."""
        self._call("instance", "expect_rollback")

    def keep_state(self) -> int:
        """Return what stands for the state between two steps in `return_to`; it must be freed."""
        return int.from_bytes(self._call("instance", "keep_state"), "little")

    def return_to(self, state: int) -> None:
        """Be where `keep_state` returned `state`."""
        self._call("instance", "return_to", state)

    def free_state(self, state: int) -> None:
        """Free what `keep_state` has returned; with the process it is gone."""
        if self._process.returncode is None:
            self._call("instance", "free_state", state)

    def forget_inputs(self) -> None:
        """Set all inputs next time: the instance has been put back."""
        self._call("ports", "forget_inputs")

    @property
    def instance(self) -> "IsolatedInstance":
        """Itself: it is the instance and its ports."""
        return self

    def read_inputs(self) -> None:
        """Read the inputs' start values from the FMU into the vector; they count as set."""
        self._call("ports", "read_inputs")

    def set_inputs(self) -> None:
        """Set the inputs that changed since they were last set, together with what follows."""
        self._set_at = self._time

    def step(self, time: float, step_size: float) -> None:
        """Advance the instance from `time` by `step_size`, both in s, together with what follows."""
        self._step_at, self._begin, self._size = self._time, time, step_size

    def get_some(self, columns: Sequence[int]) -> None:
        """Set the inputs if that is due, and read the outputs with these columns into the vector."""
        if not math.isnan(self._set_at):
            self._call("ports", "set_inputs")
            self._set_at = math.nan
        self._call("ports", "get_some", list(columns))

    def ask_outputs(self) -> None:
        """Let the process do what is due and read all outputs; `get_outputs` waits for it."""
        self._action = ""
        self._request(ADVANCE, STEP.pack(self._set_at, self._step_at, self._begin, self._size, self._time))
        self._asked = True

    def get_outputs(self) -> None:
        """Do what is due and read all outputs into the vector; a Real that is not finite is a failure."""
        stepping = not math.isnan(self._step_at)
        if not self._asked:
            self.ask_outputs()
        self._asked = False
        self._deadline = time.monotonic() + self._current_limit  # it may have waited for a processor until now
        self._reply()
        self._set_at = self._step_at = math.nan
        if stepping:
            self._current_limit = self._limit

    def close(self) -> None:
        """Terminate and free the instance, and end its process; failures here are only logged."""
        if self._asked:
            self._forget_answer()
        if self._process.returncode is not None:
            return
        try:
            if self._action != "instantiation":
                self._call("instance", "close")
            self._wire.close()
            self._action = "the end of its process"
            if self._process.wait(self._limit) != 0:
                self._fail(self._ending())
        except subprocess.TimeoutExpired:
            self._messages.append(Message(self._time, "warning", self.name, "its process did not end and was killed"))
        except ComponentError as failure:
            self._messages.append(Message(self._time, "warning", "", str(failure)))
        finally:
            self._kill()

    def _call(self, target: str, method: str, *arguments: object) -> bytes:
        self._action = _ACTIONS[method]
        self._request(CALL, pickle.dumps((self._time, target, method, arguments)))
        return self._reply()

    @property
    def _time(self) -> float:
        return float(self._clock[0])

    def _request(self, kind: int, payload: bytes) -> None:
        if self._asked:
            self._forget_answer()
        self._said.clear()
        self._deadline = time.monotonic() + self._current_limit
        with contextlib.suppress(OSError):  # `_reply` tells what has become of the process
            self._wire.send(kind, payload, self._deadline)

    def _forget_answer(self) -> None:
        """Take the answer that nobody waits for: another instance failed in the same step."""
        self._asked, messages, self._messages = False, self._messages, []
        with contextlib.suppress(ComponentError):
            self._reply()
        self._messages = messages
        self._set_at = self._step_at = math.nan

    def _reply(self) -> bytes:
        """Return what the process answers; an interrupt kills it."""
        try:
            kind, payload = self._wire.receive(self._deadline)
            while kind in (MESSAGE, NUMBER_OF, TEXT_OF):
                self._take(kind, payload)
                kind, payload = self._wire.receive(self._deadline)
        except TimeoutError:
            if self._process.poll() is not None:
                self._fail(self._ending())
            self._kill()
            self._fail(f"did not return within {self._current_limit:g} s")
        except OSError:
            self._fail(self._ending())
        except BaseException:
            self._kill()
            raise
        if kind == DONE:
            return payload
        raise read_failure(payload, self.name)

    def _take(self, kind: int, payload: bytes) -> None:
        """Keep a message, or answer a question."""
        if kind == NUMBER_OF:
            number = number_of(payload.decode("utf-8", "surrogatepass"))
            self._wire.send(kind, NUMBER.pack(number), self._deadline)
            return
        if kind == TEXT_OF:
            text = text_of(*NUMBER.unpack(payload))
            self._wire.send(kind, text.encode("utf-8", "surrogatepass"), self._deadline)
            return
        instant, level, source, text = json.loads(payload)
        self._messages.append(Message(float(instant), str(level), str(source), str(text)))
        if level != "info":
            self._said.append(one_line(str(text)))

    def _ending(self) -> str:
        """Return how the process ended, which has closed its connection."""
        try:
            status = self._process.wait(1.0)
        except subprocess.TimeoutExpired:
            self._kill()
            return "closed the connection to the run"
        if status >= 0:
            return f"ended the process with exit status {status}"
        number = -status
        name = signal.Signals(number).name if number in set(signal.Signals) else f"signal {number}"
        return f"crashed: {name} ({signal.strsignal(number)})"

    def _fail(self, what: str) -> NoReturn:
        instant, action = self._time, self._action
        if not action:
            doing = int(self._doing[self._start.index])
            action = _IN_STEP[doing]
            instant = (self._set_at, self._step_at, instant)[doing]
        said = "; ".join(dict.fromkeys(filter(None, self._said[-2:])))
        text = f"{self.name} failed at t = {instant:.12g} s: {action} {what}{': ' if said else ''}{said}"
        raise ComponentError(text, component=self.name, time=instant, call=action) from None

    def _kill(self) -> None:
        """End the process, and what it has started, whatever it is doing."""
        self._wire.close()
        if self._process.returncode is None:
            end_session(self._process.pid)
            self._process.wait()
