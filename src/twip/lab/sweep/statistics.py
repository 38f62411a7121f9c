"""What many runs say: a rate with its interval, and which input a metric depends on."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from ...errors import TwipError
from .parquet import Results

CONFIDENCE = 0.95
"""Of every interval."""
_RESAMPLES = 500
_LEAST_RUNS = 8
Array = NDArray[np.float64]


@dataclass(frozen=True)
class Rate:
    """A share of successes with its Wilson interval (E. B. Wilson, JASA 22, 1927)."""

    successes: int
    runs: int

    @property
    def share(self) -> float:
        """Successes over runs; nan without runs."""
        return self.successes / self.runs if self.runs else float("nan")

    @property
    def interval(self) -> tuple[float, float]:
        """Both ends of the interval; 0 and 1 without runs.

            (p + z²/2n ± z sqrt(p (1 - p)/n + z²/4n²)) / (1 + z²/n)

        p the share, n the runs, z the quantile of the normal distribution. It never leaves 0 to 1, and is not empty at
        p = 0 or 1.
        """
        if not self.runs:
            return 0.0, 1.0
        p, n = self.share, self.runs
        z = float(stats.norm.ppf(0.5 + CONFIDENCE / 2))
        centre, width = p + z * z / (2 * n), z * np.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
        low, high = (centre - width) / (1 + z * z / n), (centre + width) / (1 + z * z / n)
        return (0.0 if self.successes == 0 else float(low)), (1.0 if self.successes == n else float(high))


@dataclass(frozen=True)
class Influence:
    """How much a metric depends on an axis: `value` with the ends of its interval."""

    axis: str
    value: float
    low: float
    high: float


def rank_regression(results: Results, metric: str) -> tuple[list[Influence], float]:
    """Return the standardized rank regression coefficient of each numeric axis, the largest magnitude first, and R².

    Ranks of the metric are regressed on ranks of the axes, all scaled to variance 1: 1 or -1 is a metric that rises or
    falls with this axis alone. R² near 1 says that monotonic effects without interaction explain the ranks. A run
    without the metric is left out, an infinite value counts as the largest. Intervals by the bootstrap with a fixed
    seed. Raises `TwipError` where there is nothing to rank.
    """
    axes = [a for a in results.axes if several_numbers(results.columns[a])]
    if not axes:
        raise TwipError("there is no axis with several numbers, so nothing can be ranked")
    metric_values = results.numbers(metric)
    known = ~np.isnan(metric_values)
    inputs = np.column_stack([results.numbers(a)[known] for a in axes])
    target = metric_values[known]
    if len(target) < least_runs(len(axes)):
        raise TwipError(f"{metric} is known of {len(target)} runs; ranking needs {least_runs(len(axes))}")
    if np.all(target == target[0]):
        raise TwipError(f"{metric} is {target[0]:g} in every run: it depends on nothing")
    value, explained = _coefficients(inputs, target)
    generator = np.random.default_rng(0)
    drawn = [generator.integers(0, len(target), len(target)) for _ in range(_RESAMPLES)]
    spread = np.array([_coefficients(inputs[d], target[d])[0] for d in drawn])
    low, high = np.nanquantile(spread, [0.5 - CONFIDENCE / 2, 0.5 + CONFIDENCE / 2], axis=0)
    found = [Influence(a, float(v), float(x), float(y)) for a, v, x, y in zip(axes, value, low, high, strict=True)]
    return sorted(found, key=lambda i: -abs(i.value)), explained


def _coefficients(inputs: Array, target: Array) -> tuple[Array, float]:
    """Return the standardized coefficients (axes,) of ranks of `inputs` (rows, axes) on `target` (rows,), and R²."""
    x, y = _standard(stats.rankdata(inputs, axis=0)), _standard(stats.rankdata(target))
    coefficients = np.asarray(np.linalg.lstsq(x, y, rcond=None)[0], np.float64)
    rest = y - x @ coefficients
    total = float(y @ y)
    return coefficients, 1.0 - float(rest @ rest) / total if total > 0.0 else 0.0


def _standard(ranks: Array) -> Array:
    deviation = np.std(ranks, axis=0)
    scaled: Array = (ranks - np.mean(ranks, axis=0)) / np.where(deviation > 0.0, deviation, 1.0)
    return scaled


def sobol_indices(results: Results, metric: str) -> tuple[list[Influence], list[Influence]]:
    """Return first-order and total Sobol indices of each axis, in the order of the axes, from a design `indices`.

    The share of the metric's variance that an axis explains alone, and with all its interactions (A. Saltelli et al.,
    Comput. Phys. Commun. 181, 2010; scipy.stats.sobol_indices). Raises `TwipError` for another design, or where runs
    have no finite number.
    """
    description = results.description
    if description["design"] != "indices":
        raise TwipError("Sobol indices need a sweep of design indices")
    axes, samples = [a["label"] for a in description["axes"]], int(description["samples"])
    values = results.numbers(metric)
    if len(values) != samples * (len(axes) + 2) or not np.all(np.isfinite(values)):
        raise TwipError(
            f"Sobol indices need a finite {metric} of every run, and {np.sum(~np.isfinite(values))} lack it"
        )
    a, b, mixed = values[:samples], values[samples : 2 * samples], values[2 * samples :]
    f = np.stack([a, b, *mixed.reshape(len(axes), samples)])
    value = _indices(f)
    generator = np.random.default_rng(0)
    spread = np.array([_indices(f[:, generator.integers(0, samples, samples)]) for _ in range(_RESAMPLES)])
    low, high = np.nanquantile(spread, [0.5 - CONFIDENCE / 2, 0.5 + CONFIDENCE / 2], axis=0)
    first, total = (
        [Influence(*x) for x in zip(axes, value[i].tolist(), low[i].tolist(), high[i].tolist(), strict=True)]
        for i in (0, 1)
    )
    return first, total


def _indices(f: Array) -> Array:
    """Return first-order and total indices (2, axes) from the values of A, B and each mixed sample (axes + 2, n)."""
    given = {"f_A": f[:1], "f_B": f[1:2], "f_AB": f[2:, None]}
    found = stats.sobol_indices(func=given, n=f.shape[1])
    return np.stack([np.ravel(found.first_order), np.ravel(found.total_order)])


def several_numbers(column: Sequence[object]) -> bool:
    """Tell whether what varied took several values that are numbers."""
    return all(isinstance(v, int | float) for v in column) and len(set(column)) > 1


def least_runs(axes: int) -> int:
    """Return how many runs a ranking of so many axes needs."""
    return max(_LEAST_RUNS, 2 * axes)
