"""The inertial sensor against kinematics derived in world axes, and its noise, bias, quantization and saturation."""

import math

import numpy as np
import pytest
import sympy as sp
from plain import instance, load, started
from scipy import signal

from twip.robot.imu import angular_rate, digitized, specific_force
from twip.robot.parameters import value

IMU = load("imu").BLOCK
OUTPUTS = ("gyro", "gyro_yaw", "accel_x", "accel_y", "accel_z")
QUIET = {"noise": 0.0, "quantization": 0.0}
UNBIASED = dict.fromkeys(("gyro_bias", "gyro_yaw_bias", "accel_x_bias", "accel_y_bias", "accel_z_bias"), 0.0)
MOVING = {
    "pitch": 0.2, "pitch_rate": -0.7, "pitch_acceleration": 9.0, "wheel_rate": 6.0, "wheel_acceleration": -30.0,
    "yaw_rate": 1.5, "yaw_acceleration": -4.0, "ground_slope": 0.05, "ground_slope_rate": 0.4,
}  # fmt: skip


def world_kinematics():
    """Return specific force and angular rate on level ground as functions of the motion, derived in world axes.

    The axle's middle moves with R theta' along its heading; the body hangs on it by a rotation about the vertical and
    then about the axle. The sensor's acceleration is the second time derivative of its position, the specific force is
    that less gravity, seen in body axes; the angular rate comes from the rotation's derivative.
    """
    t = sp.Symbol("t")
    psi, phi, theta = (sp.Function(name)(t) for name in ("psi", "phi", "theta"))
    g, radius, length, beta = sp.symbols("g R L beta")
    about_vertical = sp.Matrix([[sp.cos(phi), -sp.sin(phi), 0], [sp.sin(phi), sp.cos(phi), 0], [0, 0, 1]])
    about_axle = sp.Matrix([[sp.cos(psi), 0, sp.sin(psi)], [0, 1, 0], [-sp.sin(psi), 0, sp.cos(psi)]])
    rotation = about_vertical * about_axle
    axle_velocity = radius * theta.diff(t) * about_vertical * sp.Matrix([1, 0, 0])
    arm = rotation * length * sp.Matrix([sp.cos(beta), 0, sp.sin(beta)])
    force = rotation.T * (axle_velocity.diff(t) + arm.diff(t, 2) + sp.Matrix([0, 0, g]))
    skew = rotation.T * rotation.diff(t)
    rates = sp.Matrix([skew[0, 2], skew[1, 0]])
    symbols, replacements = [], []
    for function, lowest in ((psi, 0), (theta, 1), (phi, 0)):
        for order in (2, 1, 0):
            if order >= lowest:
                symbol = sp.Symbol(f"{function.func}_{order}")
                replacements.append((function.diff(t, order) if order else function, symbol))
                symbols.append(symbol)
    arguments = (*symbols, g, radius, length, beta)
    return tuple(sp.lambdify(arguments, list(e.subs(replacements)), "math") for e in (force, rates))


def test_equals_the_derivative_of_the_position_in_world_axes():
    """Exact formulas on both sides: only rounding is left, 1e-12 of forces up to some 100 m/s2."""
    force, rates = world_kinematics()
    generator = np.random.default_rng(3)
    for _ in range(200):
        psi, phi = generator.uniform(-1.2, 1.2, 2)
        psi1, phi1 = generator.uniform(-6, 6, 2)
        theta1, psi2, phi2, theta2 = generator.uniform(-60, 60, 4)
        beta, length = generator.uniform(-math.pi, math.pi), generator.uniform(0, 0.3)
        constants = (9.81, 0.05, length, beta)
        expected = force(psi2, psi1, psi, theta2, theta1, phi2, phi1, phi, *constants)
        found = specific_force(psi, psi1, psi2, theta1, theta2, phi1, phi2, 0.0, 0.0, *constants)
        assert found == pytest.approx(expected, rel=1e-12, abs=1e-10)
        expected = rates(psi2, psi1, psi, theta2, theta1, phi2, phi1, phi, *constants)
        assert angular_rate(psi, psi1, phi1, 0.0) == pytest.approx(expected, rel=1e-12, abs=1e-12)


def test_equals_the_rotating_frame_on_a_curved_slope():
    """The ground's frame (heading, left, normal) turns with (0, -a', phi'); the sensor moves in it as the lean changes.

    Acceleration in a rotating frame: r'' + 2 Omega x r' + Omega' x r + Omega x (Omega x r). The second derivative of
    the slope must drop out, for the body's pitch is absolute. Only rounding is left.
    """
    generator = np.random.default_rng(4)
    for _ in range(200):
        psi, alpha = generator.uniform(-1.0, 1.0, 2)
        psi1, phi1, alpha1 = generator.uniform(-6, 6, 3)
        theta1, psi2, phi2, theta2, alpha2 = generator.uniform(-60, 60, 5)
        beta, length = generator.uniform(-math.pi, math.pi), generator.uniform(0, 0.3)
        chi, chi1, chi2 = psi + alpha, psi1 + alpha1, psi2 + alpha2
        place = length * np.array([math.cos(beta - chi), 0.0, math.sin(beta - chi)])
        tangent = length * np.array([math.sin(beta - chi), 0.0, -math.cos(beta - chi)])
        moving, changing = tangent * chi1, tangent * chi2 - place * chi1**2
        omega, omega1 = np.array([0.0, -alpha1, phi1]), np.array([0.0, -alpha2, phi2])
        axle = np.array([0.05 * theta2, 0.0, 0.0]) + np.cross(omega, [0.05 * theta1, 0.0, 0.0])
        arm = changing + 2 * np.cross(omega, moving) + np.cross(omega1, place)
        total = axle + arm + np.cross(omega, np.cross(omega, place))
        total += 9.81 * np.array([math.sin(alpha), 0.0, math.cos(alpha)])  # less gravity
        forward = np.array([math.cos(chi), 0.0, -math.sin(chi)])
        up = np.array([math.sin(chi), 0.0, math.cos(chi)])
        found = specific_force(psi, psi1, psi2, theta1, theta2, phi1, phi2, alpha, alpha1, 9.81, 0.05, length, beta)
        assert found == pytest.approx((total @ forward, total[1], total @ up), rel=1e-12, abs=1e-10)
        body = omega + np.array([0.0, chi1, 0.0])
        assert angular_rate(psi, psi1, phi1, alpha) == pytest.approx((body[1], body @ up), rel=1e-12, abs=1e-12)


def test_at_rest_it_feels_gravity():
    v = started(IMU, pitch=math.radians(27), **QUIET, **UNBIASED)
    assert (v.gyro, v.gyro_yaw, v.accel_y) == (0.0, 0.0, 0.0)
    assert (v.accel_x, v.accel_z) == pytest.approx(
        (-9.81 * math.sin(math.radians(27)), 9.81 * math.cos(math.radians(27))), rel=1e-15
    )


def test_without_noise_and_quantization_it_is_exact_but_for_the_bias():
    clean = started(IMU, **QUIET, **UNBIASED, **MOVING)
    biased = started(IMU, **QUIET, **MOVING)
    for v in (clean, biased):
        IMU.step(v, 0.0, 0.005)
    truth = specific_force(*MOVING.values(), 9.81, 0.05, 0.1, math.radians(60))
    assert (clean.accel_x, clean.accel_y, clean.accel_z) == truth
    rates = (MOVING[name] for name in ("pitch", "pitch_rate", "yaw_rate", "ground_slope"))
    assert (clean.gyro, clean.gyro_yaw) == angular_rate(*rates)
    for output, bias in zip(
        OUTPUTS, ("gyro_bias", "gyro_yaw_bias", "accel_x_bias", "accel_y_bias", "accel_z_bias"), strict=True
    ):
        assert getattr(biased, output) - getattr(clean, output) == pytest.approx(value(bias), rel=1e-9)


def samples(count, step_size=0.005, **values):
    """Return the outputs at `count` ticks of a resting sensor, without quantization."""
    v, rows = started(IMU, quantization=0.0, **values), []
    for k in range(count):
        IMU.step(v, k * step_size, step_size)
        rows.append([getattr(v, name) for name in OUTPUTS] + [v.gyro_drift, v.gyro_yaw_drift])
    return np.array(rows)


@pytest.mark.parametrize("sample_time", [0.001, 0.005])
def test_noise_has_the_stated_density(sample_time):
    """White: the one-sided spectrum is flat at the density squared; 4 deviations of a variance estimate."""
    n = 20000
    rows = samples(n, sample_time, sample_time=sample_time, gyro_bias_walk=0.0)
    for channel, name in enumerate(OUTPUTS):
        density = value("gyro_noise_density" if name.startswith("gyro") else "accel_noise_density")
        noise = rows[:, channel] - np.mean(rows[:, channel])
        assert np.var(noise) == pytest.approx(density**2 / (2 * sample_time), rel=4 * math.sqrt(2 / n))
        frequency, spectrum = signal.welch(noise, 1 / sample_time, nperseg=200)
        assert np.mean(spectrum[2:-2]) == pytest.approx(density**2, rel=0.05)
        lower = np.mean(spectrum[(frequency > 0) & (frequency < 0.25 / sample_time)])
        upper = np.mean(spectrum[frequency > 0.25 / sample_time][:-2])
        assert lower == pytest.approx(
            upper, rel=0.1
        )  # each half: ~7500 degrees of freedom, deviation 1.6 % with the window's overlap


def test_channels_are_independent():
    """Correlations of 20 000 samples, also at a lag: below 4 standard deviations."""
    n = 20000
    rows = samples(n, gyro_bias_walk=0.0)[:, :5]
    for lag in (0, 1, 2):
        correlation = np.corrcoef(rows[lag:].T, rows[: n - lag].T)[:5, 5:]
        if lag == 0:
            correlation = correlation - np.eye(5)
        assert np.max(np.abs(correlation)) < 4 / math.sqrt(n - lag)


def test_bias_walk_grows_with_the_root_of_time():
    """Increments are white with variance walk^2 T_s, so the variance after t is walk^2 t; also seen over seeds."""
    n = 20000
    walk = value("gyro_bias_walk")
    drift = samples(n)[:, 5:]
    increments = np.diff(drift, axis=0)
    for channel in (0, 1):
        assert np.var(increments[:, channel]) == pytest.approx(walk**2 * 0.005, rel=4 * math.sqrt(2 / n))
        assert abs(np.corrcoef(increments[1:, channel], increments[:-1, channel])[0, 1]) < 4 / math.sqrt(n)
    ends = np.array([samples(40, seed=seed)[-1, 5] for seed in range(400)])
    assert np.mean(ends**2) == pytest.approx(walk**2 * 0.2, rel=4 * math.sqrt(2 / 400))


def test_the_gyro_shows_its_drift():
    rows = samples(200, gyro_noise_density=0.0)
    assert rows[:, 0] - value("gyro_bias") == pytest.approx(rows[:, 5], abs=1e-15)
    assert rows[:, 1] - value("gyro_yaw_bias") == pytest.approx(rows[:, 6], abs=1e-15)


@pytest.mark.parametrize("step_size", [0.0005, 0.001, 0.0025, 0.01, 0.02])
def test_noise_does_not_depend_on_the_communication_step(step_size):
    """The k-th tick gets the k-th noise, even with several ticks in a step: equal bit for bit at common times."""
    reference, other = started(IMU), started(IMU)
    for k in range(20):
        for i in range(4):
            IMU.step(reference, (4 * k + i) * 0.005, 0.005)
        for i in range(round(0.02 / step_size)):
            IMU.step(other, 0.02 * k + i * step_size, step_size)
        assert [getattr(other, name) for name in OUTPUTS] == [getattr(reference, name) for name in OUTPUTS]


def test_seeds_differ_and_repeat():
    assert np.array_equal(samples(10, seed=5), samples(10, seed=5))
    assert not np.any(samples(10, seed=5)[:, :5] == samples(10, seed=6)[:, :5])


def test_outputs_hold_between_ticks():
    v = started(IMU)
    before = [getattr(v, name) for name in OUTPUTS]
    v.pitch_rate = 1.0
    for k in range(4):
        IMU.step(v, k * 0.001, 0.001)
        assert [getattr(v, name) for name in OUTPUTS] == before
    IMU.step(v, 0.004, 0.001)
    assert v.gyro == pytest.approx(1.0, abs=0.02)


def test_initialize_may_be_repeated():
    v = instance(IMU, pitch=0.3)
    IMU.initialize(v, 0.0)
    once = dict(vars(v))
    for k in range(20):
        IMU.step(v, k * 0.005, 0.005)
    IMU.initialize(v, 0.0)
    assert vars(v) == once


def test_quantization_gives_multiples_of_the_resolution():
    v = started(IMU, **MOVING)
    exact = started(IMU, quantization=0.0, **MOVING)
    for k in range(50):
        IMU.step(v, k * 0.005, 0.005)
        IMU.step(exact, k * 0.005, 0.005)
        for name in OUTPUTS:
            resolution = v.gyro_resolution if name.startswith("gyro") else v.accel_resolution
            steps = getattr(v, name) / resolution
            assert abs(steps - round(steps)) < 1e-9  # rounding of a product of some 1e4
            assert abs(getattr(v, name) - getattr(exact, name)) <= resolution * (0.5 + 1e-9)


def test_saturation_holds_the_range():
    v = started(IMU, pitch_rate=20.0, yaw_rate=-20.0, wheel_acceleration=2000.0, pitch_acceleration=-3000.0)
    IMU.step(v, 0.0, 0.005)
    assert v.gyro == pytest.approx(math.radians(500), abs=v.gyro_resolution)
    assert v.gyro_yaw == pytest.approx(-math.radians(500), abs=v.gyro_resolution)
    assert abs(v.gyro) <= v.gyro_range
    for output in (v.accel_x, v.accel_y, v.accel_z):
        assert abs(output) <= v.accel_range
    assert max(abs(v.accel_x), abs(v.accel_z)) == pytest.approx(v.accel_range, abs=v.accel_resolution)


def test_digitized():
    assert digitized(0.74, 10.0, 0.5) == 0.5
    assert digitized(0.76, 10.0, 0.5) == 1.0
    assert digitized(-0.74, 10.0, 0.5) == -0.5
    assert digitized(11.0, 10.2, 0.5) == 10.0
    assert digitized(-11.0, 10.2, 0.5) == -10.0


@pytest.mark.parametrize("output", OUTPUTS)
def test_depends_on_what_it_declares(output):
    """Outputs answer to their declared inputs, and to no others."""
    declared = next(v.depends for v in IMU.variables if v.name == output)
    before = getattr(started(IMU, **QUIET, **MOVING), output)
    for name in MOVING:
        after = getattr(started(IMU, **QUIET, **{**MOVING, name: MOVING[name] + 0.1}), output)
        assert (after != before) == (name in declared), name


def test_a_resolution_beyond_the_range_is_refused():
    assert IMU.check(instance(IMU)) == []
    (problem,) = IMU.check(instance(IMU, gyro_resolution=10.0))
    assert problem.startswith("gyro_resolution = 10 rad/s must not exceed gyro_range = ")
