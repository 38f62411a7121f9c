"""The coupling algorithms: one class per file, found by this folder, so that a new file is a new coupling."""

from collections.abc import Callable, Mapping

from ...reading.family import members
from .base import CouplingAlgorithm, Option
from .gauss_seidel import GaussSeidel
from .jacobi import Jacobi


def _all() -> dict[str, CouplingAlgorithm]:
    found = [item() for item in members(__name__, __path__) if issubclass(item, CouplingAlgorithm)]
    names = [algorithm.name for algorithm in found]
    if twice := {name for name in names if names.count(name) > 1}:
        raise RuntimeError(f"more than one coupling is called {', '.join(sorted(twice))}")
    return {algorithm.name: algorithm for algorithm in sorted(found, key=lambda a: (a.rank, a.name))}


COUPLINGS: Mapping[str, CouplingAlgorithm] = _all()
"""By name."""
DEFAULT = COUPLINGS[Jacobi.name]
"""What is taken where nobody says anything."""
IN_ORDER = COUPLINGS[GaussSeidel.name]
"""What settles the values at the start time: in the order of the feed-through each component has what it needs."""
OPTIONS: Mapping[str, Option] = {option.name: option for a in COUPLINGS.values() for option in a.options}
"""The options of all couplings, by name."""


def named(holds: Callable[[CouplingAlgorithm], bool]) -> str:
    """Return the names of the couplings of which something holds, as `a or b`."""
    return " or ".join(name for name, algorithm in COUPLINGS.items() if holds(algorithm))
