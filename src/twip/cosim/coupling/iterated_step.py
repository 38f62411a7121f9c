"""One communication step of iterated coupling: components in a cycle are stepped again until they agree.

What the components of a cycle give each other is taken at the end of the step (or in its middle, between both ends).
Where a component comes before its source, a guess stands for the source's output; when all have stepped, the outputs
are compared with the guesses. While they differ, the components of the cycle go back to the beginning of the step and
step with better ones. Components outside of cycles step once.
"""

import numpy as np
from numpy.typing import NDArray

from ...errors import TwipError
from .execution import Execution
from .fixed_point import Acceleration
from .plain_step import Interval, PlainStep
from .rollback import Snapshot

_SHOWN = 5
"""Most signals that a failure names."""


class IteratedStep(PlainStep):
    """Does single communication steps of an execution, cycles repeated to a tolerance."""

    def __init__(self, execution: Execution):
        super().__init__(execution)
        plan = execution.schedule
        self._cycles = {first: (last, plan.members((first, last))) for first, last in plan.cycles}
        self._guessed = {first: self._guesses(first, *self._cycles[first]) for first in self._cycles}

    def _guesses(self, first: int, last: int, members: list[int]) -> NDArray[np.int32]:
        """Return the columns of the outputs that a component of the cycle takes before they are computed."""
        plan = self._execution.schedule
        stage_of = {int(plan.order[s]): s for s in range(first, last)}
        columns = {
            int(plan.source[c])
            for stage in range(first, last)
            for c in range(plan.stage_copies[stage], plan.stage_copies[stage + 1])
            if int(plan.owner[c]) in members and stage_of[int(plan.owner[c])] >= stage
        }
        return np.array(sorted(columns), np.int32)

    def _do_stages(self, turn: int, times: Interval, step_size: float, end: Interval) -> None:
        stage, most = 0, 1
        while stage < len(self._stages):
            if stage in self._cycles:
                most = max(most, self._solve(stage, turn, times, step_size, end))
                stage = self._cycles[stage][0]
            else:
                self._do_stage(stage, turn, times, step_size, end)
                stage += 1
        self._execution.iterations += most

    def _solve(self, first: int, turn: int, times: Interval, step_size: float, positions: Interval) -> int:
        """Step the cycle that begins with the stage `first` until it agrees; return how often."""
        execution, rule = self._execution, self._execution.schedule.iteration
        (last, members), columns = self._cycles[first], self._guessed[first]
        row, nominal = execution.row, execution.schedule.nominal[self._guessed[first]]
        acceleration = Acceleration(nominal > 0.0)
        execution.reached[members] = positions[1]  # a guess holds at the end of the step
        guess = row[columns].copy()
        snapshot = Snapshot(execution, members)
        try:
            for iteration in range(1, rule.maximum + 1):
                if iteration > 1:
                    execution.clock[0] = times[0]
                    snapshot.restore()
                    row[columns] = guess
                for stage in range(first, last):
                    self._do_stage(stage, turn, times, step_size, positions)
                found = row[columns].copy()
                scale = np.where(nominal > 0.0, np.maximum(np.abs(found), nominal), 0.0)
                open_ = np.abs(found - guess) > rule.tolerance * scale
                if not open_.any():
                    return iteration
                guess, before = acceleration.propose(guess, found, scale), guess
        finally:
            snapshot.free()
        execution.clock[0] = times[0]
        changes = np.abs(found - before)
        raise TwipError(
            self._complaint(times[0], [(int(columns[i]), float(changes[i])) for i in np.flatnonzero(open_)])
        )

    def _complaint(self, time: float, changing: list[tuple[int, float]]) -> str:
        plan = self._execution.schedule
        lines = []
        for column, change in changing[:_SHOWN]:
            taken = [plan.names[d] for d in plan.destination[plan.source == column].tolist()]
            lines.append(f"{plan.names[column]} → {', '.join(taken)} still changes by {change:.3g}")
        if len(changing) > _SHOWN:
            lines.append(f"and {len(changing) - _SHOWN} more")
        return (
            f"the step from t = {time:.12g} s does not converge within {plan.iteration.maximum} iterations to"
            f" {plan.iteration.tolerance:g}: {'; '.join(lines)} (a smaller step may help, or a larger tolerance)"
        )
