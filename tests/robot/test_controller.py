"""The controller against the equations of motion, scipy's discrete systems and its own rules."""

import math

import numpy as np
import pytest
from plain import instance, load, started
from scipy import signal

from twip.robot.compensation import friction_voltage
from twip.robot.pid import pid
from twip.robot.sliding_mode import reaching
from twip.robot.speed_loop import pitch_reference

CONTROLLER = load("controller").BLOCK
H = 0.005
AWAKE = {"rest_time": 0.0, "compensation": 0.0}
EVEN = {f"{side}_viscous_{way}": 1.9e-6 for side in ("left", "right") for way in ("forward", "reverse")}


def commanded(**values):
    """Return a controller after one sample with these parameters and inputs."""
    v = started(CONTROLLER, **values)
    CONTROLLER.step(v, 0.0, H)
    return v


def accelerations(v, coulomb):
    """Return (theta'', psi'', phi'') of the nominal robot under the controller's voltages, by matrices.

    The three coordinates are solved together from kinetic energy, gravity and motor torques per side; the winding has
    settled (i = (v - K_b omega) / R_m). `coulomb` adds Coulomb friction.
    """
    n, radius, width = v.gear_ratio, v.wheel_radius, v.track_width
    m, body, length, jm = v.wheel_mass, v.body_mass, v.cog_height, v.rotor_inertia + v.gear_inertia
    psi, psi1, theta1, phi1 = v.pitch, v.pitch_rate, v.wheel_rate, v.yaw_rate
    a = width / (2 * radius)
    to_wheels = np.array([[1, 0, -a], [1, 0, a]])  # absolute wheel rates left, right from (theta', psi', phi')
    to_shafts = n * (to_wheels - np.array([[0, 1, 0], [0, 1, 0]]))
    mass = v.wheel_inertia * to_wheels.T @ to_wheels + jm * to_shafts.T @ to_shafts
    mass += np.diag([2 * m * radius**2, 0, m * width**2 / 2])
    mass += body * np.array([
        [radius**2, radius * length * math.cos(psi), 0],
        [radius * length * math.cos(psi), length**2, 0],
        [0, 0, (length * math.sin(psi)) ** 2],
    ])  # fmt: skip
    mass += np.diag([0, v.body_pitch_inertia, v.body_yaw_inertia])
    # Acceleration of the body's centre by rates alone; it is rho = L sin psi in front of the axle and zeta above.
    rho, zeta = length * math.sin(psi), length * math.cos(psi)
    forward = -rho * (psi1**2 + phi1**2)
    left = radius * theta1 * phi1 + 2 * zeta * psi1 * phi1
    up = -zeta * psi1**2
    rates = body * np.array([radius * forward, zeta * forward - rho * up, rho * left])
    speeds = to_shafts @ np.array([theta1, psi1, phi1])
    volts = np.array([v.left_voltage, v.right_voltage])
    viscous = 1.9e-6
    torque = v.torque_constant * (volts - v.back_emf_constant * speeds) / v.resistance - viscous * speeds
    if coulomb:
        forward_limits = np.array([v.left_coulomb_forward, v.right_coulomb_forward])
        reverse_limits = np.array([v.left_coulomb_reverse, v.right_coulomb_reverse])
        torque -= np.where(speeds > 0, forward_limits, -reverse_limits)
    return np.linalg.solve(mass, to_shafts.T @ torque - rates + np.array([0, body * v.gravity * rho, 0]))


def moving(generator):
    """Return random inputs with shaft speeds that belong to the wheel, pitch and yaw rates."""
    n, a = 13.7, 2.0
    psi1, theta1, phi1 = generator.uniform(-3, 3), generator.uniform(-30, 30), generator.uniform(-2, 2)
    return {
        "pitch": generator.uniform(-0.5, 0.5), "pitch_rate": psi1, "wheel_rate": theta1, "yaw_rate": phi1,
        "yaw": generator.uniform(-1, 1), "yaw_reference": generator.uniform(-1, 1),
        "pitch_offset": generator.uniform(-0.1, 0.1),
        "left_shaft_speed": n * (theta1 - a * phi1 - psi1), "right_shaft_speed": n * (theta1 + a * phi1 - psi1),
    }  # fmt: skip


@pytest.mark.parametrize(
    "law", [{}, {"boundary1": 0.0, "boundary2": 0.0}, {"c1": 7.0, "c2": 1.7, "c3": 2.0, "c4": 0.6}]
)
def test_the_surfaces_approach_zero_as_designed(law):
    """s1' = -eps1 sat(s1 / Phi1) and s2' = -eps2 sat(s2 / Phi2), exactly, without Coulomb friction."""
    generator = np.random.default_rng(4)
    for _ in range(100):
        v = commanded(**AWAKE, **EVEN, **law, supply_voltage=1e3, **moving(generator))
        _, pitch2, yaw2 = accelerations(v, coulomb=False)
        rate1, rate2 = v.c1 * v.pitch_rate + v.c2 * pitch2, v.c3 * v.yaw_rate + v.c4 * yaw2
        sat1 = np.clip(v.s1 / v.boundary1, -1, 1) if v.boundary1 else np.sign(v.s1)
        sat2 = np.clip(v.s2 / v.boundary2, -1, 1) if v.boundary2 else np.sign(v.s2)
        assert rate1 == pytest.approx(-v.epsilon1 * sat1, abs=1e-9)
        assert rate2 == pytest.approx(-v.epsilon2 * sat2, abs=1e-9)


def test_compensation_cancels_coulomb_friction():
    """With friction in the robot and full compensation the same holds above the compensation speed."""
    generator, tried = np.random.default_rng(5), 0
    while tried < 50:
        inputs = moving(generator)
        if min(abs(inputs["left_shaft_speed"]), abs(inputs["right_shaft_speed"])) < 2.0:
            continue
        tried += 1
        v = commanded(**EVEN, rest_time=0.0, supply_voltage=1e3, **inputs)
        _, pitch2, yaw2 = accelerations(v, coulomb=True)
        assert v.c1 * v.pitch_rate + v.c2 * pitch2 == pytest.approx(-30 * np.clip(v.s1 / 3, -1, 1), abs=1e-9)
        assert v.c3 * v.yaw_rate + v.c4 * yaw2 == pytest.approx(-15 * np.clip(v.s2, -1, 1), abs=1e-9)


def test_surfaces():
    v = commanded(**AWAKE, pitch=0.1, pitch_rate=-0.3, pitch_offset=0.02, yaw=0.5, yaw_rate=0.2, yaw_reference=0.8)
    assert v.s1 == pytest.approx(10 * (0.1 - 0.02) - 0.3)
    assert v.s2 == pytest.approx(3 * (0.5 - 0.8) + 0.2)
    assert v.pitch_reference == 0.02


def test_reaching():
    assert [reaching(s, 2.0) for s in (-5.0, -1.0, 0.0, 1.0, 5.0)] == [-1.0, -0.5, 0.0, 0.5, 1.0]
    assert [reaching(s, 0.0) for s in (-1e-9, 0.0, 1e-9)] == [-1.0, 0.0, 1.0]


def test_holding_27_degrees_takes_the_stated_voltage():
    """0.329 N m, hence 1.7 V per motor, keep psi'' = 0 at 27 degrees with free wheels; friction comes on top."""
    v = commanded(**AWAKE, pitch=math.radians(27), epsilon1=0.0)
    torque = v.left_voltage * 2 * v.gear_ratio * v.torque_constant / v.resistance
    assert torque == pytest.approx(0.329, abs=0.0005)
    assert v.left_voltage == v.right_voltage


@pytest.mark.parametrize(
    ("command", "speed", "expected"),
    [
        (1.0, 10.0, 7.223e-4), (-1.0, 10.0, 7.223e-4), (1.0, -10.0, -5.333e-4), (1.0, 1.5, 0.75 * 7.223e-4), (1.0,
        -1.5, -0.75 * 5.333e-4),
        (0.3, 0.5, 7.223e-4), (-0.3, 0.5, -5.333e-4), (0.3, -0.5, 7.223e-4), (0.0, 0.5, 0.0), (1.0, 1.0,
        0.5 * 7.223e-4),
    ],
)  # fmt: skip
def test_friction_voltage(command, speed, expected):
    """Moving: the direction's friction, less below 2 rad/s; at rest (1 rad/s): the commanded direction's, whole."""
    assert friction_voltage(command, speed, 7.223e-4, 5.333e-4, 1.9, 0.0134, 2.0, 1.0) == pytest.approx(
        1.9 / 0.0134 * expected
    )


def test_each_motor_gets_its_own_compensation():
    plain = commanded(rest_time=0.0, compensation=0.0, pitch=0.05, left_shaft_speed=30.0, right_shaft_speed=-30.0)
    for factor in (0.5, 1.0, 2.0):
        v = commanded(rest_time=0.0, compensation=factor, pitch=0.05, left_shaft_speed=30.0, right_shaft_speed=-30.0)
        assert v.left_voltage - plain.left_voltage == pytest.approx(factor * 1.9 / 0.0134 * 7.223e-4)
        assert v.right_voltage - plain.right_voltage == pytest.approx(-factor * 1.9 / 0.0134 * 4.561e-4)


def test_voltages_stay_within_the_supply():
    v = commanded(**AWAKE, pitch=0.5, wheel_rate=60.0)
    assert (v.left_voltage, v.right_voltage) == (12.0, 12.0)
    v = commanded(**AWAKE, pitch=-0.5, wheel_rate=-60.0, supply_voltage=6.0)
    assert (v.left_voltage, v.right_voltage) == (-6.0, -6.0)


def test_a_left_turn_drives_the_right_wheel():
    v = commanded(**AWAKE, yaw_reference=0.2)
    assert v.right_voltage > 0 > v.left_voltage
    assert v.right_voltage == pytest.approx(-v.left_voltage)


def run(v, count, start=0.0):
    for k in range(count):
        CONTROLLER.step(v, start + k * H, H)


@pytest.mark.parametrize("law", [1.0, 2.0])
def test_rest_and_enable(law):
    """No volt and held integrals until the rest is over, and while not enabled; the drive starts at the tick at 1 s."""
    v = started(CONTROLLER, control_law=law, pitch=0.1, speed_loop=1.0, speed_reference=0.05)
    for k in range(199):
        CONTROLLER.step(v, k * H, H)
        assert (v.left_voltage, v.right_voltage, v.speed_integral, v.pitch_integral) == (0.0, 0.0, 0.0, 0.0)
    CONTROLLER.step(v, 199 * H, H)
    assert v.left_voltage > 0
    run(v, 20, 1.0)
    held = v.speed_integral, v.pitch_integral
    assert held[0] > 0
    v.enable = 0.0
    run(v, 20, 1.1)
    assert (v.left_voltage, v.right_voltage) == (0.0, 0.0)
    assert (v.speed_integral, v.pitch_integral) == held
    v.enable = 1.0
    run(v, 1, 1.2)
    assert v.left_voltage > 0


def test_rest_counts_from_the_start_of_the_simulation():
    v = started(CONTROLLER, time=50.0, pitch=0.1)
    run(v, 199, 50.0)
    assert v.left_voltage == 0.0
    run(v, 1, 50.0 + 199 * H)
    assert v.left_voltage > 0.0


def test_holds_between_ticks():
    v = started(CONTROLLER, **AWAKE, pitch=0.1)
    for k in range(4):
        CONTROLLER.step(v, k * 0.001, 0.001)
        assert v.left_voltage == 0.0
    CONTROLLER.step(v, 0.004, 0.001)
    volts = v.left_voltage
    assert volts > 0
    v.pitch = -0.1
    for k in range(5, 9):
        CONTROLLER.step(v, k * 0.001, 0.001)
        assert v.left_voltage == volts
    CONTROLLER.step(v, 0.009, 0.001)
    assert v.left_voltage < 0


def test_pid_equals_a_discrete_system():
    """v = k_p e + k_i h z / (z - 1) e + k_d e', as scipy's difference equation; sums of 400 terms, 1e-12."""
    generator = np.random.default_rng(6)
    error, rate = generator.normal(size=400) * 0.01, generator.normal(size=400) * 0.1
    integrated = signal.lfilter([40.0 * H], [1.0, -1.0], error)
    expected = 25.0 * error + integrated + 1.0 * rate
    v, found = started(CONTROLLER, **AWAKE, control_law=2.0), []
    for k in range(400):
        v.pitch, v.pitch_rate = error[k], rate[k]
        CONTROLLER.step(v, k * H, H)
        assert v.left_voltage == v.right_voltage
        found.append(v.left_voltage)
    assert found == pytest.approx(expected, abs=1e-12)


def test_pid_does_not_wind_up():
    integral, volts = 0.0, 0.0
    for _ in range(1000):
        volts, integral = pid(0.6, 0.0, integral, H, 25.0, 40.0, 1.0, 12.0)
    assert volts == 12.0
    assert 25.0 * 0.6 + 40.0 * integral <= 25.0 * 0.6 + 1e-12
    for _ in range(1000):
        volts, integral = pid(0.1, 0.0, integral, H, 25.0, 40.0, 1.0, 12.0)
    assert volts == 12.0
    assert 2.5 + 40.0 * integral == pytest.approx(12.0, abs=40.0 * 0.1 * H)
    volts, integral = pid(-0.01, 0.0, integral, H, 25.0, 40.0, 1.0, 12.0)
    assert volts < 12.0


def test_speed_loop():
    """psi_ref = 0.25 e + 0.08 I: leaning forward when too slow, within its limit, without wind-up."""
    reference, integral = pitch_reference(0.2, 1.0, H, 0.25, 0.08, 1.0)
    assert (reference, integral) == pytest.approx((0.25 * 0.2 + 0.08 * (1.0 + 0.2 * H), 1.0 + 0.2 * H))
    limit, integral = math.radians(10), 0.0
    for _ in range(2000):
        reference, integral = pitch_reference(1.0, integral, H, 0.25, 0.08, limit)
    assert (reference, integral) == (limit, 0.0)
    reference, _ = pitch_reference(-1.0, integral, H, 0.25, 0.08, limit)
    assert reference == -limit


def test_a_slow_robot_leans_forward():
    v = commanded(**AWAKE, speed_loop=1.0, speed_reference=0.1, wheel_rate=0.0, pitch_offset=0.01)
    assert v.pitch_reference == pytest.approx(0.01 + 0.25 * 0.1 + 0.08 * 0.1 * H)
    off = commanded(**AWAKE, speed_loop=0.0, speed_reference=0.1, pitch_offset=0.01)
    assert off.pitch_reference == 0.01
    moving_on = commanded(**AWAKE, speed_loop=1.0, speed_reference=0.0, wheel_rate=10.0)
    assert moving_on.pitch_reference < 0


def test_initialize_may_be_repeated():
    v = instance(CONTROLLER, pitch=0.2, speed_loop=1.0, control_law=2.0, rest_time=0.0)
    CONTROLLER.initialize(v, 0.0)
    once = dict(vars(v))
    run(v, 20)
    CONTROLLER.initialize(v, 0.0)
    assert vars(v) == once


def test_outputs_declare_no_dependency():
    """Sampled and held: they break the loop controller, motor, plant, sensor, estimator."""
    assert all(v.depends == () for v in CONTROLLER.variables)


def test_a_robot_upside_down_gets_finite_volts():
    for pitch in (math.pi / 2, 2.42, math.pi, -2.42):
        v = commanded(**AWAKE, pitch=pitch)
        assert abs(v.left_voltage) <= 12.0


def test_slopes_of_the_surfaces_must_be_positive():
    assert CONTROLLER.check(instance(CONTROLLER)) == []
    problems = CONTROLLER.check(instance(CONTROLLER, c1=0.0, c3=0.0))
    assert problems == [
        "c1 = 0 1/s must be positive: s1 = 0 is stable only with c1 / c2 > 0",
        "c3 = 0 1/s must be positive: s2 = 0 is stable only with c3 / c4 > 0",
    ]
