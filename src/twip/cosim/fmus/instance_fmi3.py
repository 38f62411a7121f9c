"""An instance of an FMI 3.0 co-simulation FMU, without event mode, early return and intermediate updates.

The block of memory that the compiled loop gets for a step: the address of fmi3DoStep, then eventHandlingNeeded,
terminateSimulation, earlyReturn (one byte each) and lastSuccessfulTime (float64), in words of 8 bytes.
"""

import ctypes
from itertools import groupby
from typing import Any

from fmpy.fmi3 import FMU3Slave, fmi3Boolean, fmi3Float64, fmi3FMUState, fmi3ValueReference

from ..values.strings import text_of
from ..values.types import TYPES
from ..values.variable import Variable
from ..values.written import StartValue, Value, parse_value
from .access import Access
from .component import UNFIT, Instance

BLOCK = 5
"""Words of the block."""


class Fmi3Instance(Instance):
    """Life cycle and functions of FMI 3.0.1 sections 2.3 and 4.2."""

    version = "fmi3"
    _instantiation = "fmi3InstantiateCoSimulation"

    def _load(self) -> Any:
        fmu = self.component.fmu
        slave = FMU3Slave(
            guid=fmu.guid,
            modelIdentifier=fmu.model_identifier,
            unzipDirectory=str(self._folder),
            instanceName=self.name,
        )
        self._do_step = slave._functions["fmi3DoStep"]
        self._block = (ctypes.c_int64 * BLOCK)(ctypes.cast(self._do_step, ctypes.c_void_p).value or 0)
        self._event, self._terminate, self._early = (fmi3Boolean.from_buffer(self._block, 8 * i) for i in (1, 2, 3))
        self._reached = fmi3Float64.from_buffer(self._block, 8 * 4)
        self._results = [ctypes.byref(v) for v in (self._event, self._terminate, self._early, self._reached)]
        return slave

    def _instantiate(self) -> None:
        def log(_environment: int | None, status: int, _category: bytes | None, message: bytes | None) -> None:
            self._receive(status, (message or b"").decode("utf-8", "replace"))

        self.slave.instantiate(loggingOn=True, logMessage=log)

    def setup(self, start_time: float, stop_time: float) -> None:
        """Apply the start values and enter initialization mode; times in s."""
        given = {start.variable.name: start.value for start in self.component.start_values}
        arrays = {start.variable.array for start in self.component.start_values}
        wanted = [v for v in self.component.fmu.variables.values() if v.name in given or v.array in arrays - {None}]
        for _, elements in groupby((v for v in wanted if v.alias_of is None), key=lambda v: v.reference):
            self._set_start_values(list(elements), given)
        self.call("fmi3EnterInitializationMode", False, 0.0, start_time, True, stop_time)

    def set_value(self, start: StartValue) -> None:
        """Set a variable from initialization mode on; the other elements of an array keep their values."""
        if start.variable.array is None:
            return super().set_value(start)
        variables = self.component.fmu.variables.values()
        elements = [v for v in variables if v.reference == start.variable.reference and v.alias_of is None]
        getter = self.getter(start.variable.recorded_type)
        array = (getter.element * len(elements))()
        references = (fmi3ValueReference * 1)(start.variable.reference)
        self.check(getter.name, getter.call(self.handle, references, 1, array, len(elements)))
        values: list[Value] = [text_of(v) if start.variable.type == "String" else v for v in array]
        values[elements.index(start.variable)] = start.value
        return self.set_values(start.variable, values)

    def _set_start_values(self, elements: list[Variable], given: dict[str, Value]) -> None:
        """Set a scalar or, as FMI wants it, a whole array: elements that nobody gives a value keep their own."""
        values = [given.get(v.name, parse_value(v.start or "", v.type, v.items)) for v in elements]
        missing = [v.name for v, value in zip(elements, values, strict=True) if value is None]
        if missing:
            raise self.failure("start value", f"of {missing[0]} is not given, and the FMU states none that is valid")
        self.set_values(elements[0], [value for value in values if value is not None])

    def _access(self, verb: str, type_: str) -> Access:
        name = f"fmi3{verb}{TYPES[type_].fmi3}"
        return Access(name, self._function(name), TYPES[type_].fmi3_type, counts_values=True)

    @property
    def stepper(self) -> int:
        """The negative address of the block."""
        return -ctypes.addressof(self._block)

    def step(self, time: float, step_size: float) -> None:
        """Advance from `time` by `step_size`, both in s."""
        self._block[1:4] = [0, 0, 0]
        status = self._do_step(self.handle, time, step_size, not self.goes_back, *self._results)
        if status > 1 or self._terminate.value or self._early.value:
            self.check_step(status if status > 1 else UNFIT)
        elif status:
            self.check_step(status)

    def check_step(self, status: int) -> None:
        """Raise `ComponentError` unless a step with this status has succeeded; `UNFIT` needs a closer look:
        `EndRequestedError` if the FMU wants no further step.
        """
        if status != UNFIT:
            super().check_step(status)
        elif self._terminate.value:
            raise self.end_request(self._reached.value)
        else:
            raise self.failure(
                "fmi3DoStep", f"returned early, at {self._reached.value:.12g} s, which it was not allowed to"
            )

    def save_state(self) -> bytes:
        """Return the serialized state between two steps."""
        state, size = fmi3FMUState(), ctypes.c_size_t()
        self.call("fmi3GetFMUState", ctypes.byref(state))
        try:
            self.call("fmi3SerializedFMUStateSize", state, ctypes.byref(size))
            buffer = (ctypes.c_uint8 * size.value)()
            self.call("fmi3SerializeFMUState", state, buffer, size)
        finally:
            self._free_state(state)
        return bytes(buffer)

    def restore_state(self, data: bytes) -> None:
        """Take over a state that `save_state` of an instance of the same FMU has returned."""
        state, buffer = fmi3FMUState(), (ctypes.c_uint8 * len(data)).from_buffer_copy(data)
        try:
            self.call("fmi3DeserializeFMUState", buffer, len(data), ctypes.byref(state))
            self.call("fmi3SetFMUState", state)
        finally:
            self._free_state(state)

    def _free_state(self, state: ctypes.c_void_p) -> None:
        if state.value is not None and self._folder not in self._dead:
            self.call("fmi3FreeFMUState", ctypes.byref(state))
