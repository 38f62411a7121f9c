"""Gauss–Seidel: the components step one after the other."""

from collections.abc import Mapping, Sequence

from ..feedthrough import Output
from .base import CouplingAlgorithm, Stages


class GaussSeidel(CouplingAlgorithm):
    """Every input has the newest value: a stage for each component, so that what has stepped feeds what follows."""

    name = "gauss-seidel"
    summary = "one after the other, each with the newest values (Gauss–Seidel)"
    rank = 1
    takes_order = True
    unlike_jacobi = "not one after the other (Gauss–Seidel)"

    def stages(
        self, order: Sequence[str], _sources: Mapping[tuple[str, str], Output], _options: Mapping[str, float]
    ) -> Stages:
        """Return a stage for each component."""
        return Stages(tuple((name,) for name in order))
