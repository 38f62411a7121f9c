"""The inertial sensor: a three-axis accelerometer, a pitch gyro and a yaw gyro on the body, away from the axle."""

from math import sqrt
from typing import Any

from twip.fmi.declare import Block, input, local, output, parameter, state
from twip.robot.imu import angular_rate, digitized, noise_deviation, specific_force
from twip.robot.kernel import kernel
from twip.robot.random import normal_pair, seeded
from twip.robot.sampling import ticks_reached

STREAM = 1.0
"""The sensor's stream of the noise generator."""

FORCE = (
    "pitch",
    "pitch_rate",
    "pitch_acceleration",
    "wheel_rate",
    "wheel_acceleration",
    "yaw_rate",
    "ground_slope",
    "ground_slope_rate",
)
SIDE_FORCE = ("pitch", "pitch_rate", "wheel_rate", "yaw_rate", "yaw_acceleration", "ground_slope", "ground_slope_rate")

VARIABLES = (
    *(parameter(name) for name in (
        "gravity", "wheel_radius", "sensor_distance", "sensor_elevation",
        "gyro_noise_density", "gyro_range", "gyro_resolution", "gyro_bias", "gyro_yaw_bias", "gyro_bias_walk",
        "accel_noise_density", "accel_range", "accel_resolution", "accel_x_bias", "accel_y_bias", "accel_z_bias",
        "noise", "quantization", "seed", "sample_time", "sample_offset",
    )),
    input("pitch", "rad", "pitch, forward lean positive", display_unit="deg"),
    input("pitch_rate", "rad/s", "pitch rate", display_unit="deg/s"),
    input("pitch_acceleration", "rad/s2", "pitch acceleration"),
    input("wheel_rate", "rad/s", "mean absolute wheel rate, forward positive"),
    input("wheel_acceleration", "rad/s2", "mean absolute wheel acceleration"),
    input("yaw_rate", "rad/s", "yaw rate about the ground's normal, left positive", display_unit="deg/s"),
    input("yaw_acceleration", "rad/s2", "yaw acceleration"),
    input("ground_slope", "rad", "slope of the ground under the axle along the heading, uphill positive",
          display_unit="deg"),
    input("ground_slope_rate", "rad/s", "rate of the slope"),
    output("gyro", "rad/s", "measured rate about the body's y axis (left): pitch", ("pitch_rate",), "deg/s",
           variability="discrete"),
    output("gyro_yaw", "rad/s", "measured rate about the body's z axis (up)", ("pitch", "yaw_rate", "ground_slope"),
           "deg/s", variability="discrete"),
    output("accel_x", "m/s2", "measured specific force along the body's x axis (forward)", FORCE,
           variability="discrete"),
    output("accel_y", "m/s2", "measured specific force along the body's y axis (left)", SIDE_FORCE,
           variability="discrete"),
    output("accel_z", "m/s2", "measured specific force along the body's z axis (up)", FORCE, variability="discrete"),
    local("gyro_drift", "rad/s", "random walk of the pitch gyro's bias since the start", "deg/s", "discrete"),
    local("gyro_yaw_drift", "rad/s", "random walk of the yaw gyro's bias since the start", "deg/s", "discrete"),
    *(state(name) for name in ("start", "ticks", "random_1", "random_2", "random_3", "random_4", "random_5",
    "random_6")),
)  # fmt: skip


@kernel
def initialize(v: Any, time: float) -> None:
    """Seed the generator and measure without noise; the sample at the start counts as taken."""
    v.start = time
    v.ticks = ticks_reached(time, time, v.sample_time, v.sample_offset)
    v.random_1, v.random_2, v.random_3, v.random_4, v.random_5, v.random_6 = seeded(v.seed, STREAM)
    v.gyro_drift, v.gyro_yaw_drift = 0.0, 0.0
    measure(v, 0.0, 0.0, 0.0, 0.0, 0.0)


@kernel
def step(v: Any, time: float, step_size: float) -> None:
    """Measure at the ticks; every tick draws its own noise, so noise does not depend on the communication step."""
    reached = ticks_reached(time + step_size, v.start, v.sample_time, v.sample_offset)
    if reached <= v.ticks:
        return
    gyro, gyro_yaw, accel_x, accel_y, accel_z = 0.0, 0.0, 0.0, 0.0, 0.0
    if v.noise > 0.5:
        walk = v.gyro_bias_walk * sqrt(v.sample_time)
        for _ in range(int(reached - v.ticks)):
            gyro, gyro_yaw = draw(v)
            accel_x, accel_y = draw(v)
            accel_z, _unused = draw(v)
            pitch_walk, yaw_walk = draw(v)
            v.gyro_drift += walk * pitch_walk
            v.gyro_yaw_drift += walk * yaw_walk
    v.ticks = reached
    measure(v, gyro, gyro_yaw, accel_x, accel_y, accel_z)


@kernel
def draw(v: Any) -> tuple[float, float]:
    """Return two standard normal numbers and advance the block's generator."""
    first, second, v.random_1, v.random_2, v.random_3, v.random_4, v.random_5, v.random_6 = normal_pair(
        v.random_1, v.random_2, v.random_3, v.random_4, v.random_5, v.random_6
    )
    return first, second


@kernel
def measure(v: Any, gyro: float, gyro_yaw: float, accel_x: float, accel_y: float, accel_z: float) -> None:
    """Set the outputs: truth, bias, drift, and noise given as standard normal numbers; then quantization."""
    rate_y, rate_z = angular_rate(v.pitch, v.pitch_rate, v.yaw_rate, v.ground_slope)
    force_x, force_y, force_z = specific_force(
        v.pitch, v.pitch_rate, v.pitch_acceleration, v.wheel_rate, v.wheel_acceleration, v.yaw_rate, v.yaw_acceleration,
        v.ground_slope, v.ground_slope_rate, v.gravity, v.wheel_radius, v.sensor_distance, v.sensor_elevation,
    )  # fmt: skip
    rate_noise = noise_deviation(v.gyro_noise_density, v.sample_time)
    force_noise = noise_deviation(v.accel_noise_density, v.sample_time)
    v.gyro = rate_y + v.gyro_bias + v.gyro_drift + rate_noise * gyro
    v.gyro_yaw = rate_z + v.gyro_yaw_bias + v.gyro_yaw_drift + rate_noise * gyro_yaw
    v.accel_x = force_x + v.accel_x_bias + force_noise * accel_x
    v.accel_y = force_y + v.accel_y_bias + force_noise * accel_y
    v.accel_z = force_z + v.accel_z_bias + force_noise * accel_z
    if v.quantization > 0.5:
        v.gyro = digitized(v.gyro, v.gyro_range, v.gyro_resolution)
        v.gyro_yaw = digitized(v.gyro_yaw, v.gyro_range, v.gyro_resolution)
        v.accel_x = digitized(v.accel_x, v.accel_range, v.accel_resolution)
        v.accel_y = digitized(v.accel_y, v.accel_range, v.accel_resolution)
        v.accel_z = digitized(v.accel_z, v.accel_range, v.accel_resolution)


def check(v: Any) -> list[str]:
    """Return the rules that the parameters break together."""
    found = []
    for kind, unit in (("gyro", "rad/s"), ("accel", "m/s2")):
        resolution, full_scale = getattr(v, f"{kind}_resolution"), getattr(v, f"{kind}_range")
        if resolution > full_scale:
            found.append(
                f"{kind}_resolution = {resolution:g} {unit} must not exceed {kind}_range = {full_scale:g} {unit}"
            )
    return found


BLOCK = Block("imu",
"Inertial sensor on the body: gyros and accelerometer with noise, bias, quantization and saturation",
              VARIABLES, initialize, step, check)  # fmt: skip
