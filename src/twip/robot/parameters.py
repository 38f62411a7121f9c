"""Every parameter of the robot, once: value, unit, bounds, meaning and source.

The blocks, the parameter sets and the identification all take their numbers from here. Sources: "paper" is F. Dai et al.,
"A two-wheeled inverted pendulum robot with friction compensation" (tables, equations and text as named); "datasheet" names
the device class; "assumed" is this project's own choice, made where the paper gives no number.
"""

from dataclasses import dataclass
from math import pi, radians


@dataclass(frozen=True)
class Parameter:
    """One number of the robot, in SI units.

    `name` is unique in the project; a dot separates the side (`left.`, `right.`) or the group. `minimum` and `maximum` are
    inclusive. A `tunable` parameter may change while a simulation runs, any other is fixed once it has begun. `identified`
    marks what an identification may fit.
    """

    name: str
    value: float | int | bool
    unit: str
    description: str
    source: str
    minimum: float | None = None
    maximum: float | None = None
    display_unit: str | None = None
    tunable: bool = False
    identified: bool = False

    @property
    def type(self) -> str:
        """FMI base type: `Real`, `Integer` or `Boolean`, told by the type of the value."""
        return {bool: "Boolean", int: "Integer", float: "Real"}[type(self.value)]


def _friction(side: str, tables: str, values: tuple[float, float, float, float]) -> tuple[Parameter, ...]:
    coulomb_forward, coulomb_reverse, viscous_forward, viscous_reverse = values
    viscous = "N.m.s/rad"
    return (
        Parameter(
            f"{side}.coulomb_forward",
            coulomb_forward,
            "N.m",
            "Coulomb friction torque at positive shaft speed",
            f"paper, {tables}, magnitude",
            0.0,
            0.1,
            identified=True,
        ),
        Parameter(
            f"{side}.coulomb_reverse",
            coulomb_reverse,
            "N.m",
            "Coulomb friction torque at negative shaft speed",
            f"paper, {tables}, magnitude",
            0.0,
            0.1,
            identified=True,
        ),
        Parameter(
            f"{side}.static_forward",
            coulomb_forward,
            "N.m",
            "static friction torque towards positive shaft speed",
            "equal to Coulomb: no Stribeck effect unless a parameter set gives one",
            0.0,
            0.1,
            identified=True,
        ),
        Parameter(
            f"{side}.static_reverse",
            coulomb_reverse,
            "N.m",
            "static friction torque towards negative shaft speed",
            "equal to Coulomb: no Stribeck effect unless a parameter set gives one",
            0.0,
            0.1,
            identified=True,
        ),
        Parameter(
            f"{side}.viscous_forward",
            viscous_forward,
            viscous,
            "viscous friction coefficient at positive shaft speed",
            f"paper, {tables}",
            0.0,
            1e-3,
            identified=True,
        ),
        Parameter(
            f"{side}.viscous_reverse",
            viscous_reverse,
            viscous,
            "viscous friction coefficient at negative shaft speed",
            f"paper, {tables}",
            0.0,
            1e-3,
            identified=True,
        ),
    )


MOTOR = (
    *_friction("left", "table 1", (7.223e-4, 5.333e-4, 1.886e-6, 2.394e-6)),
    *_friction("right", "table 3", (5.600e-4, 4.561e-4, 1.888e-6, 1.248e-6)),
    Parameter("stribeck_speed", 0.4102, "rad/s", "shaft speed at which the Stribeck effect has fallen to 1/e",
              "paper, tables 2 and 4, magnitude", 1e-3, 1e3, identified=True),
    Parameter("resistance", 1.9, "Ohm", "terminal resistance", "datasheet, 12 V coreless gear motor (Faulhaber 2342 class)", 1e-3, 1e3),
    Parameter("inductance", 65e-6, "H", "terminal inductance", "datasheet, 12 V coreless gear motor (Faulhaber 2342 class)", 1e-9, 1.0),
    Parameter("torque_constant", 0.0134, "N.m/A", "torque constant", "datasheet, 12 V coreless gear motor (Faulhaber 2342 class)", 1e-6, 10.0),
    Parameter("back_emf_constant", 0.0134, "V.s/rad", "back-EMF constant", "datasheet, equal to the torque constant", 1e-6, 10.0),
    Parameter("encoder_resolution", 2048.0, "1", "encoder counts per motor revolution", "assumed", 1.0, 1e7),
    Parameter("bench_inertia", 1.5450e-6, "kg.m2", "inertia on the motor shaft of the test bench, rotor and gear included",
              "paper, eq (12), identified", 1e-9, 1.0, identified=True),
    Parameter("current_drive", False, "1", "the test bench keeps the motor's current, not its voltage", "nominal"),
)  # fmt: skip

BODY = (
    Parameter("gravity", 9.81, "m/s2", "gravitational acceleration", "standard value", 0.0, 100.0),
    Parameter("gear_ratio", 13.7, "1", "motor revolutions per wheel revolution", "paper, section 2.1", 1.0, 1000.0),
    Parameter("wheel_radius", 0.050, "m", "wheel radius", "assumed", 1e-3, 10.0),
    Parameter("wheel_mass", 0.100, "kg", "mass of one wheel", "assumed", 1e-4, 1000.0),
    Parameter("wheel_inertia", 1.7046e-4, "kg.m2", "inertia of one wheel about its axle",
              "closes the identified 1.5450e-6 kg.m2 of paper eq (12)", 1e-9, 100.0, identified=True),
    Parameter("rotor_inertia", 5.7e-7, "kg.m2", "inertia of one rotor on the motor shaft", "datasheet, 12 V coreless gear motor (Faulhaber 2342 class)", 0.0, 1.0),
    Parameter("gear_inertia", 6.68e-8, "kg.m2", "inertia of one gear reduction on the motor shaft",
              "closes the estimated 1.3028e-6 kg.m2 of paper eq (12)", 0.0, 1.0),
    Parameter("track_width", 0.200, "m", "distance between the wheels", "assumed", 1e-2, 10.0),
    Parameter("body_mass", 2.0, "kg", "mass of the body with the 0.5 kg test load", "assumed", 1e-3, 1000.0),
    Parameter("cog_height", 0.0775, "m", "distance from the axle up to the body's centre of gravity", "assumed", 1e-3, 10.0),
    Parameter("body_pitch_inertia", 6.44e-3, "kg.m2", "inertia of the body about its centre of gravity, pitch axis", "assumed, box formula", 1e-6, 1000.0),
    Parameter("body_yaw_inertia", 4.43e-3, "kg.m2",
              "yaw inertia of the body with the wheels' own; the body's inertias about x and z are taken as equal", "assumed, box formula", 1e-6, 1000.0),
    Parameter("rolling_resistance", 0.010, "1", "rolling resistance coefficient", "assumed, hard floor", 0.0, 1.0),
    Parameter("push_height", 0.15, "m", "distance from the axle up to the point where the push acts", "assumed", 0.0, 10.0),
    Parameter("fallen_angle", radians(60.0), "rad", "pitch beyond which the robot has fallen", "assumed", 0.01, pi, "deg"),
    Parameter("bump_height", 0.0, "m", "height of the terrain's bumps", "flat floor", -0.1, 0.1),
    Parameter("bump_length", 0.10, "m", "length of one bump along the way", "assumed", 1e-3, 100.0),
    Parameter("bump_spacing", 0.50, "m", "distance between the beginnings of two bumps, at least the length", "assumed", 1e-3, 1e6),
    Parameter("bump_start", 0.20, "m", "travelled distance at which the first bump begins", "assumed", -1e6, 1e6),
    Parameter("inner_step", 2.5e-4, "s", "largest step of the plant's own integration", "measured, see the plant's README", 1e-7, 1.0),
    Parameter("hold_time", 0.0, "s", "time after the start for which the robot is held as it stands", "nominal", 0.0, 1e6),
)  # fmt: skip

IMU = (
    Parameter("sensor_distance", 0.10, "m", "distance from the axle to the inertial sensor", "assumed; paper, Fig 9", 0.0, 10.0),
    Parameter("sensor_elevation", radians(60.0), "rad", "angle of the line axle to sensor above the body's x axis", "assumed; paper, Fig 9", -pi, pi, "deg"),
    Parameter("gyro_noise_density", radians(0.005), "rad/s/Hz0.5", "one-sided noise density of the gyro", "datasheet, MPU-6050", 0.0, 10.0),
    Parameter("gyro_range", radians(500.0), "rad/s", "full scale of the gyro", "datasheet, MPU-6050", 1e-3, 1e4, "deg/s"),
    Parameter("gyro_resolution", radians(1 / 65.5), "rad/s", "step of the gyro's output", "datasheet, MPU-6050", 1e-9, 1.0, "deg/s"),
    Parameter("gyro_bias", radians(0.5), "rad/s", "residual pitch gyro bias after power-on zeroing", "assumed", -1.0, 1.0, "deg/s"),
    Parameter("gyro_yaw_bias", radians(0.5), "rad/s", "residual yaw gyro bias after power-on zeroing", "assumed", -1.0, 1.0, "deg/s"),
    Parameter("gyro_bias_walk", radians(0.01), "rad/s/s0.5", "random walk of the gyro biases", "assumed", 0.0, 1.0),
    Parameter("accel_noise_density", 400e-6 * 9.81, "m/s2/Hz0.5", "one-sided noise density of the accelerometer", "datasheet, MPU-6050", 0.0, 10.0),
    Parameter("accel_range", 4 * 9.81, "m/s2", "full scale of the accelerometer", "datasheet, MPU-6050", 1e-3, 1e4),
    Parameter("accel_resolution", 9.81 / 8192, "m/s2", "step of the accelerometer's output", "datasheet, MPU-6050", 1e-9, 10.0),
    Parameter("accel_x_bias", 5e-3 * 9.81, "m/s2", "residual accelerometer bias, forward", "assumed", -10.0, 10.0),
    Parameter("accel_y_bias", 5e-3 * 9.81, "m/s2", "residual accelerometer bias, left", "assumed", -10.0, 10.0),
    Parameter("accel_z_bias", 5e-3 * 9.81, "m/s2", "residual accelerometer bias, up", "assumed", -10.0, 10.0),
    Parameter("noise", True, "1", "noise and bias walk are on", "nominal"),
    Parameter("quantization", True, "1", "quantization and saturation are on", "nominal"),
    Parameter("seed", 1, "1", "seed of the noise generator", "nominal", 0, 2**31 - 1),
)  # fmt: skip

SAMPLING = (
    Parameter("sample_time", 0.005, "s", "sample time", "assumed; 2 to 20 ms stand", 1e-6, 10.0),
    Parameter("sample_offset", 0.0, "s", "time of the first sample after the start", "nominal", 0.0, 10.0),
)  # fmt: skip

ESTIMATOR = (
    Parameter("kalman_angle_noise", 3.05e-8, "rad2/s", "process noise density of the pitch", "(0.01 deg/s)^2 per s", 0.0, 1.0, tunable=True),
    Parameter("kalman_bias_noise", 1.22e-7, "rad2/s3", "process noise density of the gyro bias", "(0.02 deg/s)^2 per s", 0.0, 1.0, tunable=True),
    Parameter("kalman_measurement_noise", radians(0.6), "rad", "standard deviation of the accelerometer's pitch at rest", "prototype", 1e-6, 10.0, "deg", tunable=True),
    Parameter("kalman_force_scale", 0.05, "1", "deviation of the specific force from g, in g, that doubles the measurement variance", "prototype", 1e-6, 1e6, tunable=True),
    Parameter("kalman_acceleration_scale", 0.5, "m/s2", "axle acceleration that doubles the measurement variance", "prototype", 1e-6, 1e6, tunable=True),
    Parameter("kalman_bias_start", radians(1.0), "rad/s", "standard deviation of the gyro bias at the start", "assumed, twice the residual bias", 1e-9, 10.0, "deg/s"),
    Parameter("acceleration_filter_time", 0.1, "s", "time constant of the low-pass on the axle acceleration that inflates the measurement variance; short ones tie weight to error", "prototype", 0.0, 10.0),
    Parameter("low_pass_bandwidth", 5.0, "Hz", "bandwidth of the second-order low-pass of Fig 12", "paper, section 4.4", 1e-3, 1e4),
)  # fmt: skip

CONTROLLER = (
    Parameter("supply_voltage", 12.0, "V", "largest magnitude of a motor's voltage", "datasheet, rated voltage", 0.0, 1000.0),
    Parameter("rest_time", 1.0, "s", "time at rest after the start before the drive is enabled", "nominal", 0.0, 1e6),
    Parameter("control_law", 1, "1", "balance control: 1 sliding mode, 2 PID", "nominal", 1, 2),
    Parameter("c1", 10.0, "1/s", "pitch weight of the sliding surface s1, paper eq (45)", "prototype", 0.0, 1e4, tunable=True),
    Parameter("c2", 1.0, "1", "pitch rate weight of the sliding surface s1, paper eq (45)", "prototype", 1e-6, 1e4, tunable=True),
    Parameter("epsilon1", 30.0, "rad/s2", "reaching rate of s1, paper eq (46)", "prototype", 0.0, 1e6, tunable=True),
    Parameter("boundary1", 3.0, "rad/s", "boundary layer of s1; 0 is the literal sign law", "prototype", 0.0, 1e6, tunable=True),
    Parameter("c3", 3.0, "1/s", "yaw weight of the sliding surface s2, paper eq (50)", "prototype", 0.0, 1e4, tunable=True),
    Parameter("c4", 1.0, "1", "yaw rate weight of the sliding surface s2, paper eq (50)", "prototype", 1e-6, 1e4, tunable=True),
    Parameter("epsilon2", 15.0, "rad/s2", "reaching rate of s2, paper eq (51)", "prototype", 0.0, 1e6, tunable=True),
    Parameter("boundary2", 1.0, "rad/s", "boundary layer of s2; 0 is the literal sign law", "prototype", 0.0, 1e6, tunable=True),
    Parameter("compensation", 1.0, "1", "share of the friction that is compensated; 0 is none", "paper, section 5", 0.0, 10.0, tunable=True),
    Parameter("compensation_speed", 2.0, "rad/s", "shaft speed at which the friction compensation is complete", "prototype", 1e-6, 1e4, tunable=True),
    Parameter("compensation_rest_speed", 1.0, "rad/s", "shaft speed below which the friction compensation follows the commanded voltage", "prototype", 0.0, 1e4, tunable=True),
    Parameter("proportional_gain", 25.0, "V/rad", "PID: proportional gain k_p, paper eq (64)", "prototype", 0.0, 1e5, tunable=True),
    Parameter("integral_gain", 40.0, "V/(rad.s)", "PID: integral gain k_i, paper eq (64)", "prototype", 0.0, 1e5, tunable=True),
    Parameter("derivative_gain", 1.0, "V.s/rad", "PID: derivative gain k_d, paper eq (64)", "prototype", 0.0, 1e5, tunable=True),
    Parameter("speed_loop", False, "1", "the outer velocity loop is on", "nominal", tunable=True),
    Parameter("speed_proportional_gain", 0.25, "rad.s/m", "outer velocity loop: proportional gain", "prototype", 0.0, 1e3, tunable=True),
    Parameter("speed_integral_gain", 0.08, "rad/m", "outer velocity loop: integral gain", "prototype", 0.0, 1e3, tunable=True),
    Parameter("pitch_reference_limit", radians(10.0), "rad", "outer velocity loop: largest pitch reference", "prototype", 0.0, pi / 2, "deg", tunable=True),
)  # fmt: skip

PARAMETERS = {p.name: p for p in (*MOTOR, *BODY, *IMU, *SAMPLING, *ESTIMATOR, *CONTROLLER)}
"""All parameters by name."""


def value(name: str) -> float:
    """Return the nominal value of a parameter in its SI unit; an unknown name raises KeyError."""
    return float(PARAMETERS[name].value)
