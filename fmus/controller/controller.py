"""The controller: sliding-mode or PID balance, sliding-mode yaw, friction compensation and an outer velocity loop."""

from typing import Any

from twip.fmi.declare import Block, input, local, output, parameter, sided, state
from twip.robot.compensation import friction_voltage
from twip.robot.kernel import kernel
from twip.robot.pid import pid
from twip.robot.sampling import ticks_reached
from twip.robot.sliding_mode import balance_torque, reaching, voltages, yaw_torque
from twip.robot.speed_loop import pitch_reference

FRICTION = ("coulomb_forward", "coulomb_reverse", "viscous_forward", "viscous_reverse")

VARIABLES = (
    *(parameter(name) for name in (
        "gravity", "gear_ratio", "wheel_radius", "wheel_mass", "wheel_inertia", "rotor_inertia", "gear_inertia",
        "track_width",
        "body_mass", "cog_height", "body_pitch_inertia", "body_yaw_inertia", "resistance", "torque_constant",
        "back_emf_constant",
    )),
    *(parameter(f"{side}.{name}") for side in ("left", "right") for name in FRICTION),
    *(parameter(name) for name in (
        "supply_voltage", "rest_time", "control_law", "c1", "c2", "epsilon1", "boundary1", "c3", "c4", "epsilon2",
        "boundary2",
        "compensation", "compensation_speed", "compensation_rest_speed", "proportional_gain", "integral_gain",
        "derivative_gain",
        "speed_loop", "speed_proportional_gain", "speed_integral_gain", "pitch_reference_limit", "sample_time",
        "sample_offset",
    )),
    input("pitch", "rad", "estimated pitch, forward lean positive", display_unit="deg"),
    input("pitch_rate", "rad/s", "estimated pitch rate", display_unit="deg/s"),
    input("wheel_rate", "rad/s", "estimated mean absolute wheel rate, forward positive"),
    input("yaw", "rad", "estimated yaw, left positive", display_unit="deg"),
    input("yaw_rate", "rad/s", "estimated yaw rate", display_unit="deg/s"),
    input("left.shaft_speed", "rad/s", "estimated shaft speed of the left motor relative to the body"),
    input("right.shaft_speed", "rad/s", "estimated shaft speed of the right motor relative to the body"),
    input("pitch_offset", "rad", "offset of the pitch reference, set by the operator: the robot accelerates that way",
          display_unit="deg"),
    input("speed_reference", "m/s", "speed to keep while the velocity loop is on"),
    input("yaw_reference", "rad", "yaw to keep", display_unit="deg"),
    input("enable", None, "the drive is on above 0.5", 1.0, minimum=0.0, maximum=1.0),
    *sided("left", (output("voltage", "V", "commanded voltage of the left motor", variability="discrete"),)),
    *sided("right", (output("voltage", "V", "commanded voltage of the right motor", variability="discrete"),)),
    output("s1", "rad/s", "balance surface c1 (pitch - pitch_reference) + c2 pitch_rate", display_unit="deg/s",
           variability="discrete", initially=("pitch", "pitch_rate", "pitch_offset")),
    output("s2", "rad/s", "yaw surface c3 (yaw - yaw_reference) + c4 yaw_rate", display_unit="deg/s",
           variability="discrete", initially=("yaw", "yaw_rate", "yaw_reference")),
    output("pitch_reference", "rad", "pitch reference: offset and velocity loop", display_unit="deg",
           variability="discrete", initially=("pitch_offset",)),
    output("left.compensation_voltage", "V", "share of the left voltage that pays for friction, within no limit",
           variability="discrete"),
    output("right.compensation_voltage", "V", "share of the right voltage that pays for friction, within no limit",
           variability="discrete"),
    local("speed_integral", "m", "integral of the speed error", variability="discrete"),
    local("pitch_integral", "rad.s", "integral of the pitch error (PID)", variability="discrete"),
    state("start"), state("ticks"), state("sampled"),
)  # fmt: skip


@kernel
def initialize(v: Any, time: float) -> None:
    """Drive off, integrals empty; the surfaces show the first inputs."""
    v.start, v.sampled = time, time
    v.ticks = ticks_reached(time, time, v.sample_time, v.sample_offset)
    v.speed_integral, v.pitch_integral = 0.0, 0.0
    v.pitch_reference = v.pitch_offset
    see(v)
    rest(v)


@kernel
def step(v: Any, time: float, step_size: float) -> None:
    """Command the motors at the ticks; off before the rest is over and while not enabled, with the integrals held."""
    end = time + step_size
    reached = ticks_reached(end, v.start, v.sample_time, v.sample_offset)
    if reached <= v.ticks:
        return
    elapsed = end - v.sampled
    v.ticks, v.sampled = reached, end
    on = v.enable > 0.5 and ticks_reached(end, v.start, 1.0, v.rest_time) > 0.0
    v.pitch_reference = v.pitch_offset
    if v.speed_loop > 0.5:
        error = v.speed_reference - v.wheel_radius * v.wheel_rate
        reference, integral = pitch_reference(
            error, v.speed_integral, elapsed, v.speed_proportional_gain, v.speed_integral_gain, v.pitch_reference_limit
        )
        if on:
            v.pitch_reference += reference
            v.speed_integral = integral
    see(v)
    if on:
        drive(v, elapsed)
    else:
        rest(v)


@kernel
def see(v: Any) -> None:
    """Set both sliding surfaces from the inputs and the pitch reference."""
    v.s1 = v.c1 * (v.pitch - v.pitch_reference) + v.c2 * v.pitch_rate
    v.s2 = v.c3 * (v.yaw - v.yaw_reference) + v.c4 * v.yaw_rate


@kernel
def rest(v: Any) -> None:
    """Switch both motors off."""
    v.left_voltage, v.right_voltage = 0.0, 0.0
    v.left_compensation_voltage, v.right_compensation_voltage = 0.0, 0.0


@kernel
def drive(v: Any, elapsed: float) -> None:
    """Set both voltages: balance and yaw, plus the friction's share, within the supply."""
    turn = yaw_torque(v, v.pitch, v.pitch_rate, v.wheel_rate, v.yaw_rate, reaching(v.s2, v.boundary2))
    if v.control_law > 1.5:
        left, right = voltages(v, 0.0, turn)
        common, v.pitch_integral = pid(
            v.pitch - v.pitch_reference, v.pitch_rate, v.pitch_integral, elapsed, v.proportional_gain, v.integral_gain,
            v.derivative_gain, v.supply_voltage,
        )  # fmt: skip
        left += common
        right += common
    else:
        reach = reaching(v.s1, v.boundary1)
        left, right = voltages(v, balance_torque(v, v.pitch, v.pitch_rate, v.wheel_rate, v.yaw_rate, reach), turn)
    v.left_compensation_voltage = v.compensation * friction_voltage(
        left, v.left_shaft_speed, v.left_coulomb_forward, v.left_coulomb_reverse, v.resistance, v.torque_constant,
        v.compensation_speed, v.compensation_rest_speed,
    )  # fmt: skip
    v.right_compensation_voltage = v.compensation * friction_voltage(
        right, v.right_shaft_speed, v.right_coulomb_forward, v.right_coulomb_reverse, v.resistance, v.torque_constant,
        v.compensation_speed, v.compensation_rest_speed,
    )  # fmt: skip
    v.left_voltage = clipped(left + v.left_compensation_voltage, v.supply_voltage)
    v.right_voltage = clipped(right + v.right_compensation_voltage, v.supply_voltage)


@kernel
def clipped(voltage: float, limit: float) -> float:
    """Return the voltage held within +-limit, both in V."""
    if voltage > limit:
        return limit
    if voltage < -limit:
        return -limit
    return voltage


def check(v: Any) -> list[str]:
    """Return the rules that the parameters break together."""
    found = []
    for slope, rate, surface in (("c1", "c2", "s1"), ("c3", "c4", "s2")):
        if getattr(v, slope) <= 0.0:
            found.append(
                f"{slope} = {getattr(v, slope):g} 1/s must be positive: "
                f"{surface} = 0 is stable only with {slope} / {rate} > 0"
            )
    return found


BLOCK = Block("controller",
"Sliding-mode or PID balance, sliding-mode yaw, friction compensation and an outer velocity loop",
              VARIABLES, initialize, step, check)  # fmt: skip
