"""The robot's mechanics: body, wheels, rotors and gears, dry friction, ground and push."""

from math import fabs, pi
from typing import Any

from twip.fmi.declare import Block, Variable, input, local, output, parameter, sided, start_value, state
from twip.robot.accelerations import observe
from twip.robot.integrator import advance
from twip.robot.kernel import kernel
from twip.robot.parameters import BODY
from twip.robot.plant import constants, smallest_determinant
from twip.robot.sampling import ticks_reached

SIDES = ("left", "right")
COULOMB = ("coulomb_forward_limit", "coulomb_reverse_limit")
STATIC = ("static_forward_limit", "static_reverse_limit")
MOTOR = ("drive_torque", *COULOMB, *STATIC, "stribeck_speed_limit")
ACTING = (
    *(f"{side}.{name}" for side in SIDES for name in MOTOR),
    *("push_force", "slope", "body_torque", "wheels_locked"),
)
"""Inputs that act on the accelerations and on the friction at once."""


def both(*variables: Variable) -> tuple[Variable, ...]:
    """Return the variables for the left and the right side."""
    return sided("left", variables) + sided("right", variables)


VARIABLES = (
    *(parameter(p.name) for p in BODY),
    start_value("pitch_start", "rad", "pitch at the start", 0.0, "deg", -pi, pi),
    start_value("pitch_rate_start", "rad/s", "pitch rate at the start, unless held", 0.0, "deg/s"),
    start_value("wheel_angle_start", "rad", "wheel angle at the start, mean of both"),
    start_value("wheel_rate_start", "rad/s", "wheel rate at the start, mean of both, unless held"),
    start_value("yaw_start", "rad", "yaw at the start", 0.0, "deg"),
    start_value("yaw_rate_start", "rad/s", "yaw rate at the start, unless held", 0.0, "deg/s"),
    start_value("x_start", "m", "place of the axle's middle at the start, x"),
    start_value("y_start", "m", "place of the axle's middle at the start, y"),
    *both(
        input("drive_torque", "N.m", "drive torque on the motor shaft, net of viscous friction", nominal=0.01),
        input("coulomb_forward_limit", "N.m", "Coulomb friction at positive shaft speed", minimum=0.0, nominal=1e-3),
        input("coulomb_reverse_limit", "N.m", "Coulomb friction at negative shaft speed", minimum=0.0, nominal=1e-3),
        input("static_forward_limit", "N.m", "static friction towards positive shaft speed", minimum=0.0, nominal=1e-3),
        input("static_reverse_limit", "N.m", "static friction towards negative shaft speed", minimum=0.0, nominal=1e-3),
        input("stribeck_speed_limit", "rad/s", "speed at which Stribeck friction is down to 1/e", 0.4102, minimum=0.0),
    ),
    input("push_force", "N", "horizontal push on the body along the heading, forward positive",
          minimum=-1000.0, maximum=1000.0),
    input("slope", "rad", "slope of the ground along the heading, uphill positive", 0.0, "deg", -1.5, 1.5),
    input("body_torque", "N.m", "torque from outside on the body, forward positive", minimum=-100.0, maximum=100.0),
    input("wheels_locked", None, "both wheels are held fast above 0.5", 0.0, None, 0.0, 1.0, variability="discrete"),
    *both(
        output("shaft_speed", "rad/s", "motor shaft speed relative to the body", nominal=100.0),
        output("shaft_angle", "rad", "motor shaft angle relative to the body", nominal=100.0),
    ),
    *(
        output(f"{side}.friction_torque", "N.m", "dry friction torque on the motor shaft", ACTING, nominal=1e-3)
        for side in SIDES
    ),
    output("pitch", "rad", "pitch of the body, forward lean positive", display_unit="deg"),
    output("pitch_rate", "rad/s", "pitch rate", display_unit="deg/s"),
    output("pitch_acceleration", "rad/s2", "pitch acceleration", ACTING, nominal=10.0),
    output("yaw", "rad", "yaw, left positive", display_unit="deg"),
    output("yaw_rate", "rad/s", "yaw rate", display_unit="deg/s"),
    output("yaw_acceleration", "rad/s2", "yaw acceleration", ACTING, nominal=10.0),
    output("wheel_angle", "rad", "absolute wheel angle, mean of both, forward positive"),
    output("wheel_rate", "rad/s", "absolute wheel rate, mean of both", nominal=10.0),
    output("wheel_acceleration", "rad/s2", "wheel acceleration, mean of both", ACTING, nominal=100.0),
    output("x", "m", "place of the axle's middle, x"),
    output("y", "m", "place of the axle's middle, y, left of x"),
    output("ground_slope", "rad", "slope under the wheels, input and terrain, uphill positive", ("slope",), "deg"),
    output("ground_slope_rate", "rad/s", "rate of the slope under the wheels, terrain alone", display_unit="deg/s"),
    output("fallen", None, "1 once fallen: free, beyond the fallen angle and not rising", variability="discrete"),
    *both(
        local("wheel_rate", "rad/s", "absolute wheel rate"),
        local("rolling_torque", "N.m", "rolling resistance, or the lock's torque, on the wheel"),
    ),
    state("start"),
)  # fmt: skip


@kernel
def initialize(v: Any, time: float) -> None:
    """Put the robot where the start values say; held, it starts at rest."""
    v.start = time
    free = 0.0 if held(v, time) else 1.0
    ratio = v.track_width / (2.0 * v.wheel_radius)
    v.pitch, v.yaw, v.wheel_angle, v.x, v.y = v.pitch_start, v.yaw_start, v.wheel_angle_start, v.x_start, v.y_start
    v.pitch_rate = free * v.pitch_rate_start
    v.left_wheel_rate = free * (v.wheel_rate_start - ratio * v.yaw_rate_start)
    v.right_wheel_rate = free * (v.wheel_rate_start + ratio * v.yaw_rate_start)
    v.left_shaft_angle = v.gear_ratio * (v.wheel_angle - ratio * v.yaw - v.pitch)
    v.right_shaft_angle = v.gear_ratio * (v.wheel_angle + ratio * v.yaw - v.pitch)
    v.fallen = 0.0
    observe(v, 1.0 - free)


@kernel
def step(v: Any, time: float, step_size: float) -> None:
    """Move, unless held; note a fall for good. What starts beyond the fallen angle and rises has not fallen."""
    if held(v, time):
        observe(v, 1.0)
        return
    advance(v, step_size)
    if fabs(v.pitch) > v.fallen_angle and v.pitch * v.pitch_rate >= 0.0:
        v.fallen = 1.0
    observe(v, 0.0)


@kernel
def held(v: Any, time: float) -> bool:
    """Tell whether the robot is still held in a step that begins at a time [s]: the release is a tick like others."""
    return ticks_reached(time, v.start, 1.0, v.hold_time) < 1.0


def check(v: Any) -> list[str]:
    """Return the rules that the parameters break together."""
    problems = []
    if v.bump_height != 0.0 and v.bump_length > v.bump_spacing:
        problems.append(f"bump_length = {v.bump_length:g} m must not exceed bump_spacing = {v.bump_spacing:g} m")
    slope = pi * fabs(v.bump_height) / v.bump_length
    if slope >= 1.0:
        bump = f"bump_height = {v.bump_height:g} m over bump_length = {v.bump_length:g} m"
        problems.append(f"{bump}: slope {slope:.3g} must be below 1")
    smallest = smallest_determinant(constants(v))
    if not smallest > 0.0:
        problems.append(
            f"masses, inertias and lengths: the mass matrix must be regular, its determinant is {smallest:.3g} kg2.m4"
        )
    return problems


BLOCK = Block("plant", "Mechanics of the two-wheeled robot with dry friction", VARIABLES, initialize, step, check)
