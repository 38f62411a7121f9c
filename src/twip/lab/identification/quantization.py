"""What the steps of a converter leave in a mean: an error that no scatter shows and no averaging removes."""

from math import pi

import numpy as np
from numpy.typing import NDArray

HARMONICS = np.arange(1, 51)
"""Terms of the series; what is left of it after 50 is 1 % of the error."""
TOGGLING = 0.01
"""Share of samples that differ from the one before, below which nothing shows a converter: a computed current."""


def converter_step(readings: NDArray[np.float64]) -> float:
    """Return the step of the converter that shows in a series of readings (n,), in their unit; 0 if none does.

    It is the smallest difference between two readings, if noise makes them go back and forth.
    """
    levels = np.unique(readings)
    if len(levels) < 2 or np.count_nonzero(np.diff(readings)) < TOGGLING * len(readings):
        return 0.0
    return float(np.min(np.diff(levels)))


def mean_error(readings: NDArray[np.float64]) -> float:
    """Return the standard error that rounding leaves in the mean of any stretch of a series of readings (n,), in their
    unit; 0 if no converter shows.

    b^2 = sum over k of (q/(pi k))^2/2 e^(-4 pi^2 k^2 s^2/q^2)

    q is the converter's step and s the standard deviation of the noise before it was rounded, which dithers: the error
    falls from q/sqrt(12) without noise to 2e-4 q at s = 0.6 q. Readings at any levels scatter by s^2 + q^2/12 in the
    mean, which the differences of neighbours tell; the scatter at one level alone would tell how near a rounding's edge
    it lies. With noise below 0.2 q they scatter by less, and the error comes out too large, never too small. Source:
    the Fourier series of the rounding's sawtooth, averaged over Gaussian noise and over levels that lie anywhere
    between two steps (B. Widrow and I. Kollar, Quantization Noise, 2008).
    """
    step = converter_step(readings)
    if not step > 0.0:
        return 0.0
    scatter = float(np.sqrt(0.5 * np.mean(np.square(np.diff(readings)))))
    dither = max(min(scatter / step, 1e3) ** 2 - 1.0 / 12.0, 0.0)
    parts = np.exp(-4.0 * pi**2 * HARMONICS**2 * dither) / (2.0 * (pi * HARMONICS) ** 2)
    return step * float(np.sqrt(np.sum(parts)))
