"""One communication step in plain Python."""

import math

from .copies import Copies
from .execution import Execution

Interval = tuple[float, float]
"""Beginning and end."""


class PlainStep:
    """Does single communication steps of an execution, as its schedule says when this is made."""

    def __init__(self, execution: Execution):
        plan = execution.schedule
        every = plan.every.tolist()
        self._stages = [
            (
                range(plan.stage_copies[s], plan.stage_copies[s + 1]),
                [(i, every[i]) for i in plan.order[plan.stage_order[s] : plan.stage_order[s + 1]].tolist()],
            )
            for s in range(len(plan.stage_order) - 1)
        ]
        self._driven = list(zip(execution.driven.tolist(), execution.driven_every.tolist(), strict=True))
        self._execution = execution
        self._copies = Copies(plan, execution.values)
        self._copy_every, self._middle = plan.copy_every.data, plan.middle.data
        self._owner = plan.owner.data

    def do(
        self, turn: int, times: Interval, step_size: float, driven: list[float], positions: Interval | None = None
    ) -> None:
        """Do the `turn`-th step (from 1), over `times` in s, with the `driven` values at its beginning.

        `positions` is where the step begins and ends on the scale of `Execution.reached`; without it, communication
        steps. Raises `TwipError` when a component fails.
        """
        values, reached = self._execution.values, self._execution.reached
        begin, end = (turn - 1.0, float(turn)) if positions is None else positions
        reached[-1] = begin
        for (column, every), value in zip(self._driven, driven, strict=True):
            if turn % every == 0:
                values[column] = value
        self._do_stages(turn, times, step_size, (begin, end))

    def _do_stages(self, turn: int, times: Interval, step_size: float, positions: Interval) -> None:
        for stage in range(len(self._stages)):
            self._do_stage(stage, turn, times, step_size, positions)

    def _do_stage(self, stage: int, turn: int, times: Interval, step_size: float, positions: Interval) -> None:
        reached, (begin, end) = self._execution.reached, positions
        copies, components = self._stages[stage]
        for copy in copies:
            every = self._copy_every[copy]
            if turn % every == 0:
                value = self._copies.brought(copy)
                if value is not None and self._middle[copy]:
                    wanted = end - 0.5 * every * (end - begin)
                    value = self._at(wanted, copy, value, float(reached[self._owner[copy]]))
                if value is None or not math.isfinite(value):
                    value = self._copies.refused(copy, value)
                    raise self._execution.schedule.refusal(copy, value, float(self._execution.clock[0]))
                self._copies.put(copy, value)
        due = [(component, every) for component, every in components if turn % every == 0]
        ahead = due if self._execution.side_by_side else []
        for component, every in ahead:
            self._begin(component, every, times, step_size)
        for component, every in due:
            if not ahead:
                self._begin(component, every, times, step_size)
            self._execution.ports[component].get_outputs()
            self._execution.since[component] = times[1]
            reached[component] = end

    def _at(self, wanted: float, copy: int, value: float, position: float) -> float:
        """Return the value of a copy at the position `wanted`, on the line through the source's last two values; the
        newest is `value`, at `position`.
        """
        samples = self._execution.samples
        sample: list[float] = samples[:, copy].tolist()
        newer, newer_at, older, older_at = sample
        if position > newer_at:
            older, older_at = newer, newer_at
        samples[:, copy] = value, position, older, older_at
        return value + (wanted - position) / (position - older_at) * (value - older)

    def _begin(self, component: int, every: int, times: Interval, step_size: float) -> None:
        execution = self._execution
        port, clock = execution.ports[component], execution.clock
        begin = times[0] if every == 1 else float(execution.since[component])
        clock[0] = times[0]
        port.set_inputs()
        port.instance.step(begin, every * step_size)
        clock[0] = times[1]
        port.ask_outputs()
