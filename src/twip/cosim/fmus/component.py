"""One FMU instance: its life cycle, and its failures told in one line. What differs between the versions of FMI is in
`instance_fmi2` and `instance_fmi3`.
"""

import atexit
import ctypes
import os
import pathlib
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import Problem, TwipError
from ..model.message import Message
from ..model.system import Component
from ..values.strings import number_of, text_of
from ..values.variable import Variable
from ..values.written import StartValue, Value
from .access import Access, text_getter, text_setter
from .messages import LEVELS
from .sudden_end import watch

STATUS = ("ok", "warning", "discard", "error", "fatal", "pending")
UNFIT = 100
"""Status beyond those of FMI: the call itself succeeded, and what it returned cannot be used."""
DISCARD, _ERROR, _FATAL = 2, 3, 4
_guarded: dict[str, ctypes.CDLL] = {}


class ComponentError(TwipError):
    """A component failed; the message names it, the simulated time, the function, and what the FMU itself said."""

    def __init__(
        self,
        problems: str | Problem | Iterable[str | Problem] = (),
        *,
        component: str = "",
        time: float | None = None,
        call: str = "",
        repeatable: bool = False,
    ):
        super().__init__(problems)
        self.component = component
        """Name of the component."""
        self.time = time
        """Simulated time of the call in s, None before there is one."""
        self.call = call
        """The function of FMI that failed, or what was being done; empty where it is none."""
        self.repeatable = repeatable
        """Whether a smaller step from an earlier state may succeed."""


class EndRequestedError(ComponentError):
    """A component asks to end the simulation, which is no failure; the step that it was asked in is not done."""


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


def one_line(text: str) -> str:
    """Return a message without its line breaks, and of a Python traceback only what comes before it and its last
    line.
    """
    before, traceback, after = text.partition("Traceback (most recent call last)")
    if traceback:
        text = f"{before} {(after.strip().splitlines() or [''])[-1]}"
    return " ".join(text.split())


class Instance(ABC):
    """An instance of a component's FMU. After a fatal status no function of its FMU is called any more."""

    version: str
    """What the functions of this version of FMI begin with."""
    slave: Any
    """fmpy's object with the FMU's functions."""
    handle: int | None = None
    """Address of the instance within the FMU."""
    goes_back: bool = False
    """Whether the instance may be put back to a time before the last step's beginning; its FMU is told so."""

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
        and FMI 3.0.1 section 2.2.3 forbid every further call to any instance of such an FMU.
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
        here = os.getcwd()
        try:
            self.slave = self._load()
        except Exception as error:  # fmpy raises bare exceptions; a missing function is an AttributeError
            raise ComponentError(
                f"{self.name}: {component.fmu.name} cannot be loaded: {' '.join(str(error).split())}",
                component=self.name,
            ) from None
        finally:
            os.chdir(here)
        watch(self.slave.dll._handle, folder)
        self._stays_loaded = _guard_exit(self.slave.dll._name)
        try:
            self._instantiate()
        except Exception:  # fmpy raises a bare exception when the FMU returns no instance
            failure = self.failure(self._instantiation, "returned no instance")
            self._unload()
            raise failure from None
        self.handle = self.slave.component

    _instantiation: str
    """Name of the function that makes the instance."""

    @abstractmethod
    def _load(self) -> Any:
        """Return fmpy's object for the FMU in the folder."""

    @abstractmethod
    def _instantiate(self) -> None:
        """Create the instance within the FMU; what it logs goes to `_receive`."""

    @abstractmethod
    def setup(self, start_time: float, stop_time: float) -> None:
        """Apply the start values and enter initialization mode; times in s."""

    @abstractmethod
    def _access(self, verb: str, type_: str) -> Access:
        """Return the FMU's function that gets or sets (`verb`) variables of a type."""

    def getter(self, type_: str) -> Access:
        """Return the function that gets variables of a type."""
        access = self._access("Get", type_)
        return text_getter(access) if type_ == "String" else access

    def setter(self, type_: str) -> Access:
        """Return the function that sets variables of a type."""
        access = self._access("Set", type_)
        return text_setter(access) if type_ == "String" else access

    @property
    @abstractmethod
    def stepper(self) -> int:
        """What the compiled loop needs to do a step: the address of fmi2DoStep, or the negative address of a block of
        memory that `instance_fmi3` describes.
        """

    @abstractmethod
    def step(self, time: float, step_size: float) -> None:
        """Advance from `time` by `step_size`, both in s."""

    @abstractmethod
    def save_state(self) -> bytes:
        """Return the serialized state between two steps."""

    @abstractmethod
    def restore_state(self, data: bytes) -> None:
        """Take over a state that `save_state` of an instance of the same FMU has returned."""

    def expect_rollback(self) -> None:
        """Be ready to be put back to a time before the last step's beginning."""
        self.goes_back = True

    def set_value(self, start: StartValue) -> None:
        """Set a variable before initialization, or a tunable parameter between two steps."""
        self.set_values(start.variable, [start.value])

    def set_values(self, variable: Variable, values: Sequence[Value]) -> None:
        """Set all values of the variable, of an array all elements."""
        setter = self.setter(variable.recorded_type)
        array = (setter.element * len(values))(*(number_of(v) if isinstance(v, str) else v for v in values))
        count = [len(values)] * setter.counts_values
        self.check(setter.name, setter.call(self.handle, (ctypes.c_uint * 1)(variable.reference), 1, array, *count))

    def get_string(self, reference: int) -> str:
        """Return the value of a String."""
        getter, number = self.getter("String"), ctypes.c_double()
        self.check(
            getter.name,
            getter.call(self.handle, (ctypes.c_uint * 1)(reference), 1, number, *[1] * getter.counts_values),
        )
        return text_of(number.value)

    def finish_initialization(self) -> None:
        """Leave initialization mode: the instance may be stepped."""
        self.call(f"{self.version}ExitInitializationMode")
        self._initialized = True

    @property
    def folder(self) -> pathlib.Path:
        """Folder of the unpacked FMU."""
        return self._folder

    @property
    def _time(self) -> float:
        return float(self._clock[0])

    def _function(self, name: str) -> Callable[..., int]:
        function: Callable[..., int] = self.slave._functions[name]
        return function

    def _receive(self, status: int, text: str) -> None:
        self._said = [*self._said[-9:], (status, text)]
        level = LEVELS[status] if 0 <= status < len(LEVELS) else "error"
        self._messages.append(Message(self._time, level, self.name, text))

    def failure(self, function: str, what: str) -> ComponentError:
        """Return the exception for a failed call, with the last lines that the FMU logged."""
        texts = [text for status, text in self._said if status > 0] or [text for _, text in self._said[-1:]]
        lines = dict.fromkeys(line for text in texts[-2:] if (line := one_line(text)))
        said = f": {'; '.join(lines)}" if lines else ""
        text = f"{self.name} failed at t = {self._time:.12g} s: {function} {what}{said}"
        return ComponentError(text, component=self.name, time=self._time, call=function)

    def end_request(self, reached: float | None) -> EndRequestedError:
        """Return what the instance asks for, having come to the time `reached` in s if it tells."""
        known = "" if reached is None else f", at t = {reached:.12g} s"
        text = f"{self.name} asked to end the simulation{known}, in the step from t = {self._time:.12g} s"
        call = f"{self.version}DoStep"
        return EndRequestedError(text, component=self.name, time=self._time, call=call, repeatable=True)

    def check(self, function: str, status: int) -> None:
        """Raise `ComponentError` unless `status` is ok or warning."""
        if 0 <= status <= 1:
            self._said.clear()
            return
        self._status = max(self._status, status)
        if status == _FATAL:
            self._dead.add(self._folder)
        failure = self.failure(function, f"returned {STATUS[status] if 0 <= status < len(STATUS) else status}")
        failure.repeatable = status == DISCARD
        raise failure

    def check_step(self, status: int) -> None:
        """Raise `ComponentError` unless a step with this status has succeeded; `UNFIT` needs a closer look."""
        self.check(f"{self.version}DoStep", status)

    def call(self, function: str, *arguments: object) -> None:
        """Call a function of the FMU, checking its status."""
        self.check(function, self.slave._functions[function](self.handle, *arguments))

    @property
    def _state(self) -> str:
        return "FMUstate" if self.version == "fmi2" else "FMUState"

    def keep_state(self) -> int:
        """Return the address of the state between two steps for `return_to`; it must be freed."""
        state = ctypes.c_void_p()
        self.call(f"{self.version}Get{self._state}", ctypes.byref(state))
        return state.value or 0

    def return_to(self, state: int) -> None:
        """Be where `keep_state` returned `state`."""
        self.call(f"{self.version}Set{self._state}", ctypes.c_void_p(state))

    def free_state(self, state: int) -> None:
        """Free what `keep_state` has returned."""
        if state and self._folder not in self._dead:
            self.call(f"{self.version}Free{self._state}", ctypes.byref(ctypes.c_void_p(state)))

    def reset(self) -> bool:
        """Terminate and go back to where instantiation left off; False when the FMU refuses."""
        if self._freed or self._folder in self._dead or self._status >= _ERROR:
            return False
        done = (not self._initialized or self._leave("Terminate")) and self._leave("Reset")
        self._initialized = False
        self._said.clear()
        return done

    def serve(
        self, component: Component, messages: list[Message], dead: set[pathlib.Path], clock: NDArray[np.float64]
    ) -> None:
        """Belong to another run from now on, as `component` of the same FMU and name; see the constructor."""
        self.component, self._messages, self._dead, self._clock = component, messages, dead, clock

    def _leave(self, function: str) -> bool:
        """Call a function that ends a run; False when it fails, which is only logged."""
        try:
            self.call(f"{self.version}{function}")
        except ComponentError as failure:
            self._messages.append(Message(self._time, "warning", "", str(failure)))
            return False
        return True

    def close(self) -> None:
        """Terminate and free what the FMI state machine allows; failures here are only logged."""
        if self._freed:
            return
        self._freed = True
        if self.handle is not None and self._folder not in self._dead:
            if self._initialized and self._status < _ERROR:
                self._leave("Terminate")
            if self._folder not in self._dead:
                getattr(self.slave, f"{self.version}FreeInstance")(self.handle)
        self._unload()

    def _unload(self) -> None:
        if not self._stays_loaded and self._folder not in self._dead:
            self.slave.freeLibrary()
