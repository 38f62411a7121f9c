"""Fixed points x = g(x), where each evaluation is dear: Anderson acceleration.

D. G. Anderson, Iterative procedures for nonlinear integral equations, J. ACM 12 (1965); in co-simulation known as
interface quasi-Newton with least squares. From the last evaluations it learns how the residual r = g(x) - x answers to
x, and goes where it would vanish if that were linear: n unknowns of a linear problem are found in n + 2 evaluations,
also where repeated substitution diverges.
"""

import numpy as np
from numpy.typing import NDArray

_MEMORY = 8
"""Most differences between evaluations that are kept."""
_INDEPENDENT = 1e-10
"""Smallest singular value, relative to the largest, of differences that count as independent."""
_NOISE = 64 * np.finfo(np.float64).eps
"""Largest difference of weighted residuals that may be nothing but rounding."""

Vector = NDArray[np.float64]


class Acceleration:
    """Proposes the next point from the points and values so far.

    Where an accelerated step has made the residual larger, what was learnt does not hold: it is forgotten, and the best
    point is gone on from by plain substitution.
    """

    def __init__(self, accelerated: NDArray[np.bool_]):
        """`accelerated` (n,) tells which unknowns may take any value; others take what g gives."""
        self._free = accelerated
        self._points: list[Vector] = []
        self._residuals: list[Vector] = []
        self._size = np.inf
        self._extrapolated = False

    def propose(self, point: Vector, value: Vector, scale: Vector) -> Vector:
        """Return the next point after g(`point`) = `value`; unknowns are weighted by 1 / `scale` (n,)."""
        free = self._free
        proposed = value.copy()
        if not free.any():
            return proposed
        weight = 1.0 / scale[free]
        residual = value[free] - point[free]
        size = float(np.max(np.abs(residual * weight)))
        if self._extrapolated and size > self._size:
            self._points, self._residuals = self._points[-1:], self._residuals[-1:]
            self._extrapolated = False
            proposed[free] = self._points[0] + self._residuals[0]
            return proposed
        self._points.append(point[free])
        self._residuals.append(residual)
        del self._points[: -_MEMORY - 1], self._residuals[: -_MEMORY - 1]
        self._size, self._extrapolated = size, len(self._points) > 1
        if self._extrapolated:
            points, residuals = np.diff(self._points, axis=0).T, np.diff(self._residuals, axis=0).T
            weighted = residuals * weight[:, None]
            known = np.abs(weighted).max(axis=0) > _NOISE  # else going on would lead to anywhere
            share = np.linalg.lstsq(weighted[:, known], residual * weight, rcond=_INDEPENDENT)[0]
            proposed[free] -= (points + residuals)[:, known] @ share
        return proposed
