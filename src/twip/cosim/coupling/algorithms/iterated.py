"""Iterated coupling: components in a cycle repeat a step until they agree (`iterated_step` does it)."""

import math
from collections.abc import Mapping, Sequence

from ...model.iteration import ITERATIONS, TOLERANCE, Iteration
from ..feedthrough import Output, split
from .base import CouplingAlgorithm, Option, Stages


def _tolerance_problem(value: float) -> str:
    right = math.isfinite(value) and value > 0.0
    return "" if right else f"iteration tolerance {value!r} must be a positive number"


def _maximum_problem(value: float) -> str:
    return "" if value >= 1 else f"maximum of {value} iterations must be at least 1"


class Iterated(CouplingAlgorithm):
    """Inputs from within a cycle have the value of the end of the step: a stage for each component, those of a cycle
    side by side and repeated. Components outside of cycles step once, after what feeds them.
    """

    name = "iterated"
    summary = "one after the other, those in cycles again until they agree (iterated)"
    rank = 2
    repeats = True
    in_a_loop = ""
    unlike_jacobi = "which is not repeated"
    options = (
        Option(
            "iteration_tolerance",
            "iterationTolerance",
            float,
            TOLERANCE,
            "X",
            "iterated steps are repeated until coupling variables change by less than this, relative to magnitude or "
            "nominal value; default: the system's, else 1e-8",
            _tolerance_problem,
        ),
        Option(
            "maximum_iterations",
            "maximumIterations",
            int,
            ITERATIONS,
            "N",
            "repetitions of an iterated step after which the run fails; default: the system's, else 50",
            _maximum_problem,
        ),
    )

    def stages(
        self, order: Sequence[str], sources: Mapping[tuple[str, str], Output], _options: Mapping[str, float]
    ) -> Stages:
        """Return a stage for each component, and the cycles."""
        members: list[str] = []
        cycles: list[tuple[int, int]] = []
        for names, is_cycle in split(order, sources):
            if is_cycle:
                cycles.append((len(members), len(members) + len(names)))
            members += names
        return Stages(tuple((name,) for name in members), tuple(cycles))

    def iteration(self, options: Mapping[str, float]) -> Iteration:
        """Return the limits that the options give."""
        return Iteration(options["iteration_tolerance"], int(options["maximum_iterations"]))

    def described(self, options: Mapping[str, float]) -> list[tuple[str, str]]:
        """Return both options in one line."""
        rule = self.iteration(options)
        return [("iterations", f"at most {rule.maximum}, tolerance {rule.tolerance:g}")]
