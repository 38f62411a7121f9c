"""The coupling of a run: how its components exchange values, and when each of them steps."""

from collections.abc import Iterator
from dataclasses import dataclass, field

from ...errors import TwipError
from ..model.algorithm import Algorithm
from ..model.algorithm_problems import find_problems
from ..model.iteration import ITERATIONS, TOLERANCE, Iteration
from ..model.system import System
from ..model.time_grid import TimeGrid

_DIVIDES = 1e-9
"""Relative deviation of a whole multiple that still counts as rounding."""
SMALLEST = 1e-6
"""Default of the smallest variable step: a share of the first."""


@dataclass(frozen=True)
class Control:
    """How the size of variable steps is chosen."""

    tolerance: float
    """Largest local error of a step, relative to magnitude or nominal value."""
    minimum: float
    """Smallest step in s; an error that needs a smaller one is a failure."""
    maximum: float
    """Largest step in s."""


@dataclass(frozen=True)
class Coupling:
    """How components exchange values, and when each of them steps."""

    name: str = "jacobi"
    """`jacobi`, `gauss-seidel` or `iterated`."""
    mid_step: tuple[str, ...] = ()
    """Inputs (`component.variable`) taken at the middle of a step."""
    order: tuple[str, ...] = ()
    """All components in the order of execution, or none: by feed-through."""
    own_steps: tuple[tuple[str, int], ...] = ()
    """Components with a step of their own, in communication steps (more than one), in the order of their names."""
    iteration: Iteration = field(default_factory=Iteration)
    control: Control | None = None
    """None for equal steps."""

    @classmethod
    def of(cls, system: System, grid: TimeGrid, chosen: Algorithm) -> "Coupling":
        """Complete what is `chosen`. Raises `TwipError` with a line for each problem."""
        problems = [line for line, _ in find_problems(chosen, system.components, system.copies, system.columns)]
        name = chosen.coupling or "jacobi"
        own_steps = {} if problems else dict(_multiples(chosen, grid, problems))
        control = None
        if chosen.tolerance and not problems:
            smallest, largest = chosen.minimum_step, chosen.maximum_step
            control = Control(
                chosen.tolerance,
                SMALLEST * grid.step_size if smallest is None else smallest,
                max(grid.stop - grid.start, grid.step_size) if largest is None else largest,
            )
            if not control.minimum <= grid.step_size:
                problems.append(f"minimum step {control.minimum!r} s is above the first step {grid.step_size!r} s")
            if not grid.step_size <= control.maximum:
                problems.append(f"maximum step {control.maximum!r} s is below the first step {grid.step_size!r} s")
        if problems:
            raise TwipError(problems)
        return cls(
            name,
            tuple(dict.fromkeys(chosen.mid_step or ())),
            tuple(chosen.order or ()),
            tuple(sorted((component, multiple) for component, multiple in own_steps.items() if multiple > 1)),
            Iteration(
                TOLERANCE if chosen.iteration_tolerance is None else chosen.iteration_tolerance,
                ITERATIONS if chosen.maximum_iterations is None else chosen.maximum_iterations,
            ),
            control,
        )

    @property
    def repeats(self) -> str:
        """What makes steps be repeated from an earlier state; empty if nothing does."""
        if self.control is not None:
            return "variable steps do"
        return "iterated coupling does" if self.name == "iterated" else ""

    def identity(self) -> dict[str, object]:
        """Return what makes this coupling, by a name for messages; what is not used is left out."""
        found: dict[str, object] = {"coupling": self.name, "list of mid-step inputs": sorted(self.mid_step)}
        if self.order:
            found["order by hand"] = list(self.order)
        for component, multiple in self.own_steps:
            found[f"own step of {component} [steps]"] = multiple
        if self.name == "iterated":
            found["iteration tolerance"] = self.iteration.tolerance
            found["maximum iterations"] = self.iteration.maximum
        return found


def _multiples(chosen: Algorithm, grid: TimeGrid, problems: list[str]) -> Iterator[tuple[str, int]]:
    """Yield the own step of each component that has one, in communication steps."""
    for name, size in (chosen.own_steps or {}).items():
        multiple = round(size / grid.step_size)
        if multiple < 1 or abs(multiple * grid.step_size - size) > _DIVIDES * size:
            problems.append(f"own step {size!r} s of {name} is not a whole multiple of the step {grid.step_size!r} s")
        elif grid.steps % multiple:
            problems.append(
                f"own step {size!r} s of {name} does not divide the interval from {grid.start!r} s to {grid.stop!r} s"
                f" ({grid.steps / multiple:.9g} steps)"
            )
        else:
            yield name, multiple
