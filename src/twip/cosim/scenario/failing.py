"""Carries out the faults of a scenario, in every loop alike: faults are copies whose factor and offset change between
two chunks.

Each failing connection gets hidden columns behind the recorded ones, two per fault: what arrives at the fault, and the
past of that. The connection then leads to the first fault's column, each fault's copy to the next one's, the last copy
to the input:

    source → arrived₁ → arrived₂ → … → input          a fault that does not act copies as it is

A fault that acts gives factor and offset to its copy, and says whether it takes what arrived now or what is past: what
arrived some steps ago; before the first step that is what the input was initialized with.
"""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import TwipError
from ..model.schedule import Schedule
from ..values.conversion import Conversion
from .faults.base import Effect, Fault, Moment

_PER_COPY = ("destination", "source", "factor", "offset", "middle", "owner", "copy_every")
"""Arrays of a schedule with one entry per copy."""


@dataclass
class Failing:
    """One fault of one connection."""

    fault: Fault
    destination: int
    """Column of the input."""
    convert: Conversion
    """From a value of the fault's signal to one of the column."""
    arrived: int
    past: int
    """Hidden columns."""
    copy: int = -1
    """Index of the copy that is the fault; set when the schedule is planned."""
    history: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    """What arrived in the last n steps (n,), for a delay of n steps."""


class Faults:
    """The faults of one run."""

    def __init__(self, faults: Sequence[Fault], schedule: Schedule):
        """Plan them: `schedule` becomes the one to execute, with `columns` recorded ones first."""
        self.recorded = schedule.columns
        pairs = [(fault, target) for fault in faults for target in fault.targets]
        self._failing = [
            Failing(fault, *target, self.recorded + 2 * i, self.recorded + 2 * i + 1)
            for i, (fault, target) in enumerate(pairs)
        ]
        self.schedule = _insert(schedule, self._failing) if pairs else schedule
        self._delays = [failing for failing in self._failing if failing.fault.history]
        self.driven = np.array([failing.past for failing in self._delays], np.int32)
        """Columns that `past` is for."""

    def initialize(self, row: NDArray[np.float64]) -> None:
        """Begin at the start time with the initialized values `row` (columns,), and fill its hidden columns."""
        for failing in self._failing:
            row[[failing.arrived, failing.past]] = row[failing.destination]
        for delay in self._delays:
            delay.history = np.full(delay.fault.history, row[delay.destination])

    def hidden(self, columns: Sequence[int]) -> list[int]:
        """Return the hidden columns that hold values on their way to one of `columns`."""
        return [
            c for failing in self._failing if failing.destination in columns for c in (failing.arrived, failing.past)
        ]

    @property
    def memory(self) -> NDArray[np.float64]:
        """What a checkpoint must keep beside the row: the histories, one after the other."""
        return np.concatenate([np.zeros(0), *(delay.history for delay in self._delays)])

    def restore(self, memory: NDArray[np.float64]) -> None:
        """Take over the `memory` of the same faults."""
        ends = np.cumsum([delay.fault.history for delay in self._delays], dtype=np.int64)
        for delay, history in zip(self._delays, np.split(memory, ends[:-1]), strict=True) if self._delays else ():
            delay.history = history.copy()

    def begin(self, step: int, row: NDArray[np.float64]) -> list[str]:
        """Prepare the steps from number `step` on; `row` holds the last values. Return what begins and ends now."""
        plan, told = self.schedule, dict[str, None]()
        for failing in self._failing:
            fault, copy = failing.fault, failing.copy
            effect = Effect()
            if fault.first <= step < fault.last:
                effect = fault.act(Moment(step, float(row[plan.destination[copy]]), failing.convert))
            plan.source[copy] = failing.past if effect.delayed else failing.arrived
            plan.factor[copy], plan.offset[copy] = effect.factor, effect.offset
            if fault.first < fault.last and step in (fault.first, fault.last):
                told[f"fault {'begins' if step == fault.first else 'ends'}: {fault}"] = None
        return list(told)

    def until(self, step: int, last: int) -> int:
        """Return after how many steps, more than `step` and at most `last`, `begin` must be called next."""
        for failing in self._failing:
            fault = failing.fault
            if step < fault.first:
                last = min(last, fault.first)
            elif step < fault.last:
                last = min(last, fault.last, step + 1 if fault.every_step else fault.last)
                if fault.history:
                    last = min(last, step + fault.history)
        return last

    def past(self, count: int) -> NDArray[np.float64]:
        """Return the values of `driven` (count, delays) for the next `count` steps."""
        table = np.zeros((count, len(self._delays)))
        for column, delay in enumerate(self._delays):
            known = delay.history[:count]
            table[: len(known), column] = known
        return table

    def record(self, rows: NDArray[np.float64]) -> None:
        """Remember what arrived in finished steps, `rows` (n, columns)."""
        for delay in self._delays:
            size = len(delay.history)
            delay.history = np.concatenate([delay.history, rows[:, delay.arrived]])[-size:]


def _insert(schedule: Schedule, failing: Sequence[Failing]) -> Schedule:
    """Return the schedule with a copy per fault behind the copy of its connection."""
    chains: dict[int, list[Failing]] = {}
    for item in failing:
        chains.setdefault(item.destination, []).append(item)
    ends = schedule.destination.tolist()
    for item in failing:
        if item.destination not in ends:
            raise TwipError(f"{item.fault}: nothing is copied to {schedule.names[item.destination]}, it cannot fail")
    lengths = [1 + len(chains.get(end, ())) for end in ends]
    first = np.cumsum([0, *lengths], dtype=np.int32)
    repeated: dict[str, Any] = {name: np.repeat(getattr(schedule, name), lengths) for name in _PER_COPY}
    columns, stages = schedule.columns + 2 * len(failing), first[schedule.stage_copies]
    repeated["mappings"] = {int(first[copy]): mapping for copy, mapping in schedule.mappings.items()}
    repeated["labels"] = tuple(label for label, n in zip(schedule.labels, lengths, strict=True) for _ in range(n))
    repeated["names"] = schedule.names + tuple(schedule.names[item.destination] for item in failing for _ in range(2))
    repeated["nominal"] = np.concatenate([schedule.nominal, np.zeros(2 * len(failing))])
    plan = dataclasses.replace(schedule, columns=columns, stage_copies=stages, **repeated)
    for at, end in zip(first.tolist(), ends, strict=False):
        chain = chains.get(end, [])
        for copy, item in enumerate(chain, at + 1):
            item.copy = copy
            plan.destination[copy - 1] = plan.source[copy] = item.arrived
            plan.destination[copy] = end
            plan.factor[copy], plan.offset[copy], plan.middle[copy] = 1.0, -0.0, False
            plan.owner[copy] = len(plan.components)
    return plan
