"""Moves the values of one component between the value vector and its FMU, through preallocated buffers."""

import ctypes
import math
from collections.abc import Callable
from typing import NoReturn

from .component import Instance
from .execution import Vector
from .schedule import ComponentPorts, Group


class InputGroup:
    """Inputs of one type, and the function that sets them."""

    def __init__(self, group: Group, instance: Instance):
        size = len(group.references)
        setter = instance.setter(group.type)
        self.type = group.type
        self.function = setter.name
        self.call = setter.call
        self.convert: Callable[[float], float] = float if group.type == "Real" else int
        self.first = group.first
        self.value_references: list[int] = group.references.tolist()
        self.last: list[float | None] = [None] * size
        self.references = (ctypes.c_uint * size)()
        self.buffer = (setter.element * size)()


class OutputGroup:
    """Variables of one type that are read, and the function that gets them."""

    def __init__(self, group: Group, instance: Instance, values: Vector):
        size = len(group.references)
        getter = instance.getter(group.type)
        self.type = group.type
        self.function = getter.name
        self.call = getter.call
        self.real = group.type == "Real"
        self.first = group.first
        self.size = size
        self.value_references: list[int] = group.references.tolist()
        self.references = (ctypes.c_uint * size)(*self.value_references)
        kind = getter.element
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
        self.inputs = [InputGroup(group, instance) for group in ports.inputs]
        self.outputs = [OutputGroup(group, instance, values) for group in ports.outputs]
        self._input_values = [OutputGroup(group, instance, values) for group in ports.inputs]

    def read_inputs(self) -> None:
        """Read the inputs' start values from the FMU into the vector; they count as set."""
        self._get(self._input_values)
        for group in self.inputs:
            group.last = list(self._values[group.first : group.first + len(group.last)])

    def forget_inputs(self) -> None:
        """Set all inputs next time: the instance has been put back."""
        for group in self.inputs:
            group.last = [None] * len(group.last)

    def set_inputs(self) -> None:
        """Set the inputs that changed since they were last set."""
        values, handle = self._values, self.instance.handle
        for group in self.inputs:
            last, references, buffer = group.last, group.references, group.buffer
            count = 0
            column = group.first
            for i in range(len(last)):
                value = values[column + i]
                if value != last[i]:
                    last[i] = value
                    references[count] = group.value_references[i]
                    buffer[count] = group.convert(value)
                    count += 1
            if count:
                status = group.call(handle, references, count, buffer)
                if status:
                    self.instance.check(group.function, status)

    def get_outputs(self) -> None:
        """Read all outputs into the vector; a Real that is not finite is a failure."""
        self._get(self.outputs)

    def _get(self, groups: list[OutputGroup]) -> None:
        values, handle = self._values, self.instance.handle
        for group in groups:
            status = group.call(handle, group.references, group.size, group.buffer)
            if status:
                self.instance.check(group.function, status)
            if not group.real:
                values[group.first : group.first + group.size] = group.buffer[:]
            elif not all(map(math.isfinite, group.buffer)):
                self.refuse(group)

    def refuse(self, group: OutputGroup) -> NoReturn:
        """Raise the failure of a Real that is not finite."""
        variables = {
            v.reference: v.name for v in self.instance.component.fmu.variables.values() if v.recorded_type == "Real"
        }
        reference, value = next(
            (r, v) for r, v in zip(group.references, group.buffer, strict=True) if not math.isfinite(v)
        )
        raise self.instance.failure(group.function, f"gave {variables[reference]} = {value}, which is not finite")
