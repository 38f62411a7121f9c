"""Moves the values of one component between the value vector and its FMU, through preallocated buffers.

What is set on the FMU is what the vector then holds: the value of a Float32 input is rounded to the nearest number of
32 bits, one that is no value of its type is a failure.
"""

import ctypes
import math
from collections.abc import Sequence
from typing import NoReturn

from ..model.schedule import ComponentPorts, Group
from ..model.vector import Vector
from ..values.types import EXACT, misfit, to_float32
from .component import Instance


class InputGroup:
    """Inputs of one type, and the function that sets them."""

    def __init__(self, group: Group, instance: Instance):
        setter = instance.setter(group.type)
        self.type = group.type
        self.function = setter.name
        self.call = setter.call
        self.counts_values = setter.counts_values
        self.direct = setter.element is ctypes.c_double
        self.first = group.first
        self.size = len(group.names)
        self.names = group.names
        self.value_references: list[int] = group.references.tolist()
        self.sizes: list[int] = group.sizes.tolist()
        self.scalars = len(self.sizes) == self.size
        self.rounded = group.type == "Float32"
        self.last: list[float | None] = [None] * self.size
        self.references = (ctypes.c_uint * len(self.sizes))()
        self.buffer = (setter.element * self.size)()


class OutputGroup:
    """Variables of one type that are read, and the function that gets them."""

    def __init__(self, group: Group, instance: Instance, values: Vector):
        getter = instance.getter(group.type)
        self.type = group.type
        self.function = getter.name
        self.call = getter.call
        self.counts_values = getter.counts_values
        self.direct = getter.element is ctypes.c_double
        self.first = group.first
        self.size = len(group.names)
        self.names = group.names
        self.value_references: list[int] = group.references.tolist()
        self.sizes: list[int] = group.sizes.tolist()
        self.references = (ctypes.c_uint * len(self.sizes))(*self.value_references)
        kind = getter.element
        # what is float64 is read straight into the vector
        self.buffer = (
            (kind * self.size).from_buffer(values, group.first * ctypes.sizeof(ctypes.c_double))
            if self.direct
            else (kind * self.size)()
        )
        self._arguments = (self.references, len(self.sizes), self.buffer, *([self.size] * self.counts_values))

    def read(self, handle: int | None) -> int:
        """Get the values into the buffer; return the FMI status."""
        return self.call(handle, *self._arguments)


class Ports:
    """The inputs and outputs of one instance."""

    def __init__(self, ports: ComponentPorts, instance: Instance, values: Vector):
        self.instance = instance
        self._plan, self._values = ports, values
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
        """Set the inputs that changed since they were last set; of an array all elements if one changed."""
        for group in self.inputs:
            count, sizes = self._collect_scalars(group) if group.scalars else self._collect(group)
            if count:
                status = group.call(self.instance.handle, group.references, count, group.buffer, *sizes)
                if status:
                    self.instance.check(group.function, status)

    def _collect_scalars(self, group: InputGroup) -> tuple[int, tuple[int, ...]]:
        """Buffer what changed; return the number of variables and, where it is wanted, of values."""
        values, last, references, buffer = self._values, group.last, group.references, group.buffer
        rounded, direct, column = group.rounded, group.direct, group.first
        count = 0
        for i in range(len(last)):
            value = values[column + i]
            if rounded:
                value = values[column + i] = to_float32(value)
            if value != last[i]:
                last[i] = value
                references[count] = group.value_references[i]
                buffer[count] = value if direct else self._fitted(group, i)
                count += 1
        return count, (count,) if group.counts_values else ()

    def _collect(self, group: InputGroup) -> tuple[int, tuple[int, ...]]:
        values, last, buffer = self._values, group.last, group.buffer
        count = total = end = 0
        for reference, size in zip(group.value_references, group.sizes, strict=True):
            begin, end = end, end + size
            columns = slice(group.first + begin, group.first + end)
            if group.rounded:
                values[columns] = [to_float32(value) for value in values[columns]]
            new = values[columns]
            if new != last[begin:end]:
                last[begin:end] = new
                group.references[count] = reference
                buffer[total : total + size] = (
                    new if group.direct else [self._fitted(group, i) for i in range(begin, end)]
                )
                count += 1
                total += size
        return count, (total,)

    def _fitted(self, group: InputGroup, position: int) -> float:
        value = self._values[group.first + position]
        if misfit(group.type, value):
            self.refuse_input(group)
        return value if group.rounded else int(value)

    def get_some(self, columns: Sequence[int]) -> None:
        """Read the outputs with these columns into the vector."""
        wanted = set(columns)
        if len(wanted) == sum(group.size for group in self.outputs):
            return self.get_outputs()
        parts = [part for group in self._plan.outputs for part in group.parts(wanted)]
        return self._get([OutputGroup(part, self.instance, self._values) for part in parts])

    def ask_outputs(self) -> None:
        """Do nothing: what was due is done already."""

    def get_outputs(self) -> None:
        """Read all outputs into the vector; one that is not finite or not exact there is a failure."""
        self._get(self.outputs)

    def _get(self, groups: list[OutputGroup]) -> None:
        values, handle = self._values, self.instance.handle
        for group in groups:
            status = group.read(handle)
            if status:
                self.instance.check(group.function, status)
            if group.type in ("Real", "Float32"):
                if not all(map(math.isfinite, group.buffer)):
                    self.refuse(group)
            elif group.type in ("Int64", "UInt64") and not (-EXACT <= min(group.buffer) <= max(group.buffer) <= EXACT):
                self.refuse(group)
            if not group.direct:
                values[group.first : group.first + group.size] = group.buffer[:]

    def refuse(self, group: OutputGroup) -> NoReturn:
        """Raise the failure of a value in the buffer that cannot be used."""
        for name, value in zip(group.names, group.buffer, strict=True):
            if why := misfit(group.type, value):
                failure = self.instance.failure(group.function, f"gave {name} = {value}, {why}")
                failure.repeatable = True
                raise failure
        raise RuntimeError(f"{group.function} gave nothing that is wrong")

    def refuse_input(self, group: InputGroup) -> NoReturn:
        """Raise the failure of a value that an input cannot take."""
        for name, value in zip(group.names, self._values[group.first : group.first + group.size], strict=True):
            if why := misfit(group.type, value):
                raise self.instance.failure(group.function, f"cannot take {name} = {value}, {why}")
        raise RuntimeError(f"{group.function} was given nothing that is wrong")
