"""Numbers that a signal is judged by."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def rms(signal: Array) -> float:
    """Return the root of the mean square."""
    return float(np.sqrt(np.mean(np.square(signal))))


def overshoot(signal: Array, final: float) -> float:
    """Return how far a signal goes beyond its final value, seen from where it starts; 0 if it does not."""
    return max(0.0, float(np.max((final - signal) * np.sign(signal[0] - final))))


def settling_time(times: Array, signal: Array, final: float, band: float) -> float:
    """Return the time in s from the start until the signal stays within `final` +- `band`; inf if it never does."""
    outside = np.flatnonzero(np.abs(signal - final) > band)
    if not outside.size:
        return 0.0
    return float(times[outside[-1] + 1] - times[0]) if outside[-1] + 1 < len(times) else float("inf")


def time_to_reach(times: Array, signal: Array, level: float) -> float:
    """Return the time in s from the start until a rising signal first reaches `level`; inf if it never does."""
    reached = np.flatnonzero(signal >= level)
    return float(times[reached[0]] - times[0]) if reached.size else float("inf")


def slope(times: Array, signal: Array) -> float:
    """Return the slope of the straight line that fits best, in the signal's unit per s."""
    return float(np.polyfit(times - times[0], signal, 1)[0])


def reversals(speed: Array, threshold: float) -> int:
    """Return how often a speed changes its sign; what is not above the threshold counts as rest and has no sign."""
    moving = np.sign(speed[np.abs(speed) > threshold])
    return int(np.count_nonzero(np.diff(moving)))


def excursions(signal: Array, threshold: float) -> int:
    """Return how many separate stretches of a signal are beyond +-threshold."""
    beyond = np.abs(signal) > threshold
    return int(np.count_nonzero(beyond[1:] & ~beyond[:-1])) + int(beyond[0])


def fundamental(times: Array, signal: Array, frequency: float) -> complex:
    """Return amplitude and phase (a complex number) of the part of a signal at `frequency` Hz, by least squares.

    A cosine of amplitude A that lags by the phase p at t = 0 gives A exp(-i p). A constant beside it is taken out.
    """
    angle = 2.0 * np.pi * frequency * times
    basis = np.column_stack([np.cos(angle), np.sin(angle), np.ones_like(angle)])
    cosine, sine, _ = np.linalg.lstsq(basis, signal, rcond=None)[0]
    return complex(cosine, -sine)


def phase_lag(times: Array, signal: Array, reference: Array, frequency: float) -> float:
    """Return by how many degrees a signal lags behind a reference at `frequency` Hz, within +-180."""
    ratio = fundamental(times, signal, frequency) / fundamental(times, reference, frequency)
    return float(-np.degrees(np.angle(ratio)))
