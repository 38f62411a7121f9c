"""The robot's mechanics and its inertial sensor against MuJoCo, a multibody engine that shares no code with them.

MuJoCo gets bodies, joints and places, never an equation of ours. Its own contacts are soft, so an ideally rolling wheel
is put on top of it: from its mass matrix and bias forces the motions are kept that let no contact point slip.
"""

import math
from importlib import import_module
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from plain import load, nominal_friction, started

from twip.robot.parameters import value

pytestmark = pytest.mark.foreign

PLANT, IMU = load("plant").BLOCK, load("imu").BLOCK
SHARED = (
    "gravity", "gear_ratio", "wheel_radius", "wheel_mass", "wheel_inertia", "rotor_inertia", "gear_inertia",
    "track_width", "body_mass", "cog_height", "body_pitch_inertia", "body_yaw_inertia", "push_height",
)  # fmt: skip
MODEL = """
<mujoco>
  <compiler angle="radian"/>
  <option gravity="{gravity}" timestep="{timestep}" cone="elliptic" impratio="100"/>
  <worldbody>
    {ground}
    <body name="body" pos="0 0 {height}">
      {joints}
      <inertial pos="0 0 {length}" mass="{mass}" diaginertia="{across} {pitch} {across}"/>
      <site name="sensor" pos="{sensor_x} 0 {sensor_z}"/>
      <body name="left" pos="0 {half} 0">
        <joint name="left" type="hinge" axis="0 1 0" armature="{armature}"/>
        <inertial pos="0 0 0" mass="{wheel}" diaginertia="{diameter} {axle} {diameter}"/>
        {wheel_geometry}
      </body>
      <body name="right" pos="0 -{half} 0">
        <joint name="right" type="hinge" axis="0 1 0" armature="{armature}"/>
        <inertial pos="0 0 0" mass="{wheel}" diaginertia="{diameter} {axle} {diameter}"/>
        {wheel_geometry}
      </body>
    </body>
  </worldbody>
  <sensor><accelerometer site="sensor"/><gyro site="sensor"/></sensor>
</mujoco>
"""
JOINTS = """<joint name="x" type="slide" axis="1 0 0"/>
      <joint name="y" type="slide" axis="0 1 0"/>
      <joint name="yaw" type="hinge" axis="0 0 1"/>
      <joint name="pitch" type="hinge" axis="0 1 0"/>"""

Array = NDArray[np.float64]


@pytest.fixture(scope="module")
def mujoco() -> Any:
    """MuJoCo comes with the extra `foreign`: only these tests need it."""
    return import_module("mujoco")


class RollingRobot:
    """The robot in MuJoCo, its motion described by the rates u = (theta', psi', phi') of an ideally rolling robot.

    Coordinates are x, y, yaw, pitch and both shaft angles at the wheels, relative to the body. The wheels' inertia
    about their diameters, 0.6 J_w each, is part of `body_yaw_inertia`; rotor and gear are an armature of the joints.
    """

    def __init__(self, mujoco: Any, v: Any, **model: Any):
        self.mujoco, self.v = mujoco, v
        self.a = v.track_width / (2 * v.wheel_radius)
        angle = value("sensor_elevation")
        options = {
            "joints": JOINTS, "ground": "", "wheel_geometry": "", "timestep": 1e-3,
            "gravity": f"{-v.gravity * math.sin(v.slope)} 0 {-v.gravity * math.cos(v.slope)}",
        }  # fmt: skip
        text = MODEL.format(
            **(options | model), height=v.wheel_radius, length=v.cog_height, mass=v.body_mass, wheel=v.wheel_mass,
            across=v.body_yaw_inertia - 1.2 * v.wheel_inertia, pitch=v.body_pitch_inertia, half=v.track_width / 2,
            sensor_x=value("sensor_distance") * math.cos(angle), sensor_z=value("sensor_distance") * math.sin(angle),
            armature=v.gear_ratio**2 * (v.rotor_inertia + v.gear_inertia), diameter=0.6 * v.wheel_inertia,
            axle=v.wheel_inertia,
        )  # fmt: skip
        self.model = mujoco.MjModel.from_xml_string(text)
        self.data = mujoco.MjData(self.model)
        self.bodies = {name: self.model.body(name).id for name in ("body", "left", "right")}

    def rolling(self, yaw: float) -> Array:
        """Return N (6, 3) of q' = N u: both wheels roll without slipping along the heading."""
        radius, a = self.v.wheel_radius, self.a
        return np.array([
            [radius * math.cos(yaw), 0, 0], [radius * math.sin(yaw), 0, 0], [0, 0, 1], [0, 1, 0],
            [1, -1, -a], [1, -1, a],
        ])  # fmt: skip

    def place(self, q: Array, u: Array) -> Array:
        """Put MuJoCo into a state and return N."""
        matrix = self.rolling(q[2])
        self.data.qpos[:], self.data.qvel[:], self.data.qfrc_applied[:] = q, matrix @ u, 0.0
        self.mujoco.mj_forward(self.model, self.data)
        return matrix

    def slip(self) -> float:
        """Return the largest speed [m/s] of the wheels' points on the ground."""
        found = 0.0
        for name in ("left", "right"):
            jacobian = np.zeros((3, 6))
            point = self.data.xpos[self.bodies[name]] - (0, 0, self.v.wheel_radius)
            self.mujoco.mj_jac(self.model, self.data, jacobian, None, point, self.bodies[name])
            found = max(found, float(np.max(np.abs(jacobian @ self.data.qvel))))
        return found

    def loads(self, torques: Array, rolling: Array, push: float, body_torque: float) -> Array:
        """Return the generalized forces (6,) of shaft torques [N.m] and of what acts on the bodies from outside."""
        applied = np.zeros(6)
        applied[4:] = self.v.gear_ratio * torques
        yaw, pitch = self.data.qpos[2], self.data.qpos[3]
        heading, left = (math.cos(yaw), math.sin(yaw), 0.0), np.array([-math.sin(yaw), math.cos(yaw), 0.0])
        axle = self.data.xpos[self.bodies["body"]]
        lean = np.array([math.sin(pitch) * heading[0], math.sin(pitch) * heading[1], math.cos(pitch)])
        grip = axle + self.v.push_height * lean
        along = np.array(heading) * math.cos(self.v.slope) - (0, 0, math.sin(self.v.slope))  # horizontal on a slope

        def act(force: Array, torque: Array, point: Array, body: str) -> None:
            self.mujoco.mj_applyFT(self.model, self.data, force, torque, point, self.bodies[body], applied)

        act(push * along, body_torque * left, grip, "body")
        for name, torque in zip(("left", "right"), rolling, strict=True):
            act(np.zeros(3), torque * left, self.data.xpos[self.bodies[name]], name)
        return applied

    def accelerations(self, q: Array, u: Array, **loads: Any) -> Array:
        """Return u' (3,): N' (M (N u' + N' u) + bias - loads) = 0, the reactions of the ground do no work on N."""
        matrix = self.place(q, u)
        applied = self.loads(**loads)
        mass = np.zeros((6, 6))
        for i, column in enumerate(np.eye(6)):
            self.mujoco.mj_mulM(self.model, self.data, mass[i], column)
        turning = np.zeros(6)
        turning[:2] = self.v.wheel_radius * u[0] * u[2] * np.array([-math.sin(q[2]), math.cos(q[2])])
        right = matrix.T @ (applied - self.data.qfrc_bias - mass @ turning)
        result = np.linalg.solve(matrix.T @ mass @ matrix, right)
        # with the ground's reactions among the applied forces MuJoCo moves, and senses, like the rolling robot
        self.data.qfrc_applied[:] = mass @ (matrix @ result + turning) + self.data.qfrc_bias
        self.mujoco.mj_forward(self.model, self.data)
        return result


def coordinates(v: Any) -> tuple[Array, Array]:
    """Return MuJoCo's coordinates (6,) and the rates u (3,) of a plant."""
    shafts = [v.left_shaft_angle / v.gear_ratio, v.right_shaft_angle / v.gear_ratio]
    lean = v.pitch + v.slope  # MuJoCo's axes lie along the slope
    return np.array([v.x, v.y, v.yaw, lean, *shafts]), np.array([v.wheel_rate, v.pitch_rate, v.yaw_rate])


def acting(v: Any) -> dict[str, Any]:
    """Return the loads of a plant that slides everywhere: drives with friction, rolling resistance, push and torque."""
    friction = np.array([v.left_friction_torque, v.right_friction_torque])
    return {
        "torques": np.array([v.left_drive_torque, v.right_drive_torque]) + friction,
        "rolling": np.array([v.left_rolling_torque, v.right_rolling_torque]),
        "push": v.push_force, "body_torque": v.body_torque,
    }  # fmt: skip


def random_robot(seed: int, **values: float) -> Any:
    """Return a plant with random parameters (half to twice nominal), state, torques, push and friction."""
    draw = np.random.default_rng(seed)
    parameters = {name: draw.uniform(0.5, 2.0) * value(name) for name in SHARED}
    # a rigid body's inertias obey a triangle inequality, which MuJoCo checks
    parameters["body_yaw_inertia"] = draw.uniform(0.8, 2.0) * value("body_yaw_inertia")
    parameters["body_pitch_inertia"] = draw.uniform(0.5, 0.95) * value("body_pitch_inertia")
    motion = {
        "pitch_start": draw.uniform(-1.5, 1.5), "pitch_rate_start": draw.uniform(-5, 5),
        "wheel_angle_start": draw.uniform(-9, 9), "wheel_rate_start": draw.uniform(-30, 30),
        "yaw_start": draw.uniform(-3, 3), "yaw_rate_start": draw.uniform(-5, 5),
        "left_drive_torque": draw.uniform(-0.05, 0.05), "right_drive_torque": draw.uniform(-0.05, 0.05),
        "push_force": draw.uniform(-20, 20), "body_torque": draw.uniform(-1, 1),
    }  # fmt: skip
    return started(PLANT, **(parameters | nominal_friction() | motion | values))


SOLVED = 1e-13
"""Rounding, relative: some hundred operations of 1e-16 each on both sides; 300 draws had at most 7e-15."""


@pytest.mark.parametrize("seed", range(40))
def test_accelerations_while_turning_pitched_with_friction_and_push(mujoco: Any, seed: int) -> None:
    v = random_robot(seed)
    robot = RollingRobot(mujoco, v)
    found = robot.accelerations(*coordinates(v), **acting(v))
    assert robot.slip() < 1e-13  # of contact points that belong to wheel rims of up to 3 m/s
    ours = np.array([v.wheel_acceleration, v.pitch_acceleration, v.yaw_acceleration])
    assert np.max(np.abs(found - ours)) < SOLVED * np.max(np.abs(ours))


@pytest.mark.parametrize("seed", range(10))
def test_accelerations_on_a_slope(mujoco: Any, seed: int) -> None:
    """Straight on, where a slope along the heading and a tilted gravity are the same."""
    v = random_robot(seed, yaw_start=0.0, yaw_rate_start=0.0, slope=0.4 - 0.08 * seed)
    found = RollingRobot(mujoco, v).accelerations(*coordinates(v), **acting(v))
    ours = np.array([v.wheel_acceleration, v.pitch_acceleration])
    assert np.max(np.abs(found[:2] - ours)) < SOLVED * np.max(np.abs(ours))


def sensed(v: Any) -> SimpleNamespace:
    """Return an ideal sensor on the robot."""
    perfect = dict.fromkeys(("gyro_bias", "gyro_yaw_bias", "accel_x_bias", "accel_y_bias", "accel_z_bias"), 0.0)
    motion = {x.attribute: getattr(v, x.attribute) for x in IMU.variables if x.causality == "input"}
    robot = {"gravity": v.gravity, "wheel_radius": v.wheel_radius}
    sensor: SimpleNamespace = started(IMU, noise=0.0, quantization=0.0, **perfect, **motion, **robot)
    return sensor


@pytest.mark.parametrize("seed", range(40))
def test_accelerometer_and_gyros(mujoco: Any, seed: int) -> None:
    """All three axes, with the terms of the yaw rate and of its acceleration."""
    v = random_robot(seed)
    robot = RollingRobot(mujoco, v)
    robot.accelerations(*coordinates(v), **acting(v))
    sensor, theirs = sensed(v), robot.data.sensordata
    force = np.array([sensor.accel_x, sensor.accel_y, sensor.accel_z])
    assert np.max(np.abs(theirs[:3] - force)) < SOLVED * (np.max(np.abs(force)) + 1.0)
    assert theirs[4] == pytest.approx(sensor.gyro, abs=1e-13)
    assert theirs[5] == pytest.approx(sensor.gyro_yaw, abs=1e-13)


def test_turning_on_the_spot_shifts_the_accelerometers_pitch(mujoco: Any) -> None:
    """At 3 rad/s upright, MuJoCo's accelerometer feels 0.45 m/s2 inwards: 2.6 deg, the magnitude up by 0.1 %."""
    v = started(PLANT, yaw_rate_start=3.0, rolling_resistance=0.0)
    robot = RollingRobot(mujoco, v)
    robot.accelerations(*coordinates(v), **acting(v))
    x, _, z = robot.data.sensordata[:3]
    assert x == pytest.approx(-9.0 * 0.1 * math.cos(math.radians(60)), abs=1e-12)
    assert math.degrees(math.atan2(-x, z)) == pytest.approx(2.6, abs=0.05)
    assert math.hypot(x, z) / 9.81 == pytest.approx(1.001, abs=1e-4)


def test_the_printed_equations_differ_from_it(mujoco: Any) -> None:
    """Eqs (30) and (32) lack M L R phi'^2 sin psi and M L R theta' phi' sin psi.

    At 30 deg, 1 m/s and 2 rad/s that is 0.0155 N.m on the wheels and 0.155 N.m on the yaw: 1.4 and 13 rad/s2.
    """
    v = started(PLANT, pitch_start=math.radians(30), wheel_rate_start=20.0, yaw_rate_start=2.0, rolling_resistance=0.0)
    found = RollingRobot(mujoco, v).accelerations(*coordinates(v), **acting(v))
    term = v.body_mass * v.cog_height * v.wheel_radius * math.sin(v.pitch)
    rotors = 2 * v.gear_ratio**2 * (v.rotor_inertia + v.gear_inertia)
    radius, length, a = v.wheel_radius, v.cog_height, v.track_width / (2 * v.wheel_radius)
    m22 = (2 * v.wheel_mass + v.body_mass) * radius**2 + 2 * v.wheel_inertia + rotors
    m24 = v.body_mass * length * radius * math.cos(v.pitch) - rotors
    m44 = v.body_mass * length**2 + v.body_pitch_inertia + rotors
    lean = v.body_mass * length**2 * math.sin(v.pitch)
    m66 = 0.5 * v.wheel_mass * v.track_width**2 + v.body_yaw_inertia + a * a * (2 * v.wheel_inertia + rotors)
    m66 += lean * math.sin(v.pitch)
    on_pitch = v.body_mass * v.gravity * length * math.sin(v.pitch) + lean * math.cos(v.pitch) * v.yaw_rate**2
    printed = np.linalg.solve([[m22, m24], [m24, m44]], [0.0, on_pitch])
    mended = np.linalg.solve([[m22, m24], [m24, m44]], [term * v.yaw_rate**2, on_pitch])
    assert found[:2] == pytest.approx(mended, rel=1e-11)
    assert found[1] - printed[1] == pytest.approx(-1.4, abs=0.05)
    assert found[2] == pytest.approx(-13.2, abs=0.1)
    assert found[2] == pytest.approx(-term * v.wheel_rate * v.yaw_rate / m66, rel=1e-11)  # printed: 0


def torques(wheel_rate: float, pitch: float, pitch_rate: float, yaw: float, yaw_rate: float, time: float) -> Array:
    """Return the shaft torques [N.m] of a law that keeps 10 deg of lean while it turns left and right."""
    common = 0.15 * (pitch - math.radians(10)) + 0.015 * pitch_rate + 0.0002 * wheel_rate
    turn = 0.004 * (2.5 * math.sin(2 * math.pi * time) - yaw_rate)
    return np.array([common - turn, common + turn])


def ours(v: Any, duration: float, driven: bool, step: float = 1e-3) -> Array:
    """Return x, y, yaw, pitch (rows, 4) of the plant after each step, the torques held over a step."""
    rows = []
    for k in range(round(duration / step)):
        if driven:
            v.left_drive_torque, v.right_drive_torque = torques(
                v.wheel_rate, v.pitch, v.pitch_rate, v.yaw, v.yaw_rate, k * step
            )
        PLANT.step(v, k * step, step)
        rows.append([v.x, v.y, v.yaw, v.pitch])
    return np.array(rows)


def theirs(robot: RollingRobot, duration: float, driven: bool, step: float = 1e-3, parts: int = 2) -> Array:
    """Return the same of MuJoCo by the classical Runge-Kutta rule in `parts` of a step."""
    q, u = coordinates(robot.v)
    quiet = {"rolling": np.zeros(2), "push": 0.0, "body_torque": 0.0}
    rows = []
    for k in range(round(duration / step)):
        shafts = torques(u[0], q[3], u[1], q[2], u[2], k * step) if driven else np.zeros(2)

        def slope(state: Array, shafts: Array = shafts) -> Array:
            acceleration = robot.accelerations(state[:6], state[6:], torques=shafts, **quiet)
            return np.concatenate([robot.rolling(state[2]) @ state[6:], acceleration])

        state, h = np.concatenate([q, u]), step / parts
        for _ in range(parts):
            k1 = slope(state)
            k2 = slope(state + h / 2 * k1)
            k3 = slope(state + h / 2 * k2)
            k4 = slope(state + h * k3)
            state = state + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        q, u = state[:6], state[6:]
        rows.append(q[:4])
    return np.array(rows)


FALL = {"pitch_start": math.radians(5), "wheel_rate_start": 5.0, "yaw_rate_start": 1.0}
DRIVE = {"pitch_start": math.radians(20), "yaw_rate_start": 1.0}


@pytest.mark.parametrize(("start", "duration", "driven"), [(FALL, 0.5, False), (DRIVE, 1.5, True)])
def test_motion_free_and_driven(mujoco: Any, start: dict[str, float], duration: float, driven: bool) -> None:
    """A fall from 5 deg, and a drive with turns while pitched.

    The plant's rule is of second order: with a fifth of its inner step the difference must be a 25th, up to the
    Runge-Kutta rule's own, below 4e-10 here. At the default step it is 1e-6 rad, in a fall of 277 deg.
    """
    nominal = started(PLANT, rolling_resistance=0.0, **start)
    truth = theirs(RollingRobot(mujoco, nominal), duration, driven)
    errors = []
    for inner_step in (2.5e-4, 5e-5):
        v = started(PLANT, rolling_resistance=0.0, inner_step=inner_step, **start)
        errors.append(np.max(np.abs(ours(v, duration, driven) - truth), axis=0))
    assert np.max(errors[0]) < 3e-6
    assert errors[0] / errors[1] == pytest.approx([25.0] * 4, rel=0.2)
    assert np.ptp(truth[:, 3]) > math.radians(10)
    assert np.ptp(truth[:, 2]) > 0.3


CONTACT = 'condim="3" friction="2 0 0" solref="0.001 1" solimp="0.99 0.9999 0.0001"'


def on_contacts(mujoco: Any, v: Any, duration: float, driven: bool, step: float = 1e-3, parts: int = 20) -> Array:
    """Return x, y, yaw, pitch (rows, 4) of a free body with two wheels on MuJoCo's ground, by its own steps."""
    robot = RollingRobot(
        mujoco, v, joints="<freejoint/>", timestep=step / parts, ground=f'<geom type="plane" size="9 9 1" {CONTACT}/>',
        wheel_geometry=f'<geom type="sphere" size="{v.wheel_radius}" mass="0" {CONTACT}/>',
    )  # fmt: skip
    data, ratio = robot.data, v.gear_ratio
    data.qpos[3:7] = math.cos(v.pitch / 2), 0.0, math.sin(v.pitch / 2), 0.0
    data.qvel[0] = v.wheel_radius * v.wheel_rate
    # angular velocity in the body's axes
    data.qvel[3:6] = -math.sin(v.pitch) * v.yaw_rate, v.pitch_rate, math.cos(v.pitch) * v.yaw_rate
    data.qvel[6:] = v.left_shaft_speed / ratio, v.right_shaft_speed / ratio
    rows, yaw = [], 0.0
    for k in range(round(duration / step)):
        mujoco.mj_forward(robot.model, data)
        turn = data.xmat[robot.bodies["body"]].reshape(3, 3)
        pitch = math.atan2(turn[0, 2] * turn[1, 1] - turn[1, 2] * turn[0, 1], turn[2, 2])
        yaw = math.atan2(-turn[0, 1], turn[1, 1])
        world = turn @ data.qvel[3:6]
        pitch_rate = -math.sin(yaw) * world[0] + math.cos(yaw) * world[1]
        wheel_rate = pitch_rate + 0.5 * (data.qvel[6] + data.qvel[7])
        if k:
            rows.append([*data.xpos[robot.bodies["body"]][:2], yaw, pitch])
        if driven:
            data.qfrc_applied[6:] = ratio * torques(wheel_rate, pitch, pitch_rate, yaw, world[2], k * step)
        for _ in range(parts):
            mujoco.mj_step(robot.model, data)
    return np.array(rows)


@pytest.mark.parametrize(("start", "duration", "driven"), [(FALL, 0.4, False), (DRIVE, 1.0, True)])
def test_motion_on_contacts_of_its_own(mujoco: Any, start: dict[str, float], duration: float, driven: bool) -> None:
    """A free robot on MuJoCo's ground: nothing of rolling is told to it, contacts with friction make it roll.

    Its steps of 50 us are of first order and its contacts creep: 0.3 mm and 0.04 deg, thrice that is allowed.
    """
    v = started(PLANT, rolling_resistance=0.0, **start)
    truth = on_contacts(mujoco, v, duration, driven)
    difference = np.max(np.abs(ours(v, duration, driven)[: len(truth)] - truth), axis=0)
    assert np.max(difference[:2]) < 1e-3
    assert np.max(difference[2:]) < math.radians(0.12)
