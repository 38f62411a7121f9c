"""The estimator's parts against closed forms and scipy, the whole in the motions of the paper's Figs 7 to 12."""

import math

import numpy as np
import pytest
from plain import instance, load, started
from scipy import signal

from twip.robot.attitude import axle_force, lever_arm_force, pitch_arcsin, pitch_arctan, yaw_force
from twip.robot.imu import specific_force
from twip.robot.low_pass import first_order, second_order, second_order_rest
from twip.robot.odometry import shaft_turned, wheel_rate, yaw
from twip.robot.parameters import value

IMU, ESTIMATOR = load("imu").BLOCK, load("estimator").BLOCK
N, R, W, COUNTS = value("gear_ratio"), value("wheel_radius"), value("track_width"), value("encoder_resolution")
ARM, ELEVATION, G = value("sensor_distance"), value("sensor_elevation"), value("gravity")
H = 0.005


@pytest.mark.parametrize("degrees", [-170, -90, -27, 0, 1, 27, 60, 90, 179])
def test_arctan_form_is_exact_at_rest(degrees):
    psi = math.radians(degrees)
    assert pitch_arctan(-G * math.sin(psi), G * math.cos(psi)) == pytest.approx(psi, abs=1e-15)


@pytest.mark.parametrize("degrees", [-89, -27, 0, 1, 27, 60, 89])
def test_arcsin_form_is_exact_at_rest(degrees):
    """The slope of the arcsine at 89 degrees is 57: rounding stays below 1e-13."""
    psi = math.radians(degrees)
    assert pitch_arcsin(-G * math.sin(psi), G) == pytest.approx(psi, abs=1e-13)


def test_arcsin_form_holds_forces_beyond_g():
    assert pitch_arcsin(-2 * G, G) == pytest.approx(math.pi / 2)
    assert pitch_arcsin(2 * G, G) == pytest.approx(-math.pi / 2)
    assert pitch_arcsin(-0.3, 1.0) == pytest.approx(math.asin(0.3), rel=1e-15)


def test_corrections_leave_gravity_alone():
    """Lever arm, axle and yaw taken from the sensor's exact specific force: the pitch is exact, whatever the motion."""
    generator = np.random.default_rng(2)
    for _ in range(200):
        psi, beta = generator.uniform(-1.2, 1.2), generator.uniform(-3, 3)
        psi1, phi1 = generator.uniform(-6, 6, 2)
        psi2, theta2 = generator.uniform(-60, 60, 2)
        fx, _, fz = specific_force(psi, psi1, psi2, 3.0, theta2, phi1, 5.0, 0.0, 0.0, G, R, ARM, beta)
        parts = (lever_arm_force(psi1, psi2, ARM, beta), axle_force(psi, R * theta2), yaw_force(psi, phi1, ARM, beta))
        rest = fx - sum(p[0] for p in parts), fz - sum(p[1] for p in parts)
        assert pitch_arctan(*rest) == pytest.approx(psi, abs=1e-13)


def rocking(frequency, amplitude, duration, seed=1, noise=1.0, lock=True, step=H):
    """Rock a body about its axle (paper, Figs 7 to 12); return the true pitch and what the estimator shows."""
    sensor = instance(IMU, seed=seed, noise=noise)
    estimator = instance(ESTIMATOR)
    names = [v.attribute for v in ESTIMATOR.variables if v.causality in ("output", "local")]
    omega, rows, truth = 2 * math.pi * frequency, [], []
    for k in range(round(duration / step) + 1):
        t = k * step
        psi = amplitude * math.sin(omega * t)
        rate = amplitude * omega * math.cos(omega * t)
        sensor.pitch, sensor.pitch_rate, sensor.pitch_acceleration = psi, rate, -omega * omega * psi
        sensor.wheel_rate = 0.0 if lock else rate
        estimator.left_encoder_count = estimator.right_encoder_count = math.floor(-N * psi * COUNTS / (2 * math.pi))
        if k == 0:
            IMU.initialize(sensor, 0.0)
        else:
            IMU.step(sensor, (k - 1) * step, step)
        estimator.gyro, estimator.accel_x, estimator.accel_z = sensor.gyro, sensor.accel_x, sensor.accel_z
        if k == 0:
            ESTIMATOR.initialize(estimator, 0.0)
        else:
            ESTIMATOR.step(estimator, (k - 1) * step, step)
        truth.append(psi)
        rows.append([getattr(estimator, name) for name in names])
    return np.array(truth), dict(zip(names, np.array(rows).T, strict=True))


def rms(estimate, truth, after=0):
    return math.degrees(math.sqrt(np.mean((estimate - truth)[after:] ** 2)))


def test_accelerometer_alone_follows_slow_motion_only():
    """Fig 7: rms 0.49 deg at 0.2 Hz and 20 deg, 25.9 deg at 3 Hz and 12 deg in the prototype.

    Slow: biases of 5 mg (0.29 deg) and noise of 4 mg (0.23 deg) give 0.37 deg, the motion some 0.1 deg. Fast: 5 % for
    both.
    """
    truth, out = rocking(0.2, math.radians(20), 20)
    assert 0.3 < rms(out["pitch_arctan"], truth) < 0.55
    truth, out = rocking(3.0, math.radians(12), 20)
    assert rms(out["pitch_arctan"], truth) == pytest.approx(25.9, rel=0.05)


def test_gyro_alone_drifts():
    """Fig 8: 0.5 deg/s of bias are 20 deg in 40 s; the bias walk (0.01 deg/s/s^0.5) adds 1.5 deg, 1 sigma."""
    truth, out = rocking(0.5, math.radians(10), 40)
    error = np.degrees(out["pitch_gyro"] - truth)
    assert error[-1] == pytest.approx(20.0, abs=5.0)
    assert abs(error[200]) < 2.0
    assert rms(out["pitch"], truth, 400) < 0.6


def test_fast_motion_needs_lever_arm_and_filter():
    """Figs 10 to 12 at 3 Hz and 12 deg.

    The prototype had 1.31 deg with the lever-arm correction, 0.51 deg with the Kalman filter, 27.6 and 6.3 deg with a
    5 Hz filter. The gyro's backward difference lags by half a sample: L_s psi''' h / 2 = 0.35 m/s2 amplitude, 1.4 deg
    rms at most.
    """
    truth, out = rocking(3.0, math.radians(12), 20)
    assert rms(out["pitch_lever_arm"], truth, 200) == pytest.approx(1.31, abs=0.25)
    assert rms(out["pitch"], truth, 200) < 0.6
    assert rms(out["pitch_low_pass"], truth, 200) == pytest.approx(27.6, rel=0.1)
    assert rms(out["pitch_lever_arm_low_pass"], truth, 200) == pytest.approx(6.3, rel=0.1)


def test_the_printed_signs_make_it_worse():
    """Paper eqs (43), (44) have + on both sin terms: the correction doubles the error instead (38.9 deg)."""
    omega, amplitude, errors = 6 * math.pi, math.radians(12), []
    for k in range(200):
        psi, rate = amplitude * math.sin(omega * k * H), amplitude * omega * math.cos(omega * k * H)
        acceleration = -omega * omega * psi
        fx, _, fz = specific_force(psi, rate, acceleration, 0, 0, 0, 0, 0, 0, G, R, ARM, ELEVATION)
        sine, cosine = ARM * math.sin(ELEVATION), ARM * math.cos(ELEVATION)
        ax, ay = -fx, fz
        printed = math.atan2(
            ax - (acceleration * sine - rate**2 * cosine), ay - (acceleration * cosine + rate**2 * sine)
        )
        errors.append(printed - psi)
    assert math.degrees(math.sqrt(np.mean(np.square(errors)))) > 30


def test_turning_does_not_fool_the_measurement():
    """At 3 rad/s the turn shifts a lever-arm-corrected pitch by 2.6 deg; with the encoder yaw rate nothing is left.

    Left is one encoder count in the yaw rate, 0.02 of 3 rad/s, hence 0.04 deg of pitch, and the sensor's exactness.
    """
    sensor = started(IMU, noise=0.0, quantization=0.0, accel_x_bias=0.0, accel_z_bias=0.0, gyro_bias=0.0, yaw_rate=3.0)
    estimator = instance(ESTIMATOR, gyro=0.0, accel_x=0.0, accel_z=G)
    ESTIMATOR.initialize(estimator, 0.0)
    estimator.accel_x, estimator.accel_z = sensor.accel_x, sensor.accel_z
    for k in range(1, 41):
        turned = 3.0 * k * H * W / (2 * R) * N * COUNTS / (2 * math.pi)
        estimator.left_encoder_count, estimator.right_encoder_count = math.floor(-turned), math.floor(turned)
        ESTIMATOR.step(estimator, (k - 1) * H, H)
    assert math.degrees(estimator.pitch_lever_arm) == pytest.approx(2.6, abs=0.05)
    assert math.degrees(estimator.pitch_measured) == pytest.approx(0.0, abs=0.08)
    assert estimator.yaw == pytest.approx(0.6, abs=2 * R / W / N * 2 * math.pi / COUNTS)


def test_axle_acceleration_is_removed():
    """A robot that accelerates upright at 3 m/s2 feels a lean of -17 deg; the encoders' acceleration takes it out.

    Left is one count of the mean shaft angle per sample, twice differenced and smoothed by 10 ms: 0.15 m/s2, 0.9 deg.
    """
    a = 3.0
    estimator = instance(ESTIMATOR, gyro=0.0, accel_x=0.0, accel_z=G)
    ESTIMATOR.initialize(estimator, 0.0)
    estimator.accel_x = a
    measured = []
    for k in range(1, 101):
        count = math.floor(0.5 * a / R * (k * H) ** 2 * N * COUNTS / (2 * math.pi))
        estimator.left_encoder_count = estimator.right_encoder_count = count
        ESTIMATOR.step(estimator, (k - 1) * H, H)
        measured.append(estimator.pitch_measured)
    assert math.degrees(estimator.pitch_arctan) == pytest.approx(-17.0, abs=0.1)
    assert np.degrees(np.mean(measured[20:])) == pytest.approx(0.0, abs=0.1)
    counted = estimator.wheel_rate - estimator.pitch_rate
    assert counted * R == pytest.approx(a * 99.5 * H, abs=R / N * 2 * math.pi / COUNTS / H)


def test_the_start_comes_from_the_accelerometer():
    v = started(
        ESTIMATOR,
        accel_x=-G * math.sin(0.47),
        accel_z=G * math.cos(0.47),
        left_encoder_count=-700,
        right_encoder_count=300,
    )
    for name in (
        "pitch",
        "pitch_arcsin",
        "pitch_arctan",
        "pitch_gyro",
        "pitch_lever_arm",
        "pitch_low_pass",
        "pitch_lever_arm_low_pass",
    ):
        assert getattr(v, name) == pytest.approx(0.47, abs=1e-12)
    assert (v.yaw, v.yaw_rate, v.wheel_rate, v.gyro_bias, v.left_shaft_speed) == (0, 0, 0, 0, 0)


def test_bias_is_found_at_rest():
    """One second at rest with noise: the gyro's bias of 0.5 deg/s is known to 0.25 deg/s.

    The filter's own deviation then: 0.6 deg sqrt(12 / 200) / 1 s = 0.15 deg/s, and the real noise is a third of what
    it assumes.
    """
    _, out = rocking(0.0, 0.0, 1.0)
    assert np.degrees(out["gyro_bias"][-1]) == pytest.approx(0.5, abs=0.25)
    _, out = rocking(0.0, 0.0, 20.0)
    assert np.degrees(out["gyro_bias"][-1]) == pytest.approx(0.5, abs=0.1)
    assert out["pitch_deviation"][200] < 0.25 * out["pitch_deviation"][0]


def test_odometry_is_the_geometry_of_both_wheels():
    left, right, psi1 = 3.1, 4.3, -0.7
    speeds = N * (left - psi1), N * (right - psi1)
    assert wheel_rate(*speeds, psi1, N) == pytest.approx((left + right) / 2)
    assert yaw(*speeds, R, W, N) == pytest.approx((right - left) * R / W)
    assert shaft_turned(100 + COUNTS / 4, 100, COUNTS) == pytest.approx(math.pi / 2)


@pytest.mark.parametrize(("bandwidth", "sample_time"), [(5.0, 0.005), (5.0, 0.02), (40.0, 0.005), (0.5, 0.001)])
def test_low_pass_equals_scipy(bandwidth, sample_time):
    """Butterworth of order 2 in steady state at the first sample; the same arithmetic, so equal to 1e-9."""
    x = np.random.default_rng(0).normal(size=300).cumsum() + 3.0
    b, a = signal.butter(2, bandwidth, fs=1 / sample_time)
    expected, _ = signal.lfilter(b, a, x, zi=signal.lfilter_zi(b, a) * x[0])
    first, second = second_order_rest(x[0], bandwidth, sample_time)
    found = []
    for sample in x:
        y, first, second = second_order(sample, first, second, bandwidth, sample_time)
        found.append(y)
    assert np.array(found) == pytest.approx(expected, rel=1e-9, abs=1e-9)


def test_first_order_reaches_63_percent_in_its_time_constant():
    y = 0.0
    for _ in range(1000):
        y = first_order(1.0, y, 0.1, 1e-4)
    assert y == pytest.approx(1 - math.exp(-1), abs=1e-3)  # backward Euler: half a step of error, 1e-4 / 0.2
    assert first_order(3.0, 1.0, 0.0, 1e-3) == 3.0


def test_holds_between_ticks():
    v = started(ESTIMATOR)
    before = dict(vars(v))
    v.gyro, v.accel_x, v.left_encoder_count = 1.0, 2.0, 50.0
    for k in range(4):
        ESTIMATOR.step(v, k * 0.001, 0.001)
    assert vars(v) == {**before, "gyro": 1.0, "accel_x": 2.0, "left_encoder_count": 50.0}
    ESTIMATOR.step(v, 0.004, 0.001)
    assert v.pitch_rate == pytest.approx(1.0, abs=0.01)
    assert v.left_shaft_speed == pytest.approx(50 / COUNTS * 2 * math.pi / H)


def test_rates_use_the_time_between_samples_really_taken():
    """Step 3 ms, sample time 5 ms: samples at 6, 12, 15, 21 ms. Constant speed shows as such, to one count."""
    v, speed = started(ESTIMATOR), 40.0
    acted = []
    for k in range(1, 40):
        v.left_encoder_count = v.right_encoder_count = math.floor(speed * k * 0.003 * COUNTS / (2 * math.pi))
        ticks = v.ticks
        ESTIMATOR.step(v, (k - 1) * 0.003, 0.003)
        if v.ticks > ticks:
            acted.append(v.left_shaft_speed)
    assert len(acted) == 23
    assert acted == pytest.approx([speed] * len(acted), abs=2 * math.pi / COUNTS / 0.003)


def test_initialize_may_be_repeated():
    v = instance(ESTIMATOR, accel_x=1.0, gyro=0.2, left_encoder_count=5.0)
    ESTIMATOR.initialize(v, 0.0)
    once = dict(vars(v))
    v.left_encoder_count = 40.0
    for k in range(20):
        ESTIMATOR.step(v, k * H, H)
    v.left_encoder_count = 5.0
    ESTIMATOR.initialize(v, 0.0)
    assert vars(v) == once


@pytest.mark.parametrize("output", [v.name for v in ESTIMATOR.variables if v.causality == "output"])
def test_depends_on_what_it_declares(output):
    """A change of an input reaches an output in the same step only if it is declared."""
    declared = next(v.depends for v in ESTIMATOR.variables if v.name == output)
    inputs = [v for v in ESTIMATOR.variables if v.causality == "input"]

    def after(**changes):
        v = started(ESTIMATOR, accel_x=1.0, gyro=0.2)
        v.left_encoder_count, v.right_encoder_count = 30.0, 70.0
        for name, change in changes.items():
            setattr(v, name, getattr(v, name) + change)
        ESTIMATOR.step(v, 0.0, H)
        return getattr(v, output.replace(".", "_"))

    changing = {i.name for i in inputs if after(**{i.attribute: 1.0}) != after()}
    assert changing <= set(declared)


def test_a_bandwidth_beyond_half_the_sampling_rate_is_refused():
    assert ESTIMATOR.check(instance(ESTIMATOR)) == []
    (problem,) = ESTIMATOR.check(instance(ESTIMATOR, low_pass_bandwidth=150.0))
    assert problem == "low_pass_bandwidth = 150 Hz must be below half the sampling rate, 1 / (2 sample_time) = 100 Hz"
