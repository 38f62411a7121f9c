"""The coupling of a run: how its components exchange values, and when each of them steps."""

import difflib
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from ...errors import TwipError
from ..model.algorithm import COUPLINGS, Algorithm
from ..model.iteration import ITERATIONS, TOLERANCE, Iteration
from ..model.system import Component, Copy, System
from ..model.time_grid import TimeGrid
from ..values.ssp_types import family

_DIVIDES = 1e-9
"""Relative deviation of a whole multiple that still counts as rounding."""
SMALLEST = 1e-6
"""Default of the smallest variable step: a share of the first."""

Problem = tuple[str, tuple[str, str]]
"""A line, and the field and name that it is about (see `Algorithm.places`)."""


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
            raise TwipError("\n".join(problems))
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


def find_problems(
    algorithm: Algorithm, components: Sequence[Component], copies: Sequence[Copy], columns: Sequence[str]
) -> list[Problem]:
    """Return everything in `algorithm` that this system cannot do, apart from what depends on start and stop time."""
    found: list[Problem] = []
    if algorithm.coupling is not None and algorithm.coupling not in COUPLINGS:
        found.append((f"coupling {algorithm.coupling!r} must be one of {', '.join(COUPLINGS)}", ("coupling", "")))
        return found
    for name in dict.fromkeys(algorithm.mid_step or ()):
        if problem := _mid_step_problem(name, components, copies, columns):
            found.append((problem, ("mid_step", name)))
    found += _order_problems(algorithm, [c.name for c in components])
    found += _own_step_problems(algorithm, [c.name for c in components])
    found += _iteration_problems(algorithm)
    found += _control_problems(algorithm)
    return found


def _mid_step_problem(
    name: str, components: Sequence[Component], copies: Sequence[Copy], columns: Sequence[str]
) -> str:
    """Return why the input `name` (`component.variable`) cannot be taken at the middle of a step, or nothing."""
    inputs = {f"{c.name}.{v.name}": v for c in components for v in c.inputs}
    if name not in inputs:
        return f"there is no input {name}{_near(name, list(inputs))}"
    if family(inputs[name].recorded_type) != "Real" or inputs[name].variability != "continuous":
        return f"input {name} is not continuous and cannot be taken at the middle of a step"
    if columns.index(name) not in {copy.destination for copy in copies}:
        return f"input {name} is not connected and cannot be taken at the middle of a step"
    return ""


def _order_problems(algorithm: Algorithm, names: list[str]) -> Iterator[Problem]:
    order = algorithm.order
    if not order:
        return
    for name in dict.fromkeys(order):
        if name not in names:
            yield f"order: there is no component {name}{_near(name, names)}", ("order", name)
        elif order.count(name) > 1:
            yield f"order: component {name} is named {order.count(name)} times", ("order", name)
    if missing := [name for name in names if name not in order]:
        yield f"order: {', '.join(missing)} missing; an order by hand names every component once", ("order", "")
    if algorithm.coupling != "gauss-seidel":
        coupling = algorithm.coupling or "jacobi"
        yield f"an order by hand has a meaning under gauss-seidel only, not under {coupling}", ("order", "")


def _own_step_problems(algorithm: Algorithm, names: list[str]) -> Iterator[Problem]:
    for name, size in (algorithm.own_steps or {}).items():
        place = ("own_steps", name)
        if name not in names:
            yield f"own step: there is no component {name}{_near(name, names)}", place
        elif not (math.isfinite(size) and size > 0.0):
            yield f"own step {size!r} s of {name} must be a positive number", place
        elif algorithm.coupling == "iterated":
            yield f"own step of {name}: iterated coupling repeats steps that are the same for all components", place
        elif algorithm.tolerance:
            yield f"own step of {name}: with a tolerance the steps vary, and no step is a multiple of them", place


def _iteration_problems(algorithm: Algorithm) -> Iterator[Problem]:
    tolerance, maximum = algorithm.iteration_tolerance, algorithm.maximum_iterations
    if tolerance is not None and not (math.isfinite(tolerance) and tolerance > 0.0):
        yield f"iteration tolerance {tolerance!r} must be a positive number", ("iteration_tolerance", "")
    if maximum is not None and maximum < 1:
        yield f"maximum of {maximum} iterations must be at least 1", ("maximum_iterations", "")
    for value, name in ((tolerance, "iteration_tolerance"), (maximum, "maximum_iterations")):
        if value is not None and algorithm.coupling != "iterated":
            coupling = algorithm.coupling or "jacobi"
            yield f"{name.replace('_', ' ')} has a meaning under iterated only, not under {coupling}", (name, "")


def _control_problems(algorithm: Algorithm) -> Iterator[Problem]:
    tolerance = algorithm.tolerance
    if tolerance is not None and not (math.isfinite(tolerance) and tolerance >= 0.0):
        yield f"tolerance {tolerance!r} must be a positive number, or 0 for equal steps", ("tolerance", "")
    for value, name in ((algorithm.minimum_step, "minimum_step"), (algorithm.maximum_step, "maximum_step")):
        if value is None:
            continue
        if not (math.isfinite(value) and value > 0.0):
            yield f"{name.replace('_', ' ')} {value!r} s must be a positive number", (name, "")
        elif not tolerance:
            yield (
                f"{name.replace('_', ' ')} has a meaning with a tolerance only: without one all steps are equal",
                (name, ""),
            )


def _near(name: str, names: Sequence[str]) -> str:
    close = difflib.get_close_matches(name, names, 1)
    return f", did you mean {close[0]}?" if close else ""


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
