"""Coulomb-plus-viscous friction of one direction from steady samples (paper, eqs 1 to 3, tables 1 and 3)."""

from dataclasses import dataclass

import numpy as np

from .estimate import Estimate, judged
from .least_squares import Fit, weighted_fit
from .recording import Array
from .steady import SteadySamples

FEWEST = 3
"""Fewest steady samples of a direction."""
WAYS = {1: "forward", -1: "reverse"}


@dataclass(frozen=True)
class Balance:
    """Friction torques at speeds, both as magnitudes (n,), [N.m] and [rad/s], what they are uncertain by, and how the
    zero of each recording's current enters them: `offsets` (n, recordings) [N.m/A], `offset_error` [A].
    """

    speed: Array
    torque: Array
    torque_error: Array
    speed_error: Array
    offsets: Array
    offset_error: Array
    known_errors: bool

    def errors(self, slope: Array) -> Array:
        """Return the standard errors of the torques (n,), with the speeds' at the friction's slope [N.m.s/rad]."""
        return np.asarray(np.hypot(self.torque_error, slope * self.speed_error), np.float64)


def balance(samples: SteadySamples, direction: int, torque_constant: float, inertia: float) -> Balance:
    """Return the friction that the samples of one direction (1 or -1) show.

    T_f = K_t I - J domega/dt   in the direction of motion

    torque_constant K_t [N.m/A]; inertia J [kg.m2] corrects the little acceleration that is left, 0 leaves it. Source:
    paper eqs (2) and (6).
    """
    s = samples.towards(direction)
    torque = direction * (torque_constant * s.current - inertia * s.acceleration)
    offsets = np.zeros((len(s), len(s.offset_error)))
    offsets[np.arange(len(s)), s.recording] = direction * torque_constant
    return Balance(
        np.abs(s.speed), torque, torque_constant * s.current_error, s.speed_error, offsets, s.offset_error,
        s.known_errors,
    )  # fmt: skip


@dataclass(frozen=True)
class Friction:
    """Friction of one direction.

    `values` and `covariance` are those of [T_c, sigma, offsets of the recordings' currents] in N.m, N.m.s/rad, A, in
    the model that was chosen: they are what the inertia's fit takes. Estimates are for the reader; any of them may be
    not identifiable.
    """

    direction: int
    samples: int
    slowest: float
    fastest: float
    coulomb: Estimate
    viscous: Estimate
    static: Estimate
    stribeck_speed: Estimate
    values: Array
    covariance: Array

    @property
    def estimates(self) -> tuple[Estimate, ...]:
        """All estimates in the order of the table."""
        return (self.coulomb, self.viscous, self.static, self.stribeck_speed)


def fit_coulomb(data: Balance) -> Fit | None:
    """Fit T_f = T_c + sigma |omega|; parameters [T_c [N.m], sigma [N.m.s/rad], offsets [A]]. None if not determined.

    The intercept of the line is T_c and its slope sigma: paper eq (3) has them the other way round.
    """
    if len(data.speed) < FEWEST:
        return None
    design = np.column_stack([np.ones_like(data.speed), data.speed, data.offsets])
    slope = np.zeros_like(data.speed)
    fit = None
    for _ in range(2):  # the weight of a speed's error needs the slope
        fit = weighted_fit(design, data.torque, data.errors(slope), data.offset_error, data.known_errors)
        if fit is None:
            return None
        slope = np.full_like(data.speed, fit.values[1])
    return fit


def combination(size: int, *indices: int) -> Array:
    """Return the vector that sums some of `size` parameters."""
    vector = np.zeros(size)
    vector[list(indices)] = 1.0
    return vector


def coulomb_estimates(fit: Fit, direction: int) -> tuple[Estimate, Estimate]:
    """Return T_c and sigma with their intervals, named as the motor's parameters."""
    names = (
        ("coulomb", "N.m", "needs slower samples"),
        ("viscous", "N.m.s/rad", "needs samples further apart in speed"),
    )
    found = []
    for index, (name, unit, advice) in enumerate(names):
        half = fit.half_width(combination(len(fit.values), index))
        value = float(fit.values[index])
        found.append(judged(f"{name}_{WAYS[direction]}", unit, value, value - half, value + half, advice))
    return found[0], found[1]
