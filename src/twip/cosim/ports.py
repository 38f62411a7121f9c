"""Moves the values of one component between the value vector and its FMU, through preallocated buffers."""

import ctypes
import math
from collections.abc import Callable

from fmpy.fmi2 import fmi2ValueReference

from twip.cosim.component import C_TYPES, Instance
from twip.cosim.schedule import ComponentPorts, Group

Vector = ctypes.Array[ctypes.c_double]


class _InputGroup:
    def __init__(self, group: Group, slave: object):
        size = len(group.references)
        self.function = f"fmi2Set{group.type}"
        self.set: Callable[..., int] = getattr(slave, "_functions")[self.function]  # noqa: B009
        self.convert: Callable[[float], float] = float if group.type == "Real" else int
        self.first = group.first
        self.all_references = group.references.tolist()
        self.last: list[float | None] = [None] * size
        self.references = (fmi2ValueReference * size)()
        self.buffer = (C_TYPES[group.type] * size)()


class _OutputGroup:
    def __init__(self, group: Group, slave: object, values: Vector):
        size = len(group.references)
        self.function = f"fmi2Get{group.type}"
        self.get: Callable[..., int] = getattr(slave, "_functions")[self.function]  # noqa: B009
        self.real = group.type == "Real"
        self.first = group.first
        self.size = size
        self.references = (fmi2ValueReference * size)(*group.references.tolist())
        kind = C_TYPES[group.type]
        # Reals are read straight into the vector
        self.buffer = (
            (kind * size).from_buffer(values, group.first * ctypes.sizeof(ctypes.c_double))
            if self.real
            else (kind * size)()
        )


class Ports:
    """The inputs and outputs of one instance."""

    def __init__(self, ports: ComponentPorts, instance: Instance, values: Vector):
        self.instance = instance
        self._values = values
        self._inputs = [_InputGroup(group, instance.slave) for group in ports.inputs]
        self._outputs = [_OutputGroup(group, instance.slave, values) for group in ports.outputs]
        self._input_values = [_OutputGroup(group, instance.slave, values) for group in ports.inputs]
        self._do_step: Callable[..., int] = instance.slave._functions["fmi2DoStep"]

    def read_inputs(self) -> None:
        """Read the inputs' start values from the FMU into the vector; they count as set."""
        self._get(self._input_values)
        for group in self._inputs:
            group.last = list(self._values[group.first : group.first + len(group.last)])

    def set_inputs(self) -> None:
        """Set the inputs that changed since they were last set."""
        values, handle = self._values, self.instance.handle
        for group in self._inputs:
            last, references, buffer = group.last, group.references, group.buffer
            count = 0
            column = group.first
            for i in range(len(last)):
                value = values[column + i]
                if value != last[i]:
                    last[i] = value
                    references[count] = group.all_references[i]
                    buffer[count] = group.convert(value)
                    count += 1
            if count:
                status = group.set(handle, references, count, buffer)
                if status:
                    self.instance.check(group.function, status)

    def get_outputs(self) -> None:
        """Read all outputs into the vector; a Real that is not finite is a failure."""
        self._get(self._outputs)

    def _get(self, groups: list[_OutputGroup]) -> None:
        values, handle = self._values, self.instance.handle
        for group in groups:
            status = group.get(handle, group.references, group.size, group.buffer)
            if status:
                self.instance.check(group.function, status)
            if not group.real:
                values[group.first : group.first + group.size] = group.buffer[:]
            elif not all(map(math.isfinite, group.buffer)):
                self._refuse(group)

    def _refuse(self, group: _OutputGroup) -> None:
        variables = {
            v.reference: v.name for v in self.instance.component.fmu.variables.values() if v.recorded_type == "Real"
        }
        reference, value = next(
            (r, v) for r, v in zip(group.references, group.buffer, strict=True) if not math.isfinite(v)
        )
        raise self.instance.failure(group.function, f"gave {variables[reference]} = {value}, which is not finite")

    def step(self, time: float, step_size: float) -> None:
        """Advance the instance from `time` by `step_size`, both in s."""
        status = self._do_step(self.instance.handle, time, step_size, 1)
        if status:
            self.instance.check("fmi2DoStep", status)
