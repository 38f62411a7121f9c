"""The flat plan of a step: arrays only, no FMU and no Python object of the system, for the plain and the compiled loop
alike.

All values of the system live in one float64 vector, the recorded row. A step runs stages in order. A stage first does
its copies (`values[destination] = factor * values[source] + offset`, some of them looking ahead), then steps its
components: set inputs, doStep, get outputs. Jacobi has one stage for all components; Gauss–Seidel has one per
component, in feed-through order or one given by hand, so that a copy brings the value of the same step if the source
has run, else of the one before. A last stage without components updates the connectors of the systems.

A component with a step of its own, m communication steps, takes part in every m-th step, the one in which its own step
ends: then it gets its inputs and goes from where it is to the end of that step. Between, its outputs hold.

Iterated coupling has stages like Gauss–Seidel, components of a cycle one after the other; these stages are repeated.
"""

import math
from collections.abc import Container, Iterator
from dataclasses import dataclass
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from ...errors import TwipError
from ..values.transformation import Mapping
from .iteration import Iteration


@dataclass(frozen=True)
class Group:
    """Variables of one type of a component, in consecutive columns."""

    type: str
    """One of `RECORDED_TYPES`."""
    first: int
    """Column of the first variable."""
    references: NDArray[np.uint32]
    """Value references of the variables, (n,)."""
    sizes: NDArray[np.int64]
    """Columns of each variable, (n,): more than 1 for an array."""
    names: tuple[str, ...]
    """By column."""

    def parts(self, wanted: Container[int]) -> "Iterator[Group]":
        """Return the variables that begin at one of the `wanted` columns, those side by side together."""
        begins = np.cumsum([0, *self.sizes])[:-1]
        chosen = [i for i, begin in enumerate(begins.tolist()) if self.first + begin in wanted]
        for _, run in groupby(enumerate(chosen), lambda item: item[1] - item[0]):
            which = [i for _, i in run]
            begin, size = int(begins[which[0]]), int(self.sizes[which].sum())
            names = self.names[begin : begin + size]
            yield Group(self.type, self.first + begin, self.references[which], self.sizes[which], names)


@dataclass(frozen=True)
class ComponentPorts:
    """What is set on and read from one component."""

    name: str
    inputs: tuple[Group, ...]
    outputs: tuple[Group, ...]


@dataclass(frozen=True)
class Schedule:
    """The plan of a step; array lengths in brackets."""

    coupling: str
    columns: int
    names: tuple[str, ...]
    """Of the columns: `component.variable` (columns)."""
    nominal: NDArray[np.float64]
    """Nominal value of a continuous Real; 0 for what does not take any value (columns)."""
    components: tuple[ComponentPorts, ...]
    """In the order of the file."""
    order: NDArray[np.int32]
    """Indices into `components` in the order of execution (components)."""
    stage_order: NDArray[np.int32]
    """Stage s steps `order[stage_order[s]:stage_order[s + 1]]` (stages + 1)."""
    stage_copies: NDArray[np.int32]
    """Stage s does the copies `stage_copies[s]` to `stage_copies[s + 1]` (stages + 1)."""
    destination: NDArray[np.int32]
    """Columns, by copy (copies)."""
    source: NDArray[np.int32]
    factor: NDArray[np.float64]
    offset: NDArray[np.float64]
    """An offset of -0.0 keeps the sign of zero."""
    middle: NDArray[np.bool_]
    """Whether a copy brings the value at the middle of its component's step, on the line through the source's last two
    values (copies).
    """
    owner: NDArray[np.int32]
    """Index of the component whose output a copy takes; that after the last component for a connector (copies)."""
    every: NDArray[np.int64]
    """Communication steps in a step of the component (components)."""
    copy_every: NDArray[np.int64]
    """The same for the component that takes a copy; 1 for a connector (copies)."""
    mappings: dict[int, Mapping]
    """By copy: the tables that replace values in place of factor and offset."""
    labels: tuple[str, ...]
    """Both ends of each copy, for messages (copies)."""
    loops: tuple[str, ...]
    """Algebraic loops, each as the way around it."""
    cycles: tuple[tuple[int, int], ...]
    """Stages that are repeated together, first and after the last; only under iterated coupling."""
    iteration: Iteration

    def members(self, cycle: tuple[int, int]) -> list[int]:
        """Return the components of a cycle in the order of execution."""
        return [int(i) for i in self.order[self.stage_order[cycle[0]] : self.stage_order[cycle[1]]]]

    def refusal(self, copy: int, value: float, time: float) -> TwipError:
        """Return the failure of a copy that gives a `value` which is not finite, or whose table does not have it."""
        why = f"{value:g} is no item of the enumeration, and not mapped"
        if not math.isfinite(value):
            why = f"gave {value:g}, which is not finite"
        return TwipError(f"{self.labels[copy]} failed at t = {time:.12g} s: {why}")
