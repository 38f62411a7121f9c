"""How distributions are sampled: points in the unit cube, the same ones for the same seed."""

import math

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from ...errors import TwipError

DESIGNS = ("random", "lhs", "sobol", "indices")
"""Independent; Latin hypercube; scrambled Sobol sequence; and what `sobol_indices` needs: two Sobol samples A and B,
and for each axis A with that axis taken from B, one after the other.
"""


def unit_points(design: str, samples: int, dimensions: int, seed: int) -> NDArray[np.float64]:
    """Return points of the unit cube, (samples, dimensions); by `indices` (samples * (dimensions + 2), dimensions).

    Raises `TwipError` for an unknown design or a number of samples that it cannot have.
    """
    if design not in DESIGNS:
        raise TwipError(f"design {design!r} must be one of {', '.join(DESIGNS)}")
    if samples < 1:
        raise TwipError(f"samples = {samples} must be at least 1")
    generator = np.random.default_rng(np.random.SeedSequence((seed, len(DESIGNS))))
    if design == "random":
        return generator.random((samples, dimensions))
    if design == "lhs":
        return np.asarray(qmc.LatinHypercube(dimensions, rng=generator).random(samples))
    exponent = math.ceil(math.log2(samples))
    if design == "sobol":  # a whole power of two keeps the sequence balanced; scipy warns of others
        return np.asarray(qmc.Sobol(dimensions, rng=generator).random_base2(exponent)[:samples])
    if 2**exponent != samples:
        raise TwipError(f"samples = {samples} must be a power of two for design indices, such as {2**exponent}")
    both = np.asarray(qmc.Sobol(2 * dimensions, rng=generator).random_base2(exponent))
    a, b = both[:, :dimensions], both[:, dimensions:]
    mixed = [np.where(np.arange(dimensions) == axis, b, a) for axis in range(dimensions)]
    return np.concatenate([a, b, *mixed])


def run_seed(seed: int, number: int) -> int:
    """Return the seed of a run, 0 to 2^31 - 1, from the sweep's seed and the run's number alone."""
    return int(np.random.SeedSequence(seed, spawn_key=(number,)).generate_state(1)[0]) >> 1
