"""The test bench: one motor's shaft with an inertia and its dry friction, driven by voltage or by current."""

from math import fabs
from typing import Any

from twip.fmi.declare import Block, input, local, output, parameter, start_value, state
from twip.robot.bench import bench_motion, beyond, drive_voltage, limited, trimmed
from twip.robot.kernel import kernel

PARAMETERS = ("bench_inertia", "current_drive", "resistance", "back_emf_constant", "supply_voltage")
COMMANDS = ("voltage_command", "current_command")

VARIABLES = (
    *(parameter(name) for name in PARAMETERS),
    start_value("shaft_speed_start", "rad/s", "shaft speed at the start"),
    input("voltage_command", "V", "voltage to put out, while the drive is by voltage"),
    input("current_command", "A", "current to keep in the motor, while the drive is by current"),
    input("drive_torque", "N.m", "drive torque on the shaft, net of viscous friction", nominal=1e-3),
    input("coulomb_forward_limit", "N.m", "Coulomb friction at positive shaft speed", minimum=0.0, nominal=1e-3),
    input("coulomb_reverse_limit", "N.m", "Coulomb friction at negative shaft speed", minimum=0.0, nominal=1e-3),
    input("static_forward_limit", "N.m", "static friction towards positive speed", minimum=0.0, nominal=1e-3),
    input("static_reverse_limit", "N.m", "static friction towards negative speed", minimum=0.0, nominal=1e-3),
    input("stribeck_speed_limit", "rad/s", "speed at which the Stribeck effect has fallen to 1/e", 0.4102, minimum=0.0),
    input("current", "A", "current of the motor"),
    output("voltage", "V", "voltage to the motor", COMMANDS, nominal=12.0),
    output("shaft_speed", "rad/s", "shaft speed", nominal=100.0),
    output("shaft_angle", "rad", "shaft angle", nominal=100.0),
    local("trim_voltage", "V", "share of the voltage that corrects the current", variability="discrete"),
    state("last_command"), state("earlier_command"),
)  # fmt: skip


@kernel
def initialize(v: Any, time: float) -> None:
    """Start at the given speed with the voltage the command asks for; the motor has no current yet."""
    v.shaft_speed = v.shaft_speed_start
    v.shaft_angle = 0.0
    v.trim_voltage = 0.0
    v.last_command, v.earlier_command = 0.0, 0.0
    supply(v)


@kernel
def step(v: Any, time: float, step_size: float) -> None:
    """Turn the shaft, compare the current with the commands that may have caused it, and set the next voltage."""
    v.shaft_speed, turned = bench_motion(
        v.shaft_speed, v.drive_torque, v.bench_inertia, v.coulomb_forward_limit, v.coulomb_reverse_limit,
        v.static_forward_limit, v.static_reverse_limit, v.stribeck_speed_limit, step_size,
    )  # fmt: skip
    v.shaft_angle += turned
    if v.current_drive > 0.5 and fabs(v.voltage) < v.supply_voltage:
        excess = beyond(v.current, v.current_command, v.last_command, v.earlier_command)
        v.trim_voltage = trimmed(v.trim_voltage, excess, v.resistance, step_size)
    v.earlier_command = v.last_command
    v.last_command = v.current_command
    supply(v)


@kernel
def supply(v: Any) -> None:
    """Set the voltage to the motor."""
    if v.current_drive > 0.5:
        v.voltage = drive_voltage(
            v.shaft_speed, v.current_command, v.trim_voltage, v.resistance, v.back_emf_constant, v.supply_voltage
        )
    else:
        v.voltage = limited(v.voltage_command, v.supply_voltage)


BLOCK = Block("bench", "Test bench of one motor: inertia with dry friction", VARIABLES, initialize, step)
