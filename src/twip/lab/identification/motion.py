"""Speed and acceleration of the shaft over a window of a recording."""

from dataclasses import dataclass
from functools import cache
from itertools import pairwise

import numpy as np

from .recording import Array, Recording

DEGREE = 5
"""Degree of the polynomial through a window's counts: what an exponential of 0.6 s leaves of it in 1 s is 1e-5."""


@dataclass(frozen=True)
class Motion:
    """Mean `speed` [rad/s], its standard error, the mean `acceleration` [rad/s2], and the speed's `spread` over the
    window's quarters [rad/s] beyond what the encoder's count explains.
    """

    speed: float
    speed_error: float
    acceleration: float
    spread: float


def quarter_speeds(recording: Recording, begin: int, end: int) -> Array:
    """Return the mean speeds [rad/s] of the four quarters of a window, (4,)."""
    edges = np.linspace(begin, end - 1, 5).astype(int)
    if recording.angle is not None:
        return np.asarray(np.diff(recording.angle[edges]) / np.diff(recording.time[edges]), np.float64)
    speed = speed_of(recording)
    return np.array([speed[a : b + 1].mean() for a, b in pairwise(edges.tolist())])


def speed_of(recording: Recording) -> Array:
    """Return the recorded speed; raises ValueError where the angle was recorded."""
    if recording.speed is None:
        raise ValueError(f"{recording.name} has no speed")
    return recording.speed


def motion(recording: Recording, begin: int, end: int) -> Motion:
    """Return the motion in the samples `begin` to `end` by least squares: a polynomial through the counts, or a line
    through the speeds.

    The rounding of an encoder that moves slowly repeats itself from sample to sample, so there are not more
    independent readings than counts passed. The error of speeds comes from batch means, which sees correlated noise.
    """
    time = recording.time[begin:end]
    duration = float(time[-1] - time[0])
    t = time - 0.5 * (time[0] + time[-1])
    quarters = quarter_speeds(recording, begin, end)
    if recording.angle is None:
        values = speed_of(recording)[begin:end]
        slope, middle = np.polyfit(t, values, 1)
        batches = np.array([part.mean() for part in np.array_split(values - slope * t, 10)])
        error = float(np.std(batches, ddof=1) / np.sqrt(10.0))
        return Motion(float(middle), error, float(slope), max(float(np.ptp(quarters)) - 8.0 * error, 0.0))
    angle = recording.angle[begin:end]
    fitted = _mean_motion(len(t)) @ (angle - angle[0])
    readings = min(len(t), max(abs(fitted[0]) / recording.angle_step, 2.0)) if recording.angle_step else float(len(t))
    share = float(np.sqrt(np.sum(_mean_motion(len(t))[0] ** 2) * len(t) / readings))
    spread = max(float(np.ptp(quarters)) - 8.0 * recording.angle_step / duration, 0.0)
    error = share * recording.angle_step / np.sqrt(12.0) / duration
    return Motion(float(fitted[0] / duration), error, float(fitted[1] / duration**2), spread)


@cache
def _mean_motion(count: int) -> Array:
    """Return the matrix (2, count) that takes angles at equal intervals to those turned and to the gain of speed from
    end to end, in units of the window: the difference of a fitted polynomial and of its derivative.
    """
    t = np.linspace(-0.5, 0.5, count)
    powers = np.arange(DEGREE + 1)
    to_coefficients = np.linalg.pinv(t[:, None] ** powers)
    ends = 0.5**powers - (-0.5) ** powers
    slopes = np.zeros(DEGREE + 1)
    slopes[1:] = powers[1:] * (0.5 ** powers[:-1] - (-0.5) ** powers[:-1])
    return np.asarray(np.vstack([ends, slopes]) @ to_coefficients, np.float64)
