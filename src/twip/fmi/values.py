"""The values of one block instance, and the block's functions bound to them: in plain Python, or compiled."""

import ctypes
from collections.abc import Callable, Sequence
from functools import partial
from struct import Struct
from typing import Any, Protocol

from ..robot.kernel import COMPILES, ENTERED, WAITING
from .table import Table, getter

_STEP = ctypes.PYFUNCTYPE(ctypes.c_int32, ctypes.c_int64, ctypes.c_double, ctypes.c_double, ctypes.c_int32)
"""The compiled step: address of the values, time, step size, and a number that FMI passes on."""


class Values(Protocol):
    """Values as attributes of `v`, every one a float, parameters and inputs at their start in the beginning."""

    v: Any
    gate: Any
    """One number (1,) that lets native steps pass or not; see `kernel`."""
    reached: Any
    """One number (1,): the time in s at the end of the last step, 0 before the first."""
    native: tuple[int, ...]
    """Addresses of the values and of the compiled step; empty where nothing is compiled."""

    def initialize(self, time: float) -> None:
        """Run the block's initialization."""

    def advance(self, time: float, step_size: float) -> bool:
        """Run the block's step; False tells that an output may be infinite or not a number."""

    def reader(self, references: Sequence[int]) -> Callable[[], list[float]]:
        """Return a function that reads the values behind value references."""

    def writer(self, references: Sequence[int]) -> Callable[[Sequence[float]], bool]:
        """Return a function that writes the values behind value references; False: not done, one may not be finite."""


class PlainValues:
    """Values in the slots of an object, on which the block's functions run as plain Python."""

    def __init__(self, table: Table):
        self.v = table.start_values(table.slots())
        self.gate: Any = [WAITING]
        self.reached: Any = [0.0]
        self.native: tuple[int, ...] = ()
        self._table = table
        self._outputs = getter(tuple(v.attribute for v in table.outputs))

    def initialize(self, time: float) -> None:
        """Run the block's initialization."""
        self._table.block.initialize(self.v, time)

    def advance(self, time: float, step_size: float) -> bool:
        """Run the block's step; False tells that an output may be infinite or not a number."""
        self._table.block.step(self.v, time, step_size)
        self.reached[0] = time + step_size
        total = sum(self._outputs(self.v))
        return total - total == 0.0

    def reader(self, references: Sequence[int]) -> Callable[[], list[float]]:
        """Return a function that reads the values behind value references."""
        v, read = self.v, getter(tuple(self._table.attributes[r] for r in references))
        return lambda: list(read(v))

    def writer(self, references: Sequence[int]) -> Callable[[Sequence[float]], bool]:
        """Return a function that writes the values behind value references; False: not done, one may not be finite."""
        v, attributes = self.v, tuple(self._table.attributes[r] for r in references)

        def write(values: Sequence[float]) -> bool:
            total = sum(values)
            if total - total != 0.0:
                return False
            for attribute, value in zip(attributes, values, strict=True):
                setattr(v, attribute, value)
            return True

        return write


class CompiledValues:
    """Values side by side in memory, on which the block's functions run compiled."""

    def __init__(self, table: Table):
        size = len(table.attributes)
        fields = [(attribute, ctypes.c_double) for attribute in (*table.attributes, "gate ", "reached ")]
        self.v = table.start_values(type("Values", (ctypes.Structure,), {"_fields_": fields})())
        self._memory: Any = memoryview(self.v).cast("B").cast("d")
        self.gate: Any = self._memory[size : size + 1]
        self.reached: Any = self._memory[size + 1 :]
        self.gate[0] = WAITING
        address, step = ctypes.addressof(self.v), table.compiled_step()
        self.native: tuple[int, ...] = (address, step)
        self._step = partial(_STEP(step), address)
        self._table = table

    def initialize(self, time: float) -> None:
        """Run the block's initialization."""
        self._table.block.initialize(self.v, time)

    def advance(self, time: float, step_size: float) -> bool:
        """Run the block's step; False tells that an output may be infinite or not a number."""
        if self._step(time, step_size, 1) == 0:
            return True
        if self.gate[0] == ENTERED:  # an exception, which could not leave the compiled step: raise it here
            self._table.block.step(self.v, time, step_size)
            raise ArithmeticError("the compiled step failed")
        return False

    def reader(self, references: Sequence[int]) -> Callable[[], list[float]]:
        """Return a function that reads the values behind value references."""
        memory, wanted, first = self._memory, tuple(references), references[0]
        if wanted == tuple(range(first, first + len(wanted))):
            read: Callable[[], list[float]] = memory[first : first + len(wanted)].tolist
            return read
        return lambda: [memory[r] for r in wanted]

    def writer(self, references: Sequence[int]) -> Callable[[Sequence[float]], bool]:
        """Return a function that writes the values behind value references; False: not done, one may not be finite."""
        memory, wanted, first = self._memory, tuple(references), references[0]
        side_by_side = wanted == tuple(range(first, first + len(wanted)))
        offset, pack_into = 8 * first, Struct(f"{len(wanted)}d").pack_into

        def write(values: Sequence[float]) -> bool:
            total = sum(values)
            if total - total != 0.0:
                return False
            if side_by_side:
                pack_into(memory, offset, *values)
            else:
                for reference, value in zip(wanted, values, strict=True):
                    memory[reference] = value
            return True

        return write


def new_values(table: Table) -> Values:
    """Return the values of a new instance: compiled where that pays and numba can keep what it compiles."""
    if COMPILES and not table.why_plain:
        try:
            return CompiledValues(table)
        except OSError as error:  # a full disk; every further instance would try again for as long
            table.why_plain = f"numba's cache cannot be written ({error.strerror or error})"
    return PlainValues(table)
