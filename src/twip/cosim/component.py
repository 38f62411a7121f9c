"""One FMU instance: its life cycle, and its failures told in one line."""

import atexit
import ctypes
import os
import pathlib

import numpy as np
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave, fmi2Boolean, fmi2FMUstate, fmi2Integer, fmi2Real, fmi2String, fmi2ValueReference
from numpy.typing import NDArray

from ..errors import TwipError
from .messages import LEVELS, Callbacks, Message
from .parameters import StartValue
from .system import Component

STATUS = ("ok", "warning", "discard", "error", "fatal", "pending")
_ERROR, _FATAL = 3, 4
C_TYPES = {
    "Real": fmi2Real,
    "Integer": fmi2Integer,
    "Boolean": fmi2Boolean,
    "String": fmi2String,
    "Enumeration": fmi2Integer,
}
_guarded: dict[str, ctypes.CDLL] = {}


class ComponentError(TwipError):
    """A component failed; the message names it, the simulated time, the function, and what the FMU itself said."""


def _guard_exit(library: str) -> bool:
    """Shut a pythonfmu library down before the process exits, once per library; False for other libraries.

    The destructor of such a library touches memory that `exit()` has already destroyed and aborts now and then. Calling
    its own `finalizePythonInterpreter` while Python still lives prevents this. The library must then stay loaded.
    """
    if library not in _guarded:
        loaded = ctypes.CDLL(library)
        if not hasattr(loaded, "finalizePythonInterpreter"):
            return False
        atexit.register(loaded.finalizePythonInterpreter)
        _guarded[library] = loaded
    return True


def _one_line(text: str) -> str:
    """Return a message without its line breaks, and of a Python traceback only what comes before it and its last
    line.
    """
    before, traceback, after = text.partition("Traceback (most recent call last)")
    if traceback:
        text = f"{before} {(after.strip().splitlines() or [''])[-1]}"
    return " ".join(text.split())


class Instance:
    """An instance of a component's FMU. After a fatal status no function of its FMU is called any more."""

    def __init__(
        self,
        component: Component,
        folder: pathlib.Path,
        messages: list[Message],
        dead: set[pathlib.Path],
        clock: NDArray[np.float64],
    ):
        """Load the library from the unpacked FMU in `folder` and instantiate.

        Messages are appended to `messages`, stamped with the simulated time in `clock` (1,). `dead`, shared by the
        instances of a run, collects the folders of FMUs of which some instance returned fatal: FMI 2.0.4 section 2.1.3
        forbids every further call to any instance of such an FMU.
        """
        self.name = component.name
        self.component = component
        self._clock = clock
        self._folder = folder
        self._dead = dead
        self._messages = messages
        self._said: list[tuple[int, str]] = []
        self._initialized = False
        self._freed = False
        self._status = 0
        self.handle: int | None = None
        here = os.getcwd()
        try:
            self.slave = FMU2Slave(
                guid=component.fmu.guid,
                modelIdentifier=component.fmu.model_identifier,
                unzipDirectory=str(folder),
                instanceName=component.name,
            )
        except Exception as error:  # fmpy raises bare exceptions; a missing function is an AttributeError
            raise ComponentError(
                f"{self.name}: {component.fmu.name} cannot be loaded: {' '.join(str(error).split())}"
            ) from None
        finally:
            os.chdir(here)
        self._stays_loaded = _guard_exit(self.slave.dll._name)
        # pythonfmu passes messages as formats without arguments: a `%s` in one would crash the process if expanded
        self._callbacks = Callbacks(self._receive, formatted=not self._stays_loaded)
        try:
            self.slave.instantiate(callbacks=self._callbacks.struct, loggingOn=True)
        except Exception:  # fmpy raises a bare exception when the FMU returns no instance
            failure = self.failure("fmi2Instantiate", "returned no instance")
            self._unload()
            raise failure from None
        self.handle = self.slave.component

    @property
    def _time(self) -> float:
        return float(self._clock[0])

    def _receive(self, status: int, text: str) -> None:
        self._said = [*self._said[-9:], (status, text)]
        level = LEVELS[status] if 0 <= status < len(LEVELS) else "error"
        self._messages.append(Message(self._time, level, self.name, text))

    def failure(self, function: str, what: str) -> ComponentError:
        """Return the exception for a failed call, with the last lines that the FMU logged."""
        texts = [text for status, text in self._said if status > 0] or [text for _, text in self._said[-1:]]
        lines = dict.fromkeys(line for text in texts[-2:] if (line := _one_line(text)))
        said = f": {'; '.join(lines)}" if lines else ""
        return ComponentError(f"{self.name} failed at t = {self._time:.12g} s: {function} {what}{said}")

    def check(self, function: str, status: int) -> None:
        """Raise `ComponentError` unless `status` is ok or warning."""
        if 0 <= status <= 1:
            self._said.clear()
            return
        self._status = max(self._status, status)
        if status == _FATAL:
            self._dead.add(self._folder)
        raise self.failure(function, f"returned {STATUS[status] if 0 <= status < len(STATUS) else status}")

    def call(self, function: str, *arguments: object) -> None:
        """Call one of fmpy's methods of the same life-cycle step, checking its status."""
        try:
            getattr(self.slave, function)(self.handle, *arguments)
        except FMICallException as error:
            self.check(function, error.status)

    def set_start_value(self, start: StartValue) -> None:
        """Set a variable before initialization."""
        kind = "Integer" if start.variable.type == "Enumeration" else start.variable.type
        value = start.value.encode() if isinstance(start.value, str) else start.value
        array = (C_TYPES[kind] * 1)(value)
        self.call(f"fmi2Set{kind}", (fmi2ValueReference * 1)(start.variable.reference), 1, array)

    def get_string(self, reference: int) -> str:
        """Return the value of a String."""
        text = (fmi2String * 1)()
        self.call("fmi2GetString", (fmi2ValueReference * 1)(reference), 1, text)
        return (text[0] or b"").decode("utf-8", "replace")

    def setup(self, start_time: float, stop_time: float) -> None:
        """Apply the start values and enter initialization mode."""
        self.call("fmi2SetupExperiment", 0, 0.0, start_time, 1, stop_time)
        for start in self.component.start_values:
            self.set_start_value(start)
        self.call("fmi2EnterInitializationMode")

    def finish_initialization(self) -> None:
        """Leave initialization mode: the instance may be stepped."""
        self.call("fmi2ExitInitializationMode")
        self._initialized = True

    def save_state(self) -> bytes:
        """Return the serialized state between two steps."""
        state, size = fmi2FMUstate(), ctypes.c_size_t()
        self.call("fmi2GetFMUstate", ctypes.byref(state))
        try:
            self.call("fmi2SerializedFMUstateSize", state, ctypes.byref(size))
            buffer = ctypes.create_string_buffer(size.value)
            self.call("fmi2SerializeFMUstate", state, buffer, size)
        finally:
            self._free_state(state)
        return buffer.raw

    def restore_state(self, data: bytes) -> None:
        """Take over a state that `save_state` of an instance of the same FMU has returned."""
        state, buffer = fmi2FMUstate(), ctypes.create_string_buffer(data, len(data))
        try:
            self.call("fmi2DeSerializeFMUstate", buffer, len(data), ctypes.byref(state))
            self.call("fmi2SetFMUstate", state)
        finally:
            self._free_state(state)

    def _free_state(self, state: ctypes.c_void_p) -> None:
        if state.value is not None and self._folder not in self._dead:
            self.call("fmi2FreeFMUstate", ctypes.byref(state))

    def close(self) -> None:
        """Terminate and free what the FMI state machine allows; failures here are only logged."""
        if self._freed:
            return
        self._freed = True
        if self.handle is not None and self._folder not in self._dead:
            try:
                if self._initialized and self._status < _ERROR:
                    self.slave.fmi2Terminate(self.handle)
            except FMICallException as error:
                self._messages.append(
                    Message(self._time, "warning", self.name, f"fmi2Terminate returned {STATUS[error.status]}")
                )
                if error.status == _FATAL:
                    self._dead.add(self._folder)
            if self._folder not in self._dead:
                self.slave.fmi2FreeInstance(self.handle)
        self._unload()

    def _unload(self) -> None:
        self._callbacks.close()
        if not self._stays_loaded and self._folder not in self._dead:
            self.slave.freeLibrary()
