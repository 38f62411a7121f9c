"""The first values of connected variables in initialization mode.

An output is read when the inputs that it depends on have their values: with an input's start value it may be undefined,
as 1 / u is with u = 0. Where outputs depend on each other, the start values of their inputs are where it begins.
"""

from collections.abc import Sequence

from ..fmus.protocols import AnyPorts
from ..model.schedule import Schedule
from ..model.system import System
from ..model.vector import Vector
from .copies import Copies
from .scheduling import feedthrough_of


def read_in_order(system: System, schedule: Schedule, ports: Sequence[AnyPorts], values: Vector) -> None:
    """Let every output be read once, and every input be set whose source is known by then.

    A copy whose table does not have its value is left to the passes that follow, as are those to connectors.
    """
    Reading(system, schedule, ports, values).run()


class Reading:
    """What has been read and set so far."""

    def __init__(self, system: System, schedule: Schedule, ports: Sequence[AnyPorts], values: Vector):
        self._system, self._schedule, self._ports = system, schedule, ports
        self._copies = Copies(schedule, values)
        self._unread: list[dict[int, frozenset[str]]] = []
        """For each component the columns of its outputs that are not known, and the inputs they depend on."""
        inputs: dict[int, tuple[int, str]] = {}
        for i, component in enumerate(system.components):
            first = system.first_column[component.name]
            inputs |= {column: (i, v.name) for column, v in enumerate(component.inputs, first)}
            outputs = enumerate(component.outputs, first + len(component.inputs))
            self._unread.append({column: feedthrough_of(component, v.name) for column, v in outputs})
        self._waiting: list[dict[int, str]] = [{} for _ in system.components]
        """For each component the copies to it that are not done, and the inputs they lead to."""
        for copy, column in enumerate(schedule.destination.tolist()):
            if column in inputs:
                component_index, name = inputs[column]
                self._waiting[component_index][copy] = name
        self._unknown = {column for unread in self._unread for column in unread}

    def run(self) -> None:
        """Read all outputs, those of algebraic loops from the start values on."""
        order = self._schedule.order.tolist()
        while left := [i for i in order if self._unread[i]]:
            found = [self._read(i, self._ready(i)) for i in left]
            if not any(found):
                self._read(left[0], list(self._unread[left[0]]))

    def _ready(self, component: int) -> list[int]:
        """Do what copies can be done, and return the columns of the outputs that can be read after that."""
        waiting = self._waiting[component]
        for copy in [c for c in waiting if int(self._schedule.source[c]) not in self._unknown]:
            self._copies.do(copy)
            del waiting[copy]
        blocked = set(waiting.values())
        return [column for column, needed in self._unread[component].items() if blocked.isdisjoint(needed)]

    def _read(self, component: int, columns: Sequence[int]) -> bool:
        """Set the inputs and read some outputs; tell whether there were any."""
        if columns:
            self._ports[component].set_inputs()
            self._ports[component].get_some(columns)
            self._unknown.difference_update(columns)
            for column in columns:
                del self._unread[component][column]
        return bool(columns)
