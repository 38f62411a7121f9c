"""Jacobi: all components step at once."""

from collections.abc import Mapping, Sequence

from ..feedthrough import Output
from .base import CouplingAlgorithm, Stages


class Jacobi(CouplingAlgorithm):
    """Every input has the value of the beginning of the step: one stage for all components."""

    name = "jacobi"
    summary = "all with the values of the beginning of the step (Jacobi)"
    rank = 0
    unlike_jacobi = ""

    def stages(
        self, order: Sequence[str], _sources: Mapping[tuple[str, str], Output], _options: Mapping[str, float]
    ) -> Stages:
        """Return one stage."""
        return Stages((tuple(order),))
