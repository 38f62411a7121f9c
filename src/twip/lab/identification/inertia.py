"""The inertia on the motor shaft from run-ups at constant current (paper, eqs 6 to 12, Fig 4)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import curve_fit

from .estimate import CONFIDENCE, Estimate, judged
from .friction import Friction
from .recording import Array
from .run_up import RunUp

NAME, UNIT = "bench_inertia", "kg.m2"
STEPS, ROUNDS = 30, 2
"""Most Gauss-Newton steps, and how often the weights are taken from the scatter."""
CONVERGED = 0.01
"""Largest last step, in standard deviations, of a fit that has found its place."""
REGULATION = 1e-5
"""Deviation of a driven current, relative to it and in proportion to the shaft's acceleration, that no noisy sensor
sees but that counts as inertia. Our bench's drive leaves up to 3e-5 of the current at the beginning of a run-up; this
is set against the mean acceleration, which is several times smaller."""
ADVICE = "needs a run-up at constant current in which the speed changes more"


def estimated_inertia(
    wheel_mass: float, wheel_radius: float, gear_ratio: float, rotor_inertia: float, gear_inertia: float
) -> float:
    """Return the inertia [kg.m2] on the motor shaft with a wheel that is a uniform disc.

    J = m R^2/(2 n^2) + J_m + J_redu

    Masses in kg, radius in m, inertias in kg.m2. Source: paper eq (12).
    """
    return wheel_mass * wheel_radius**2 / (2.0 * gear_ratio**2) + rotor_inertia + gear_inertia


def run_up_curve(t: Array, a: float, b: float) -> Array:
    """Return omega = a (1 - e^-bt) [rad/s], with t [s] since the shaft stood; paper eq (10)."""
    return np.asarray(a * -np.expm1(-b * t), np.float64)


@dataclass(frozen=True)
class CurveFit:
    """Paper's fit of a run-up: final speed `a` [rad/s] and `b` [1/s]."""

    a: float
    b: float

    def inertia(self, viscous: float) -> float:
        """Return J = sigma/b [kg.m2], sigma in N.m.s/rad; paper eq (11)."""
        return viscous / self.b


def fit_curve(t: Array, speed: Array) -> CurveFit:
    """Fit omega = a (1 - e^-bt) to speeds [rad/s] at times [s] since the current was switched on (paper, Fig 4)."""
    start = (float(speed[-1]), 3.0 / float(t[-1]))
    (a, b), _ = curve_fit(run_up_curve, t, speed, p0=start)
    return CurveFit(float(a), float(b))


@dataclass(frozen=True)
class Shaft:
    """Angle turned [rad] and speed [rad/s] at times [s] after the speed was `start`, at constant torque, all (n,).

    omega = omega_f + (omega_0 - omega_f) e^-bt,   theta = omega_f t + (omega_0 - omega_f) (1 - e^-bt)/b

    b = sigma/J [1/s], final speed omega_f = (K_t i - T_c)/sigma [rad/s]. Source: paper eq (8), corrected.
    """

    time: Array
    start: Array
    final: Array
    rate: Array

    def motion(self, angular: NDArray[np.bool_]) -> Array:
        """Return angle where `angular`, else speed."""
        fall = -np.expm1(-self.rate * self.time)
        angle = self.final * self.time + (self.start - self.final) * fall / self.rate
        return np.where(angular, angle, self.final + (self.start - self.final) * (1.0 - fall))

    def sensitivities(self, angular: NDArray[np.bool_]) -> tuple[Array, Array, Array]:
        """Return the derivatives of `motion` with respect to start, final and rate."""
        fall = -np.expm1(-self.rate * self.time)
        late = self.time * (1.0 - fall)
        far = self.start - self.final
        return (
            np.where(angular, fall / self.rate, 1.0 - fall),
            np.where(angular, self.time - fall / self.rate, fall),
            far * np.where(angular, (late - fall / self.rate) / self.rate, -late),
        )


class RunUpResiduals:
    """What all run-ups say against one inertia, in standard deviations.

    Unknowns: [log J; z of each direction's friction; z of each run-up's current; initial speed of each run-up]. A z is
    a known value's deviation in standard deviations and a residual of its own. The friction is `values + root z`. The
    initial angle of a run-up is eliminated: residuals of angles are taken about their mean.
    """

    def __init__(self, runs: Sequence[RunUp], frictions: Mapping[int, Friction], torque_constant: float):
        self.runs, self.frictions, self.torque_constant = runs, frictions, torque_constant
        self.points = np.concatenate([np.full(len(run.time), k) for k, run in enumerate(runs)])
        self.time = np.concatenate([run.time for run in runs])
        self.values = np.concatenate([run.values for run in runs])
        self.angular = np.array([run.angular for run in runs])[self.points]
        self.current = np.array([run.current for run in runs])
        self.current_error = np.array([run.current_error for run in runs])
        self.errors = np.array([run.error for run in runs])
        self.roots, self.columns, column = {}, {}, 1
        for direction, friction in frictions.items():
            self.roots[direction] = _root(friction.covariance)
            self.columns[direction] = slice(column, column + len(friction.values))
            column += len(friction.values)
        self.first_current, self.first_speed = column, column + len(runs)

    def start(self, inertia: float) -> Array:
        """Return the unknowns to begin with."""
        speeds = [max(run.speed - 0.5 * run.acceleration * run.time[-1], 1.0) for run in self.runs]
        return np.concatenate([[np.log(inertia)], np.zeros(self.first_speed - 1), speeds])

    def _friction(self, x: Array, direction: int) -> Array:
        return np.asarray(
            self.frictions[direction].values + self.roots[direction] @ x[self.columns[direction]], np.float64
        )

    def _shaft(self, x: Array) -> tuple[Shaft, Array]:
        """Return the motion of all points, and T_c, sigma and current of each run-up (3, runs)."""
        frictions = {direction: self._friction(x, direction) for direction in self.frictions}
        runs, known = self.runs, np.empty((3, len(self.runs)))
        for k, run in enumerate(runs):
            friction = frictions[run.direction]
            current = self.current[k] + self.current_error[k] * x[self.first_current + k]
            known[:, k] = friction[0], friction[1], current - run.direction * friction[2 + run.recording]
        coulomb, viscous, current = known
        final, rate = (self.torque_constant * current - coulomb) / viscous, viscous / np.exp(x[0])
        each = self.points
        return Shaft(self.time, x[self.first_speed :][each], final[each], rate[each]), known

    def _about_mean(self, values: Array) -> Array:
        """Return values (points,) minus their run-up's mean where they are angles."""
        means = np.bincount(self.points, values) / np.bincount(self.points)
        return np.asarray(values - np.where(self.angular, means[self.points], 0.0), np.float64)

    def deviations(self, x: Array) -> Array:
        """Return data minus model (points,), in rad or rad/s."""
        return self._about_mean(self.values - self._shaft(x)[0].motion(self.angular))

    def normal_equations(self, x: Array) -> tuple[Array, Array]:
        """Return J'J and J'r of the residuals' Jacobian J and the residuals r, for unknowns that shall be added to."""
        shaft, (_, viscous, _) = self._shaft(x)
        by_start, by_final, by_rate = shaft.sensitivities(self.angular)
        each = self.points
        jacobian = np.zeros((len(each), len(x)))
        jacobian[:, 0] = -by_rate * shaft.rate
        rows = np.arange(len(each))
        gain = self.torque_constant / viscous[each]
        jacobian[rows, self.first_current + each] = by_final * gain * self.current_error[each]
        jacobian[rows, self.first_speed + each] = by_start
        for direction, friction in self.frictions.items():
            mine = np.array([run.direction == direction for run in self.runs])[each]
            by_friction = np.zeros((len(each), len(friction.values)))
            by_friction[:, 0] = -by_final / viscous[each]
            by_friction[:, 1] = (by_rate * shaft.rate - by_final * shaft.final) / viscous[each]
            recordings = np.array([run.recording for run in self.runs])[each]
            by_friction[rows, 2 + recordings] = -direction * by_final * gain
            jacobian[:, self.columns[direction]] = mine[:, None] * (by_friction @ self.roots[direction])
        error = self.errors[each]
        for column in range(jacobian.shape[1]):
            jacobian[:, column] = self._about_mean(jacobian[:, column]) / error
        known = np.zeros(len(x))
        known[1 : self.first_speed] = 1.0
        square = jacobian.T @ jacobian + np.diag(known)
        return square, jacobian.T @ (self.deviations(x) / error) - known * x

    def weigh(self, x: Array) -> None:
        """Take the run-ups' errors from their scatter at `x` where it is larger, and count correlated points once."""
        found = self.deviations(x)
        for k, run in enumerate(self.runs):
            rest = found[self.points == k]
            correlation = float(np.clip(rest[1:] @ rest[:-1] / max(float(rest @ rest), 1e-300), 0.0, 0.95))
            scatter = float(np.sqrt(rest @ rest / max(len(rest) - 3, 1)))
            self.errors[k] = max(run.error, scatter) * np.sqrt((1.0 + correlation) / (1.0 - correlation))


def _root(covariance: Array) -> Array:
    """Return a matrix R with R R' = covariance, which may be singular."""
    sizes = np.sqrt(np.diag(covariance))
    sizes = np.where(sizes > 0.0, sizes, 1.0)
    values, vectors = np.linalg.eigh(covariance / np.outer(sizes, sizes))
    return np.asarray(sizes[:, None] * vectors * np.sqrt(np.maximum(values, 0.0)), np.float64)


def fit_inertia(runs: Sequence[RunUp], frictions: Mapping[int, Friction], torque_constant: float) -> Estimate:
    """Return the inertia [kg.m2] that all run-ups share, fitted to their angles (or speeds) directly.

    J domega/dt = K_t i - T_c - sigma omega

    with the friction of each direction known within its covariance, the current's mean within its error, initial
    angle and speed free. torque_constant K_t [N.m/A]. Uses only run-ups in directions whose friction is known.
    """
    used = [run for run in runs if run.direction in frictions]
    if not used:
        return Estimate(NAME, UNIT, None, reason=f"no run-up in the data; {ADVICE}")
    known = {d: frictions[d] for d in sorted({run.direction for run in used})}
    if any(friction.values[1] <= 0.0 for friction in known.values()):
        return Estimate(NAME, UNIT, None, reason="the viscous friction, on which it rests, is not identifiable")
    residuals = RunUpResiduals(used, known, torque_constant)
    found, variance = residuals.start(_rough(used, known, torque_constant)), np.inf
    for _ in range(ROUNDS):
        change = np.ones(1)
        for _ in range(STEPS):
            with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
                square, slope = residuals.normal_equations(found)
            if not (np.all(np.isfinite(square)) and np.all(np.isfinite(slope))):
                return Estimate(NAME, UNIT, None, reason=f"the fit of the run-ups diverges; {ADVICE}")
            inverse = np.linalg.pinv(square, hermitian=True)
            change, variance = inverse @ slope, float(inverse[0, 0])
            change[0] = np.clip(change[0], -1.0, 1.0)
            found = found + change
            if abs(change[0]) < 1e-9:
                break
        if not abs(change[0]) <= CONVERGED * np.sqrt(variance):
            return Estimate(NAME, UNIT, None, reason=f"the fit of the run-ups does not converge; {ADVICE}")
        residuals.weigh(found)
    value = float(np.exp(found[0]))
    drive = torque_constant * REGULATION * float(np.median([run.current / abs(run.acceleration) for run in used]))
    variance += (drive / value) ** 2
    half = NormalDist().inv_cdf(0.5 + 0.5 * CONFIDENCE) * float(np.sqrt(variance)) * value
    return judged(NAME, UNIT, value, value - half, value + half, ADVICE)


def _rough(runs: Sequence[RunUp], frictions: Mapping[int, Friction], torque_constant: float) -> float:
    """Return the median of net torque over acceleration."""
    found = [
        (torque_constant * run.current - frictions[run.direction].values[:2] @ (1.0, run.speed)) / run.acceleration
        for run in runs
    ]
    return float(max(np.median(found), 1e-9))
