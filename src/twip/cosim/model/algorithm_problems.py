"""What of an algorithm a system cannot do, apart from what depends on the times of a run."""

import math
from collections.abc import Iterator, Sequence

from ..reading.wording import did_you_mean
from ..values.types import family
from .algorithm import COUPLINGS, Algorithm
from .system import Component, Copy

Problem = tuple[str, tuple[str, str]]
"""A line, and the field and name that it is about (see `Algorithm.places`)."""


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
        return f"there is no input {name}{did_you_mean(name, list(inputs))}"
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
            yield f"order: there is no component {name}{did_you_mean(name, names)}", ("order", name)
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
            yield f"own step: there is no component {name}{did_you_mean(name, names)}", place
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
