"""What of an algorithm a system cannot do, apart from what depends on the times of a run."""

import math
from collections.abc import Iterator, Sequence
from functools import partial

from ..model.algorithm import Algorithm
from ..model.system import Component, Copy
from ..reading.wording import did_you_mean
from ..values.types import family
from .algorithms import COUPLINGS, DEFAULT, OPTIONS, named
from .algorithms.base import CouplingAlgorithm

Problem = tuple[str, tuple[str, str]]
"""A line, and the field and name that it is about (see `Algorithm.places`)."""


def find_problems(
    algorithm: Algorithm, components: Sequence[Component], copies: Sequence[Copy], columns: Sequence[str]
) -> list[Problem]:
    """Return everything in `algorithm` that this system cannot do, apart from what depends on start and stop time."""
    if algorithm.coupling is not None and algorithm.coupling not in COUPLINGS:
        return [(unknown_coupling(algorithm.coupling), ("coupling", ""))]
    found: list[Problem] = []
    coupling = DEFAULT if algorithm.coupling is None else COUPLINGS[algorithm.coupling]
    for name in dict.fromkeys(algorithm.mid_step or ()):
        if problem := _mid_step_problem(name, components, copies, columns):
            found.append((problem, ("mid_step", name)))
    found += _order_problems(algorithm, coupling, [c.name for c in components])
    found += _own_step_problems(algorithm, coupling, [c.name for c in components])
    found += _option_problems(algorithm, coupling)
    found += _control_problems(algorithm)
    return found


def unknown_coupling(name: str) -> str:
    """Return the problem of a `name` that no coupling has."""
    return f"coupling {name!r} must be one of {', '.join(COUPLINGS)}"


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


def _order_problems(algorithm: Algorithm, coupling: CouplingAlgorithm, names: list[str]) -> Iterator[Problem]:
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
    if not coupling.takes_order:
        able = named(lambda a: a.takes_order)
        yield f"an order by hand has a meaning under {able} only, not under {coupling.name}", ("order", "")


def _own_step_problems(algorithm: Algorithm, coupling: CouplingAlgorithm, names: list[str]) -> Iterator[Problem]:
    for name, size in (algorithm.own_steps or {}).items():
        place = ("own_steps", name)
        if name not in names:
            yield f"own step: there is no component {name}{did_you_mean(name, names)}", place
        elif not (math.isfinite(size) and size > 0.0):
            yield f"own step {size!r} s of {name} must be a positive number", place
        elif coupling.repeats:
            yield (
                f"own step of {name}: {coupling.name} coupling repeats steps that are the same for all components",
                place,
            )
        elif algorithm.tolerance:
            yield f"own step of {name}: with a tolerance the steps vary, and no step is a multiple of them", place


def _option_problems(algorithm: Algorithm, coupling: CouplingAlgorithm) -> Iterator[Problem]:
    given = {name: algorithm.options[name] for name in OPTIONS if name in algorithm.options}
    for name in algorithm.options:
        if name not in OPTIONS:
            yield f"there is no option {name} of a coupling{did_you_mean(name, list(OPTIONS))}", (name, "")
    for name, value in given.items():
        if problem := OPTIONS[name].problem(value):
            yield problem, (name, "")
    for name in given:
        if not _takes(name, coupling):
            able = named(partial(_takes, name))
            yield f"{OPTIONS[name].words} has a meaning under {able} only, not under {coupling.name}", (name, "")


def _takes(name: str, coupling: CouplingAlgorithm) -> bool:
    return name in [option.name for option in coupling.options]


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
