"""Dry friction on one shaft and on the robot's four contacts."""

import random
from math import exp

import numpy as np
import pytest
from scipy.optimize import nnls

from twip.robot import stiction
from twip.robot.friction import friction_levels, slide_or_stick
from twip.robot.stiction import best_of_all, directions, stick_slip

LEVELS = (7e-4, 5e-4, 9e-4, 4e-4, 0.4)


def test_level_falls_from_static_to_coulomb() -> None:
    assert friction_levels(0.0, *LEVELS) == pytest.approx((9e-4, 4e-4), rel=1e-15)
    assert friction_levels(40.0, *LEVELS) == (7e-4, 5e-4)
    for speed in (0.1, -0.1, 0.4, 1.0):
        weight = exp(-((speed / 0.4) ** 2))
        expected = (7e-4 + 2e-4 * weight, 5e-4 - 1e-4 * weight)
        assert friction_levels(speed, *LEVELS) == pytest.approx(expected, rel=1e-14)


def test_level_without_stribeck_effect_is_exact() -> None:
    assert friction_levels(0.1, 7e-4, 5e-4, 7e-4, 5e-4, 0.4) == (7e-4, 5e-4)


def test_level_with_stribeck_speed_zero_is_static_at_rest_only() -> None:
    assert friction_levels(0.0, 1.0, 1.0, 2.0, 3.0, 0.0) == (2.0, 3.0)
    assert friction_levels(1e-9, 1.0, 1.0, 2.0, 3.0, 0.0) == (1.0, 1.0)


@pytest.mark.parametrize(
    ("speed", "impulse", "expected"),
    [
        (0.0, 2.9, 0.0),
        (0.0, 3.5, 0.25),
        (0.0, -1.9, 0.0),
        (0.0, -4.0, -1.0),
        (5.0, -3.0, 2.0),
        (1.0, -1.0, 0.0),
        (1.0, -6.0, -1.0),
    ],
)
def test_one_shaft(speed: float, impulse: float, expected: float) -> None:
    assert slide_or_stick(speed, impulse, 2.0, 3.0, 2.0) == expected


ROWS = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.0, -1.0], [0.0, 1.0, -1.0]])


class Problem:
    """A random problem of the kind a step poses."""

    def __init__(self, draw: random.Random) -> None:
        m24 = draw.uniform(-0.0080, 0.0075)
        self.inertia = (2.0669e-3, 9.731e-4, 0.5 * m24, 1.869e-2)
        side, cross, mixed, own = self.inertia
        self.matrix = np.array([[side, cross, mixed], [cross, side, mixed], [mixed, mixed, own]])
        left, right, pitch = (draw.gauss(0.0, 1.0) * 10.0 ** draw.uniform(-6, 0) for _ in range(3))
        left, right, pitch = draw.choice(
            [(left, right, pitch)] * 3
            + [(pitch, right, pitch), (pitch, pitch, pitch), (0.0, right, pitch), (0.0, 0.0, 0.0)]
        )
        self.guess = directions((left, right, pitch))
        step = 10.0 ** draw.uniform(-5, -3)
        torque = np.array([draw.gauss(0.0, 0.02) for _ in range(3)])
        self.momenta = tuple((self.matrix @ [left, right, pitch] + step * torque).tolist())
        values = [abs(draw.gauss(0.0, 0.01)) * step * draw.choice([1, 1, 1, 0]) for _ in range(5)]
        self.limits = (values[0], *values)

    def disagreement(self, speeds: tuple[float, ...], impulses: tuple[float, ...]) -> float:
        """Return the largest violation of balance and friction law, relative to the largest momentum."""
        p = np.array(self.momenta)
        worst = np.abs(self.matrix @ speeds - p - ROWS.T @ impulses).max()
        left, right, pitch = speeds
        contacts = zip(
            (left, right, left - pitch, right - pitch), impulses, self.forward(), self.reverse(), strict=True
        )
        for speed, impulse, forward, reverse in contacts:
            if speed != 0.0:
                worst = max(worst, abs(impulse - (-forward if speed > 0.0 else reverse)))
            else:
                worst = max(worst, -forward - impulse, impulse - reverse)
        return float(worst / np.abs(p).max())

    def forward(self) -> tuple[float, ...]:
        return (*self.limits[:2], self.limits[2], self.limits[4])

    def reverse(self) -> tuple[float, ...]:
        return (*self.limits[:2], self.limits[3], self.limits[5])


# rounding of a 3x3 system with condition number below 1e3, two of them in sequence
ROUNDING = 1e-11


def test_speeds_and_impulses_obey_balance_and_friction_law() -> None:
    draw = random.Random(1)
    for _ in range(3000):
        problem = Problem(draw)
        speeds, impulses = stick_slip(problem.inertia, problem.momenta, problem.limits, problem.guess)
        assert problem.disagreement(speeds, impulses) < ROUNDING


def test_the_guess_decides_nothing() -> None:
    draw = random.Random(2)
    for _ in range(300):
        problem = Problem(draw)
        results = [
            stick_slip(problem.inertia, problem.momenta, problem.limits, guess)[0]
            for guess in (problem.guess, (1.0, 1.0, 1.0, 1.0), (-1.0, 1.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0))
        ]
        scale = max(abs(p) for p in problem.momenta) / problem.inertia[0]
        for result in results[1:]:
            assert result == pytest.approx(results[0], abs=ROUNDING * scale)


def test_search_through_all_modes_finds_the_same() -> None:
    draw = random.Random(3)
    moving = 0
    for _ in range(300):
        problem = Problem(draw)
        speeds, _ = stick_slip(problem.inertia, problem.momenta, problem.limits, problem.guess)
        if speeds != (0.0, 0.0, 0.0):
            moving += 1
            found, _ = best_of_all(problem.inertia, problem.momenta, problem.limits)
            scale = max(abs(p) for p in problem.momenta) / problem.inertia[0]
            assert found == pytest.approx(speeds, abs=ROUNDING * scale)
    assert moving > 100


def test_speeds_minimize_energy_and_dissipation() -> None:
    """The dual problem, least squares over impulses within their limits, solved by a solver of another kind."""
    draw = random.Random(4)
    for _ in range(200):
        problem = Problem(draw)
        speeds, _ = stick_slip(problem.inertia, problem.momenta, problem.limits, problem.guess)
        # j = -forward + y, 0 <= y <= forward + reverse: kinetic energy after the step is smallest; the upper bounds
        # enter nnls as slack variables with a large weight
        forward, width = np.array(problem.forward()), np.array(problem.forward()) + problem.reverse()
        root = np.linalg.cholesky(np.linalg.inv(problem.matrix)).T
        p = np.array(problem.momenta)
        scale = np.abs(root @ p).max()
        if width.max() == 0.0:
            continue
        weight = 1e6 * scale / width.max()
        a = np.block([[root @ ROWS.T, np.zeros((3, 4))], [weight * np.eye(4), weight * np.eye(4)]])
        b = np.concatenate([-root @ (p - ROWS.T @ forward), weight * width])
        y, _ = nnls(a, b, maxiter=1000)
        expected = np.linalg.solve(problem.matrix, p + ROWS.T @ (y[:4] - forward))
        # the weight lets the bounds give way by about 1e-6 of the speeds
        assert np.abs(expected - speeds).max() < 1e-4 * np.abs(np.linalg.solve(problem.matrix, p)).max()


def test_what_sticks_is_exactly_at_rest() -> None:
    draw = random.Random(5)
    seen = set()
    for _ in range(3000):
        problem = Problem(draw)
        (left, right, pitch), impulses = stick_slip(problem.inertia, problem.momenta, problem.limits, problem.guess)
        speeds = (left, right, left - pitch, right - pitch)
        inside = [-f < j < r for j, f, r in zip(impulses, problem.forward(), problem.reverse(), strict=True)]
        at_rest = tuple(speed == 0.0 for speed in speeds)
        assert all(still for still, within in zip(at_rest, inside, strict=True) if within)
        seen.add(at_rest)
        assert sum(at_rest) in (0, 1, 2, 4)
    assert len(seen) == 12  # none, four single, six pairs, all


def test_limits_of_zero_are_no_friction() -> None:
    inertia, momenta = (2e-3, 1e-3, 3e-3, 2e-2), (1e-3, -2e-3, 5e-4)
    speeds, impulses = stick_slip(inertia, momenta, (0.0,) * 6, (1.0, -1.0, 0.0, 0.0))
    matrix = np.array([[2e-3, 1e-3, 3e-3], [1e-3, 2e-3, 3e-3], [3e-3, 3e-3, 2e-2]])
    assert speeds == pytest.approx(tuple(np.linalg.solve(matrix, momenta)), rel=1e-12)
    assert impulses == pytest.approx((0.0,) * 4, abs=1e-15)
    assert stiction.sticking((0.0, 1.0, 0.0, -1.0)) == 2
