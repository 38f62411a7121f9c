"""Going back to the beginning of a step, with FMUs that can give away their state and take it back."""

import contextlib
from collections.abc import Iterable, Sequence

from ...errors import TwipError
from ..model.system import System
from .coupling import Coupling
from .execution import Execution
from .scheduling import make_schedule


class Snapshot:
    """The states of some components between two steps; free it after use."""

    def __init__(self, execution: Execution, components: Iterable[int]):
        """Take the states of `components`, indices into `Execution.ports`. Raises `TwipError` when one fails."""
        self._messages = execution.messages
        self._told = len(self._messages)
        self._kept: list[tuple[int, int]] = []
        self._ports = execution.ports
        try:
            for i in components:
                self._kept.append((i, self._ports[i].instance.keep_state()))
        except TwipError:
            self.free()
            raise

    def restore(self) -> None:
        """Put the components back and forget what they have said since. Raises `TwipError` when one fails."""
        for i, state in self._kept:
            self._ports[i].instance.return_to(state)
            self._ports[i].forget_inputs()
        del self._messages[self._told :]

    def free(self) -> None:
        """Free the states."""
        for i, state in self._kept:
            with contextlib.suppress(TwipError):
                self._ports[i].instance.free_state(state)
        self._kept.clear()


def cannot_be_repeated(system: System, coupling: Coupling) -> list[str]:
    """Return a line for each component whose FMU cannot do what the coupling needs: go back, to repeat its
    steps, or take steps of different sizes.
    """
    if not coupling.repeats:
        return []
    if coupling.control is not None:
        needed, why = list(range(len(system.components))), "variable steps need"
    else:
        schedule = make_schedule(system, coupling)
        needed, why = (
            [i for cycle in schedule.cycles for i in schedule.members(cycle)],
            f"{coupling.name} coupling needs",
        )
    lines = []
    for component in (system.components[i] for i in sorted(needed)):
        if not component.fmu.saves_state:
            lines.append(
                f"{component.name}: FMU {component.fmu.name} cannot save its state (canGetAndSetFMUstate), which {why}"
            )
        if coupling.control is not None and not component.fmu.varies_step:
            lines.append(
                f"{component.name}: FMU {component.fmu.name} does not take steps of different sizes"
                f" (canHandleVariableCommunicationStepSize), which {why}"
            )
    return lines


def repeatable(system: System, coupling: Coupling) -> None:
    """Raise `TwipError` with a line for each component that stands in the way of `coupling`."""
    lines: Sequence[str] = cannot_be_repeated(system, coupling)
    if lines:
        raise TwipError(lines)
