"""The estimator: pitch, rates, wheel motion and yaw from the inertial sensor and the encoders."""

from math import sqrt
from typing import Any

from twip.fmi.declare import Block, input, local, output, parameter, state
from twip.robot.attitude import axle_force, lever_arm_force, pitch_arcsin, pitch_arctan, yaw_force
from twip.robot.kalman import correct, measurement_variance, predict
from twip.robot.kernel import kernel
from twip.robot.low_pass import first_order, second_order, second_order_rest
from twip.robot.odometry import shaft_turned, wheel_rate, yaw
from twip.robot.sampling import ticks_reached

INERTIAL = ("gyro", "accel_x", "accel_z")
COUNTS = ("left.encoder_count", "right.encoder_count")

VARIABLES = (
    *(parameter(name) for name in (
        "gravity", "wheel_radius", "track_width", "gear_ratio", "encoder_resolution", "sensor_distance",
        "sensor_elevation",
        "kalman_angle_noise", "kalman_bias_noise", "kalman_measurement_noise", "kalman_force_scale",
        "kalman_acceleration_scale",
        "kalman_bias_start", "acceleration_filter_time", "low_pass_bandwidth", "sample_time", "sample_offset",
    )),
    input("gyro", "rad/s", "measured pitch rate", display_unit="deg/s"),
    input("accel_x", "m/s2", "measured specific force, forward"),
    input("accel_z", "m/s2", "measured specific force, up", 9.81),
    input("left.encoder_count", None, "encoder count of the left motor"),
    input("right.encoder_count", None, "encoder count of the right motor"),
    output("pitch", "rad", "pitch by the Kalman filter, forward lean positive", (*INERTIAL, *COUNTS), "deg",
           variability="discrete"),
    output("pitch_rate", "rad/s", "pitch rate: gyro without its estimated bias", (*INERTIAL, *COUNTS), "deg/s",
           variability="discrete"),
    output("wheel_rate", "rad/s", "mean absolute wheel rate, forward positive", (*INERTIAL, *COUNTS),
           variability="discrete"),
    output("yaw", "rad", "yaw since the start, left positive", COUNTS, "deg", variability="discrete"),
    output("yaw_rate", "rad/s", "yaw rate", COUNTS, "deg/s", variability="discrete"),
    output("gyro_bias", "rad/s", "estimated bias of the pitch gyro", (*INERTIAL, *COUNTS), "deg/s",
           variability="discrete"),
    output("left.shaft_speed", "rad/s", "left motor's shaft speed relative to the body", COUNTS,
           variability="discrete"),
    output("right.shaft_speed", "rad/s", "right motor's shaft speed relative to the body", COUNTS,
           variability="discrete"),
    output("pitch_arcsin", "rad", "pitch by the arcsine of the forward specific force, eq (41)", ("accel_x",), "deg",
           variability="discrete"),
    output("pitch_arctan", "rad", "pitch by the arctangent of the specific force, eq (41)", ("accel_x", "accel_z"),
           "deg", variability="discrete"),
    output("pitch_gyro", "rad", "pitch integrated from the gyro alone, eq (42)", INERTIAL, "deg",
           variability="discrete"),
    output("pitch_lever_arm", "rad", "pitch by the arctangent after the lever-arm correction, eqs (43) and (44)",
           (*INERTIAL, *COUNTS), "deg", variability="discrete"),
    output("pitch_low_pass", "rad", "pitch_arctan through the second-order low-pass", ("accel_x", "accel_z"), "deg",
           variability="discrete"),
    output("pitch_lever_arm_low_pass", "rad", "pitch_lever_arm through the second-order low-pass", (*INERTIAL,
           *COUNTS), "deg", variability="discrete"),
    local("pitch_measured", "rad",
          "pitch by the arctangent after lever-arm, axle and yaw corrections: the filter's measurement", "deg",
          "discrete"),
    local("axle_acceleration", "m/s2", "forward acceleration of the axle from the encoders", variability="discrete"),
    local("axle_motion", "m/s2",
          "axle_acceleration through a first-order low-pass: what inflates the filter's measurement variance",
          variability="discrete"),
    local("pitch_deviation", "rad", "standard deviation of the pitch by the filter", "deg", "discrete"),
    *(state(name) for name in (
        "start", "ticks", "sampled", "gyro_last", "rate_last", "wheel_rate_last", "left_first", "right_first",
        "left_last", "right_last",
        "variance", "covariance", "bias_variance", "low_pass_1", "low_pass_2", "lever_arm_1", "lever_arm_2",
    )),
)  # fmt: skip


@kernel
def initialize(v: Any, time: float) -> None:
    """Take the first sample: pitch from the accelerometer, everything at rest, yaw and bias zero."""
    v.start, v.sampled = time, time
    v.ticks = ticks_reached(time, time, v.sample_time, v.sample_offset)
    v.left_first, v.left_last = v.left_encoder_count, v.left_encoder_count
    v.right_first, v.right_last = v.right_encoder_count, v.right_encoder_count
    v.gyro_last, v.rate_last, v.wheel_rate_last = v.gyro, v.gyro, v.gyro
    v.pitch_rate, v.wheel_rate, v.yaw, v.yaw_rate, v.gyro_bias = v.gyro, v.gyro, 0.0, 0.0, 0.0
    v.left_shaft_speed, v.right_shaft_speed, v.axle_acceleration, v.axle_motion = 0.0, 0.0, 0.0, 0.0
    v.pitch_arcsin = pitch_arcsin(v.accel_x, v.gravity)
    v.pitch_arctan = pitch_arctan(v.accel_x, v.accel_z)
    v.pitch, v.pitch_gyro, v.pitch_measured, v.pitch_lever_arm = (
        v.pitch_arctan,
        v.pitch_arctan,
        v.pitch_arctan,
        v.pitch_arctan,
    )
    v.pitch_low_pass, v.pitch_lever_arm_low_pass = v.pitch_arctan, v.pitch_arctan
    v.low_pass_1, v.low_pass_2 = second_order_rest(v.pitch_arctan, v.low_pass_bandwidth, v.sample_time)
    v.lever_arm_1, v.lever_arm_2 = v.low_pass_1, v.low_pass_2
    v.pitch_deviation = v.kalman_measurement_noise
    v.variance, v.covariance = v.kalman_measurement_noise * v.kalman_measurement_noise, 0.0
    v.bias_variance = v.kalman_bias_start * v.kalman_bias_start


@kernel
def step(v: Any, time: float, step_size: float) -> None:
    """Estimate at the ticks; rates come from the time between the samples really taken."""
    reached = ticks_reached(time + step_size, v.start, v.sample_time, v.sample_offset)
    if reached <= v.ticks:
        return
    elapsed = time + step_size - v.sampled
    samples = int(reached - v.ticks)
    v.ticks, v.sampled = reached, time + step_size
    v.pitch, v.gyro_bias, v.variance, v.covariance, v.bias_variance = predict(
        v.pitch, v.gyro_bias, v.variance, v.covariance, v.bias_variance, 0.5 * (v.gyro + v.gyro_last), elapsed,
        v.kalman_angle_noise, v.kalman_bias_noise,
    )  # fmt: skip
    move(v, elapsed)
    force = look(v, elapsed, samples)
    variance = measurement_variance(
        v.kalman_measurement_noise, force, v.gravity, v.axle_motion, v.kalman_force_scale, v.kalman_acceleration_scale
    )
    v.pitch, v.gyro_bias, v.variance, v.covariance, v.bias_variance = correct(
        v.pitch, v.gyro_bias, v.variance, v.covariance, v.bias_variance, v.pitch_measured, variance
    )
    v.pitch_rate = v.gyro - v.gyro_bias
    v.pitch_deviation = sqrt(v.variance)
    v.gyro_last = v.gyro


@kernel
def move(v: Any, elapsed: float) -> None:
    """Set shaft speeds, wheel rate, yaw and the axle's acceleration from the counts and the gyro."""
    v.left_shaft_speed = shaft_turned(v.left_encoder_count, v.left_last, v.encoder_resolution) / elapsed
    v.right_shaft_speed = shaft_turned(v.right_encoder_count, v.right_last, v.encoder_resolution) / elapsed
    v.left_last, v.right_last = v.left_encoder_count, v.right_encoder_count
    v.wheel_rate = wheel_rate(v.left_shaft_speed, v.right_shaft_speed, v.gyro - v.gyro_bias, v.gear_ratio)
    left = shaft_turned(v.left_encoder_count, v.left_first, v.encoder_resolution)
    right = shaft_turned(v.right_encoder_count, v.right_first, v.encoder_resolution)
    v.yaw = yaw(left, right, v.wheel_radius, v.track_width, v.gear_ratio)
    v.yaw_rate = yaw(v.left_shaft_speed, v.right_shaft_speed, v.wheel_radius, v.track_width, v.gear_ratio)
    v.axle_acceleration = v.wheel_radius * (v.wheel_rate - v.wheel_rate_last) / elapsed
    v.axle_motion = first_order(v.axle_acceleration, v.axle_motion, v.acceleration_filter_time, elapsed)
    v.wheel_rate_last = v.wheel_rate


@kernel
def look(v: Any, elapsed: float, samples: int) -> float:
    """Set the pitch by each method but the Kalman filter and return the magnitude (m/s2) of the fully corrected force.

    Corrections that need a pitch take the predicted one.
    """
    v.pitch_arcsin = pitch_arcsin(v.accel_x, v.gravity)
    v.pitch_arctan = pitch_arctan(v.accel_x, v.accel_z)
    v.pitch_gyro += v.gyro_last * elapsed
    rate = v.gyro - v.gyro_bias
    arm_x, arm_z = lever_arm_force(rate, (v.gyro - v.gyro_last) / elapsed, v.sensor_distance, v.sensor_elevation)
    axle_x, axle_z = axle_force(v.pitch, v.axle_acceleration)
    yaw_x, yaw_z = yaw_force(v.pitch, v.yaw_rate, v.sensor_distance, v.sensor_elevation)
    v.pitch_lever_arm = pitch_arctan(v.accel_x - arm_x, v.accel_z - arm_z)
    force_x, force_z = v.accel_x - arm_x - axle_x - yaw_x, v.accel_z - arm_z - axle_z - yaw_z
    v.pitch_measured = pitch_arctan(force_x, force_z)
    for _ in range(samples):
        v.pitch_low_pass, v.low_pass_1, v.low_pass_2 = second_order(
            v.pitch_arctan, v.low_pass_1, v.low_pass_2, v.low_pass_bandwidth, v.sample_time
        )
        v.pitch_lever_arm_low_pass, v.lever_arm_1, v.lever_arm_2 = second_order(
            v.pitch_lever_arm, v.lever_arm_1, v.lever_arm_2, v.low_pass_bandwidth, v.sample_time
        )
    return sqrt(force_x * force_x + force_z * force_z)


def check(v: Any) -> list[str]:
    """Return the rules that the parameters break together."""
    if v.low_pass_bandwidth >= 0.5 / v.sample_time:
        return [
            f"low_pass_bandwidth = {v.low_pass_bandwidth:g} Hz must be below half the sampling rate, "
            f"1 / (2 sample_time) = {0.5 / v.sample_time:g} Hz"
        ]
    return []


BLOCK = Block("estimator",
"Pitch, rates, wheel motion and yaw from inertial sensor and encoders, by Kalman filter and simpler methods",
              VARIABLES, initialize, step, check)  # fmt: skip
