"""The Kalman filter against its textbook form in matrices and against its Riccati equation."""

import math

import numpy as np
import pytest
from scipy.linalg import solve_discrete_are

from twip.robot.kalman import correct, measurement_variance, predict

H = np.array([[1.0, 0.0]])
QA, QB = 3.05e-8, 1.22e-7


def test_equals_the_textbook_filter():
    """500 random steps of 1 to 20 ms; the same arithmetic in another order, so equal to 1e-10."""
    generator = np.random.default_rng(1)
    scalar = (0.1, 0.0, 1e-4, 0.0, 3e-4)
    x, p = np.array([0.1, 0.0]), np.diag([1e-4, 3e-4])
    for _ in range(500):
        elapsed, rate, z = generator.uniform(1e-3, 20e-3), generator.normal(), generator.normal(0.1, 0.02)
        r = 10 ** generator.uniform(-5, -2)
        scalar = correct(*predict(*scalar, rate, elapsed, QA, QB), z, r)
        f = np.array([[1.0, -elapsed], [0.0, 1.0]])
        x = f @ x + np.array([elapsed * rate, 0.0])
        p = f @ p @ f.T + np.diag([QA, QB]) * elapsed
        gain = p @ H.T / (H @ p @ H.T + r)
        x = x + (gain * (z - H @ x)).ravel()
        p = (np.eye(2) - gain @ H) @ p
        assert scalar[:2] == pytest.approx(x, rel=1e-10, abs=1e-12)
        assert scalar[2:] == pytest.approx((p[0, 0], p[0, 1], p[1, 1]), rel=1e-9)
        assert p[0, 1] == pytest.approx(p[1, 0], rel=1e-9)


def test_settles_on_the_riccati_solution():
    """After 100 s the predicted covariance is the fixed point; its slowest mode decays within seconds."""
    h, r = 0.005, math.radians(0.6) ** 2
    state = (0.0, 0.0, r, 0.0, math.radians(1.0) ** 2)
    for _ in range(20000):
        state = predict(*state, 0.0, h, QA, QB)
        predicted = state
        state = correct(*state, 0.0, r)
    f = np.array([[1.0, -h], [0.0, 1.0]])
    p = solve_discrete_are(f.T, H.T, np.diag([QA, QB]) * h, np.array([[r]]))
    assert predicted[2:] == pytest.approx((p[0, 0], p[0, 1], p[1, 1]), rel=1e-5)


def test_finds_a_constant_bias():
    """A resting body and a gyro off by 0.5 deg/s: the bias is found and the pitch does not drift."""
    bias, h = math.radians(0.5), 0.005
    state = (0.0, 0.0, math.radians(0.6) ** 2, 0.0, math.radians(1.0) ** 2)
    for _ in range(4000):
        state = correct(*predict(*state, bias, h, QA, QB), 0.2, math.radians(0.6) ** 2)
    assert state[0] == pytest.approx(0.2, abs=1e-4)
    assert state[1] == pytest.approx(bias, rel=1e-2)


def test_measurement_variance():
    """Doubled by a force off by 5 % of g, doubled again by an axle acceleration of 0.5 m/s2."""
    deviation = math.radians(0.6)
    assert measurement_variance(deviation, 9.81, 9.81, 0.0, 0.05, 0.5) == deviation**2
    assert measurement_variance(deviation, 9.81 * 0.95, 9.81, 0.0, 0.05, 0.5) == pytest.approx(2 * deviation**2)
    assert measurement_variance(deviation, 9.81 * 1.05, 9.81, -0.5, 0.05, 0.5) == pytest.approx(4 * deviation**2)
