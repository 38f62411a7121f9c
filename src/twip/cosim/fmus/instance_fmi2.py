"""An instance of an FMI 2.0 co-simulation FMU."""

import ctypes
import math
from typing import Any

from fmpy.fmi2 import FMU2Slave, fmi2Boolean, fmi2FMUstate, fmi2Real

from ..values.types import TYPES
from .access import Access
from .component import DISCARD, Instance
from .messages import Callbacks

_LAST_SUCCESSFUL_TIME, _TERMINATED = 2, 3


class Fmi2Instance(Instance):
    """Life cycle and functions of FMI 2.0.4 sections 2.1 and 4.2."""

    version = "fmi2"
    _instantiation = "fmi2Instantiate"

    def _load(self) -> Any:
        fmu = self.component.fmu
        slave = FMU2Slave(
            guid=fmu.guid,
            modelIdentifier=fmu.model_identifier,
            unzipDirectory=str(self._folder),
            instanceName=self.name,
        )
        self._do_step = slave._functions["fmi2DoStep"]
        return slave

    def _instantiate(self) -> None:
        # pythonfmu passes messages as formats without arguments: a `%s` in one would crash the process if expanded
        self._callbacks = Callbacks(self._receive, formatted=not self._stays_loaded)
        self.slave.instantiate(callbacks=self._callbacks.struct, loggingOn=True)

    def setup(self, start_time: float, stop_time: float) -> None:
        """Apply the start values and enter initialization mode; times in s."""
        self.call("fmi2SetupExperiment", 0, 0.0, start_time, 1, stop_time)
        for start in self.component.start_values:
            self.set_value(start)
        self.call("fmi2EnterInitializationMode")

    def _access(self, verb: str, type_: str) -> Access:
        name = f"fmi2{verb}{type_}"
        return Access(name, self._function(name), TYPES[type_].fmi2_type, counts_values=False)

    @property
    def stepper(self) -> int:
        """The address of fmi2DoStep."""
        return ctypes.cast(self._do_step, ctypes.c_void_p).value or 0

    def step(self, time: float, step_size: float) -> None:
        """Advance from `time` by `step_size`, both in s."""
        status = self._do_step(self.handle, time, step_size, not self.goes_back)
        if status:
            self.check_step(status)

    def check_step(self, status: int) -> None:
        """Raise `ComponentError` unless a step with this status has succeeded; that of a discarded one says how far it
        came, if the FMU tells; `EndRequestedError` if the FMU wants no further step (FMI 2.0.4 section 4.2.3).
        """
        if status != DISCARD:
            super().check_step(status)
            return
        self._status = max(self._status, status)
        time = fmi2Real(math.nan)
        asked = self._function("fmi2GetRealStatus")(self.handle, _LAST_SUCCESSFUL_TIME, ctypes.byref(time))
        known = asked in (0, 1) and math.isfinite(time.value)
        ended = fmi2Boolean(0)
        asked = self._function("fmi2GetBooleanStatus")(self.handle, _TERMINATED, ctypes.byref(ended))
        # pythonfmu says so of every step that its Python code calls failed
        if asked in (0, 1) and ended.value and not self._stays_loaded:
            raise self.end_request(time.value if known else None)
        failure = self.failure(
            "fmi2DoStep", f"returned discard{f' (computed until t = {time.value:.12g} s)' if known else ''}"
        )
        failure.repeatable = True
        raise failure

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

    def _unload(self) -> None:
        self._callbacks.close()
        super()._unload()
