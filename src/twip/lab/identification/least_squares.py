"""Weighted linear least squares with prior knowledge of some parameters, and honest intervals."""

from dataclasses import dataclass
from statistics import NormalDist

import numpy as np
from scipy.stats import t as student

from .estimate import CONFIDENCE
from .recording import Array


@dataclass(frozen=True)
class Fit:
    """Parameters (k,), their covariance (k, k), the weighted squares `chi2` and the degrees of freedom.

    `quantile` times a standard deviation is half of a 95 % interval.
    """

    values: Array
    covariance: Array
    chi2: float
    freedom: int
    scale: float
    """Variance of the residuals over what the errors say, at least 1 with known errors; it is in the covariance."""
    quantile: float

    def half_width(self, combination: Array) -> float:
        """Return half of the 95 % interval of a linear combination (k,) of the parameters."""
        return float(self.quantile * np.sqrt(combination @ self.covariance @ combination))


def weighted_fit(design: Array, target: Array, error: Array, prior_error: Array, known_errors: bool) -> Fit | None:
    """Fit `design` (n, k) times the parameters to `target` (n,) with standard errors (n,).

    The last len(prior_error) parameters are known to be 0 within those standard errors; one of 0 is exactly 0. Returns
    None where the data do not determine the parameters: the scaled design has no full rank.
    Scatter beyond the errors widens the intervals (Birge ratio), with Student's quantile; scatter below does not
    narrow them.
    """
    free = np.concatenate([np.ones(design.shape[1] - len(prior_error), bool), prior_error > 0.0])
    uncertain = prior_error > 0.0
    rows = np.zeros((int(uncertain.sum()), design.shape[1]))
    rows[:, len(free) - len(prior_error) :] = np.diag(1.0 / np.where(uncertain, prior_error, 1.0))[uncertain]
    a = np.vstack([design / error[:, None], rows])[:, free]
    b = np.concatenate([target / error, np.zeros(len(rows))])
    size = np.linalg.norm(a, axis=0)
    if len(a) < a.shape[1] or not np.all(size > 0.0):
        return None
    left, singular, right = np.linalg.svd(a / size, full_matrices=False)
    if singular[-1] < 1e-6 * singular[0]:
        return None
    inverse = (right.T / singular**2) @ right / np.outer(size, size)
    found = right.T @ (left.T @ b / singular) / size
    chi2 = float(np.sum((a @ found - b) ** 2))
    freedom = len(a) - a.shape[1]
    if freedom < 1:
        return None
    scale, quantile = spread(chi2, freedom, known_errors)
    values, covariance = np.zeros(len(free)), np.zeros((len(free), len(free)))
    values[free] = found
    covariance[np.ix_(free, free)] = inverse * scale
    return Fit(values, covariance, chi2, freedom, scale, quantile)


def spread(chi2: float, freedom: int, known_errors: bool) -> tuple[float, float]:
    """Return the factor on the variances and the quantile of the interval."""
    ratio = chi2 / freedom
    if known_errors and ratio <= 1.0:
        return 1.0, NormalDist().inv_cdf(0.5 + 0.5 * CONFIDENCE)
    return ratio, float(student.ppf(0.5 + 0.5 * CONFIDENCE, freedom))
