"""Stribeck friction of one direction from steady samples (paper, eqs 4 and 5, tables 2 and 4)."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq, minimize_scalar
from scipy.stats import f as fisher

from .estimate import Estimate, judged
from .friction import WAYS, Balance, Friction, combination, coulomb_estimates, fit_coulomb
from .least_squares import Fit, weighted_fit
from .recording import Array

GRID = 80
"""Stribeck speeds tried, in equal ratios."""
SIGNIFICANCE = 1e-3
"""Probability of taking noise for a Stribeck effect, before the search over its speed."""
FEWEST = 6
"""Fewest steady samples for the four parameters."""


@dataclass(frozen=True)
class Profile:
    """The best fit for each Stribeck speed: the model is linear in all other parameters, so no start value is needed.

    T_f = T_c + (T_s - T_c) e^-(omega/v_s)^2 + sigma |omega|        parameters [T_c, sigma, T_s - T_c, offsets]
    """

    data: Balance
    slope: Array
    lowest: float
    highest: float

    def fit(self, stribeck_speed: float) -> Fit | None:
        """Return the fit at a Stribeck speed [rad/s]."""
        d = self.data
        weight = np.exp(-((d.speed / stribeck_speed) ** 2))
        design = np.column_stack([np.ones_like(d.speed), d.speed, weight, d.offsets])
        return weighted_fit(design, d.torque, d.errors(self.slope), d.offset_error, d.known_errors)

    def chi2(self, log_speed: float) -> float:
        """Return the weighted squares at the logarithm of a Stribeck speed; infinite where nothing is determined."""
        fit = self.fit(float(np.exp(log_speed)))
        return np.inf if fit is None else fit.chi2

    def grid(self) -> Array:
        """Return the logarithms of the Stribeck speeds to try."""
        return np.linspace(np.log(self.lowest), np.log(self.highest), GRID)

    def best(self) -> float | None:
        """Return the logarithm of the Stribeck speed with the least squares; None at an end of the range."""
        grid = self.grid()
        values = np.array([self.chi2(x) for x in grid])
        i = int(np.argmin(values))
        if i in (0, GRID - 1) or not np.isfinite(values[i]):
            return None
        found = minimize_scalar(self.chi2, bounds=(grid[i - 1], grid[i + 1]), method="bounded", options={"xatol": 1e-7})
        return float(found.x)

    def bounds(self, best: float, rise: float) -> tuple[float, float] | None:
        """Return where the weighted squares have risen by `rise`; None if that is out of the range on a side."""
        limit = self.chi2(best) + rise
        grid = self.grid()
        ends = []
        for side in (grid[grid < best][::-1], grid[grid > best]):
            inner = best
            for x in side.tolist():
                if self.chi2(x) > limit:
                    low, high = sorted((inner, x))
                    ends.append(brentq(lambda y: self.chi2(y) - limit, low, high, xtol=1e-6))
                    break
                inner = x
            else:
                return None
        return float(np.exp(ends[0])), float(np.exp(ends[1]))


def profile(data: Balance, slope: Array) -> Profile:
    """Return the profile over every Stribeck speed that the samples could show.

    From a third of the slowest speed, where the effect on it is e^-9, to a quarter of the fastest: what reaches further
    cannot be told from viscous friction that is not quite linear.
    """
    return Profile(data, slope, float(data.speed.min()) / 3.0, float(data.speed.max()) / 4.0)


def fit_friction(data: Balance, direction: int) -> Friction | None:
    """Return the friction of a direction: the Stribeck model if the samples show its effect, else Coulomb plus viscous.

    The effect is there if the Stribeck model fits better than chance explains (F test), and T_s and v_s are
    identifiable if the 95 % interval of v_s, where the weighted squares rise, is closed on both sides, and neither
    half interval is wider than half of the value. None if not even T_c and sigma are determined.
    """
    plain = fit_coulomb(data)
    if plain is None:
        return None
    coulomb, viscous = coulomb_estimates(plain, direction)
    slowest, fastest = float(data.speed.min()), float(data.speed.max())
    unseen = f"the samples, from {slowest:.3g} to {fastest:.3g} rad/s, show no Stribeck effect; it needs slower ones"
    static = Estimate(f"static_{WAYS[direction]}", "N.m", None, reason=unseen)
    speed = Estimate(f"stribeck_speed_{WAYS[direction]}", "rad/s", None, reason=unseen)
    size = len(plain.values)
    found = Friction(
        direction, len(data.speed), slowest, fastest, coulomb, viscous, static, speed, plain.values, plain.covariance
    )
    if len(data.speed) < FEWEST or fastest < 12.0 * slowest:
        return found
    search = profile(data, np.full_like(data.speed, plain.values[1]))
    best = search.best()
    fit = None if best is None else search.fit(np.exp(best))
    if best is None or fit is None:
        return found
    freedom = fit.freedom - 1  # the Stribeck speed
    gain = (plain.chi2 - fit.chi2) / 2.0 / max(fit.chi2 / freedom, 1.0 if data.known_errors else 0.0)
    if gain < float(fisher.isf(SIGNIFICANCE, 2, freedom)):
        return found
    search = replace(search, slope=_slope(data, fit, float(np.exp(best))))
    best = search.best()
    linear = None if best is None else _with_speed(search, float(np.exp(best)))
    if best is None or linear is None:
        return found
    return _stribeck(found, search, best, linear, size)


def _slope(data: Balance, fit: Fit, stribeck_speed: float) -> Array:
    """Return d T_f / d omega (n,) of a fit."""
    relative = data.speed / stribeck_speed
    slope = fit.values[1] - fit.values[2] * 2.0 * relative / stribeck_speed * np.exp(-(relative**2))
    return np.asarray(slope, np.float64)


def _with_speed(search: Profile, stribeck_speed: float) -> Fit | None:
    """Return the fit with the covariance of [T_c, sigma, T_s - T_c, change of v_s, offsets]: one Gauss-Newton step."""
    d, fit = search.data, search.fit(stribeck_speed)
    if fit is None:
        return None
    relative = d.speed / stribeck_speed
    weight = np.exp(-(relative**2))
    change = fit.values[2] * weight * 2.0 * relative**2 / stribeck_speed
    design = np.column_stack([np.ones_like(d.speed), d.speed, weight, change, d.offsets])
    return weighted_fit(design, d.torque, d.errors(search.slope), d.offset_error, d.known_errors)


def _stribeck(found: Friction, search: Profile, best: float, fit: Fit, size: int) -> Friction:
    """Return `found` with the Stribeck model's estimates."""
    way, total = WAYS[found.direction], len(fit.values)
    coulomb, viscous = coulomb_estimates(fit, found.direction)
    kept = [0, 1, *range(4, total)]
    speed = float(np.exp(best))
    static_value = float(fit.values[0] + fit.values[2])
    bounds = search.bounds(best, fit.quantile**2 * fit.scale)
    advice = "needs more samples below and around the Stribeck speed"
    if bounds is None:
        open_ended = f"its interval is open: the samples show the tail of a Stribeck effect only; {advice}"
        static = Estimate(f"static_{way}", "N.m", None, reason=open_ended)
        stribeck_speed = Estimate(f"stribeck_speed_{way}", "rad/s", None, reason=open_ended)
    else:
        half = fit.half_width(combination(total, 0, 2))
        static = judged(f"static_{way}", "N.m", static_value, static_value - half, static_value + half, advice)
        stribeck_speed = judged(f"stribeck_speed_{way}", "rad/s", speed, *bounds, advice)
    return replace(
        found,
        coulomb=coulomb,
        viscous=viscous,
        static=static,
        stribeck_speed=stribeck_speed,
        values=fit.values[kept][:size],
        covariance=fit.covariance[np.ix_(kept, kept)],
    )
