"""The motor of one side: winding, friction and encoder. Its inertia is in the plant."""

from typing import Any

from twip.fmi.declare import Block, input, output, parameter
from twip.robot.encoder import encoder_count
from twip.robot.kernel import kernel
from twip.robot.motor import motor_step

SIDE = ("coulomb_forward", "coulomb_reverse", "static_forward", "static_reverse", "viscous_forward", "viscous_reverse")
BOTH = ("stribeck_speed", "resistance", "inductance", "torque_constant", "back_emf_constant", "encoder_resolution")
TORQUE = "drive torque on the shaft, mean of the step, net of viscous friction"

VARIABLES = (
    *(parameter(name, f"left.{name}") for name in SIDE),
    *(parameter(name) for name in BOTH),
    input("voltage", "V", "terminal voltage; positive drives forward", nominal=12.0),
    input("shaft_speed", "rad/s", "shaft speed relative to the body, mean of the step", nominal=100.0),
    input("shaft_angle", "rad", "shaft angle relative to the body at the beginning of the step"),
    output("drive_torque", "N.m", TORQUE, ("voltage", "shaft_speed"), nominal=0.01),
    output("coulomb_forward_limit", "N.m", "Coulomb friction at positive shaft speed", nominal=1e-3),
    output("coulomb_reverse_limit", "N.m", "Coulomb friction at negative shaft speed", nominal=1e-3),
    output("static_forward_limit", "N.m", "static friction towards positive shaft speed", nominal=1e-3),
    output("static_reverse_limit", "N.m", "static friction towards negative shaft speed", nominal=1e-3),
    output("stribeck_speed_limit", "rad/s", "shaft speed at which the Stribeck effect has fallen to 1/e"),
    output("current", "A", "winding current at the end of the step"),
    output("encoder_count", None, "whole encoder counts at the end of the step", ("shaft_angle", "shaft_speed")),
)


@kernel
def initialize(v: Any, time: float) -> None:
    """No current yet: the drive torque is the viscous friction alone."""
    v.current = 0.0
    v.coulomb_forward_limit = v.coulomb_forward
    v.coulomb_reverse_limit = v.coulomb_reverse
    v.static_forward_limit = v.static_forward
    v.static_reverse_limit = v.static_reverse
    v.stribeck_speed_limit = v.stribeck_speed
    act(v, 0.0)


@kernel
def step(v: Any, time: float, step_size: float) -> None:
    """Solve the winding exactly at constant voltage and speed, and count."""
    act(v, step_size)


@kernel
def act(v: Any, duration: float) -> None:
    """Set current, torque and encoder count after a duration, 0 at the start."""
    v.current, v.drive_torque = motor_step(
        v.current, v.voltage, v.shaft_speed, duration, v.resistance, v.inductance, v.torque_constant,
        v.back_emf_constant, v.viscous_forward, v.viscous_reverse,
    )  # fmt: skip
    v.encoder_count = encoder_count(v.shaft_angle + v.shaft_speed * duration, v.encoder_resolution)


BLOCK = Block("motor", "Direct-current gear motor of one side with encoder", VARIABLES, initialize, step)
