"""Copies of a schedule in plain Python, one at a time, by the arithmetic of the compiled loop."""

import math

from ..model.schedule import Schedule
from ..model.vector import Vector


class Copies:
    """Does copies as the arrays of the schedule say at that moment."""

    def __init__(self, schedule: Schedule, values: Vector):
        self._values, self._mappings = values, schedule.mappings
        # views give numbers of Python, and in a fraction of the time that the arrays take
        self._destination, self._source = schedule.destination.data, schedule.source.data
        self._factor, self._offset = schedule.factor.data, schedule.offset.data

    def brought(self, copy: int) -> float | None:
        """Return what a copy brings, which need not be finite; None where its table does not have the value."""
        value: float = self._factor[copy] * self._values[self._source[copy]] + self._offset[copy]
        if copy not in self._mappings or not math.isfinite(value):
            return value
        mapped = self._mappings[copy](int(value))
        return None if mapped is None else float(mapped)

    def put(self, copy: int, value: float) -> None:
        """Write what a copy has brought to its destination."""
        self._values[self._destination[copy]] = value

    def refused(self, copy: int, brought: float | None) -> float:
        """Return the value that a failure tells: what was brought, or what the table does not have."""
        if brought is None:
            taken: float = self._values[self._source[copy]]
            return taken
        return brought

    def do(self, copy: int) -> float | None:
        """Do a copy; return a value that its table does not have or that is not finite, with nothing done."""
        value = self.brought(copy)
        if value is None or not math.isfinite(value):
            return self.refused(copy, value)
        self.put(copy, value)
        return None
