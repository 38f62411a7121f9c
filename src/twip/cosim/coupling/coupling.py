"""The coupling of a run: how its components exchange values, and when each of them steps."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from ...errors import TwipError
from ..model.algorithm import Algorithm
from ..model.iteration import Iteration
from ..model.system import System
from ..model.time_grid import TimeGrid
from .algorithm_problems import find_problems
from .algorithms import COUPLINGS, DEFAULT, IN_ORDER
from .algorithms.base import CouplingAlgorithm

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

    algorithm: CouplingAlgorithm = DEFAULT
    mid_step: tuple[str, ...] = ()
    """Inputs (`component.variable`) taken at the middle of a step."""
    order: tuple[str, ...] = ()
    """All components in the order of execution, or none: by feed-through."""
    own_steps: tuple[tuple[str, int], ...] = ()
    """Components with a step of their own, in communication steps (more than one), in the order of their names."""
    options: Mapping[str, float] = field(default_factory=dict)
    """Of the algorithm, by name; its defaults for the others."""
    control: Control | None = None
    """None for equal steps."""

    @classmethod
    def of(cls, system: System, grid: TimeGrid, chosen: Algorithm) -> "Coupling":
        """Complete what is `chosen`. Raises `TwipError` with a line for each problem."""
        problems = [line for line, _ in find_problems(chosen, system.components, system.copies, system.columns)]
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
            DEFAULT if chosen.coupling is None else COUPLINGS[chosen.coupling],
            tuple(dict.fromkeys(chosen.mid_step or ())),
            tuple(chosen.order or ()),
            tuple(sorted((component, multiple) for component, multiple in own_steps.items() if multiple > 1)),
            dict(chosen.options),
            control,
        )

    @property
    def name(self) -> str:
        """The name of the algorithm."""
        return self.algorithm.name

    @property
    def settings(self) -> dict[str, float]:
        """The values of all options of the algorithm, by name."""
        return self.algorithm.completed(self.options)

    @property
    def iteration(self) -> Iteration:
        """When repeated stages are accepted."""
        return self.algorithm.iteration(self.settings)

    @property
    def repeats(self) -> str:
        """What makes steps be repeated from an earlier state; empty if nothing does."""
        if self.control is not None:
            return "variable steps do"
        return f"{self.name} coupling does" if self.algorithm.repeats else ""

    def identity(self) -> dict[str, object]:
        """Return what makes this coupling, by a name for messages; what is not used is left out."""
        found: dict[str, object] = {"coupling": self.name, "list of mid-step inputs": sorted(self.mid_step)}
        if self.order:
            found["order by hand"] = list(self.order)
        for component, multiple in self.own_steps:
            found[f"own step of {component} [steps]"] = multiple
        settings = self.settings
        return found | {option.words: settings[option.name] for option in self.algorithm.options}


INITIAL = Coupling(IN_ORDER)
"""How values are exchanged at the start time, whatever the coupling of the steps."""


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
