"""The whole robot in plain Python, wired by hand, against the numbers of the prototype (paper, Figs 13 to 19)."""

import math
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np
import pytest
from plain import instance, load

BLOCKS = {name: load(name).BLOCK for name in ("motor", "plant", "imu", "estimator", "controller")}
H = 1e-3
RELEASE = 1.0
"""End of the rest: the robot is let go and the drive is enabled, s."""

LIMITS = (
    "coulomb_forward_limit",
    "coulomb_reverse_limit",
    "static_forward_limit",
    "static_reverse_limit",
    "stribeck_speed_limit",
)
SENSED = ("pitch", "pitch_rate", "pitch_acceleration", "wheel_rate", "wheel_acceleration", "yaw_rate",
"yaw_acceleration",
          "ground_slope", "ground_slope_rate")  # fmt: skip
ESTIMATED = ("pitch", "pitch_rate", "wheel_rate", "yaw", "yaw_rate", "left_shaft_speed", "right_shaft_speed")
FRICTION = (
    "coulomb_forward",
    "coulomb_reverse",
    "static_forward",
    "static_reverse",
    "viscous_forward",
    "viscous_reverse",
)
RECORDED = ("plant.pitch", "plant.yaw", "plant.x", "plant.wheel_rate", "plant.fallen", "estimator.pitch",
"controller.left_voltage",
            "controller.right_voltage", "controller.pitch_reference")  # fmt: skip


@dataclass
class Robot:
    """Six instances in the order of their evaluation: motors, plant, sensor, estimator, controller."""

    parameters: dict[str, dict[str, float]] = field(default_factory=dict)

    def __post_init__(self):
        def made(name: str, block: str, **values: float) -> Any:
            return instance(BLOCKS[block], **{**values, **self.parameters.get(name, {})})

        controller = BLOCKS["controller"]
        right = {n: v.start for v in controller.variables for n in FRICTION if v.name == f"right.{n}"}
        right |= {"static_forward": right["coulomb_forward"], "static_reverse": right["coulomb_reverse"]}
        self.left, self.right = made("left", "motor"), made("right", "motor", **right)
        self.plant = made("plant", "plant", pitch_start=math.radians(27), hold_time=RELEASE)
        self.imu, self.estimator, self.controller = (made(n, n) for n in ("imu", "estimator", "controller"))
        self.order = [("motor", self.left), ("motor", self.right), ("plant", self.plant), ("imu", self.imu),
                      ("estimator", self.estimator), ("controller", self.controller)]  # fmt: skip
        wires = [(self.plant, n, self.imu, n) for n in SENSED]
        wires += [(self.imu, n, self.estimator, n) for n in ("gyro", "accel_x", "accel_z")]
        wires += [(self.estimator, n, self.controller, n) for n in ESTIMATED]
        for side, motor in (("left", self.left), ("right", self.right)):
            wires += [(self.controller, f"{side}_voltage", motor, "voltage")]
            wires += [(self.plant, f"{side}_{n}", motor, n) for n in ("shaft_speed", "shaft_angle")]
            wires += [(motor, n, self.plant, f"{side}_{n}") for n in ("drive_torque", *LIMITS)]
            wires += [(motor, "encoder_count", self.estimator, f"{side}_encoder_count")]
        self.into = {id(v): [(a, n, m) for a, n, b, m in wires if b is v] for _, v in self.order}
        for _ in range(
            4
        ):  # the longest way from a block to another without a step is plant, imu, estimator, controller
            for name, v in self.order:
                self.feed(v)
                BLOCKS[name].initialize(v, 0.0)

    def feed(self, v: Any) -> None:
        for source, name, target in self.into[id(v)]:
            setattr(v, target, getattr(source, name))

    def run(self, duration: float, inputs: Any = None) -> dict[str, np.ndarray]:
        """Return the signals after each 1 ms step; `inputs(robot, time)` may set open inputs."""
        rows = []
        blocks = [(BLOCKS[name].step, v) for name, v in self.order]
        for k in range(round(duration / H)):
            time = k * H
            if inputs is not None:
                inputs(self, time)
            for step, v in blocks:
                self.feed(v)
                step(v, time, H)
            rows.append([getattr(getattr(self, name.split(".")[0]), name.split(".")[1]) for name in RECORDED])
        signals = dict(
            zip(
                (n.split(".", 1)[1] if n != "estimator.pitch" else "estimate" for n in RECORDED),
                np.array(rows).T,
                strict=True,
            )
        )
        signals["time"] = H * np.arange(1, len(rows) + 1)
        return signals


@cache
def stand_up(start: float, seed: int, duration: float = 6.0, **controller: float) -> dict[str, np.ndarray]:
    """Return a stand-up from `start` degrees, sensor noise on."""
    plant = {"pitch_start": math.radians(start), "hold_time": RELEASE}
    return Robot({"plant": plant, "imu": {"seed": seed}, "controller": controller}).run(duration)


def pitch(run: dict[str, np.ndarray], begin: float, end: float) -> np.ndarray:
    """Return the pitch in degrees between two times after the release."""
    return np.degrees(run["pitch"][(run["time"] > RELEASE + begin) & (run["time"] <= RELEASE + end)])


def peak_voltage(run: dict[str, np.ndarray], end: float) -> float:
    chosen = run["time"] <= RELEASE + end
    return max(np.max(np.abs(run[f"{side}_voltage"][chosen])) for side in ("left", "right"))


@pytest.mark.parametrize(("start", "seed"), [(27, 1), (30, 2), (-27, 3)])
def test_stands_up(start, seed):
    """Fig 13: from 27 and 30 degrees, and mirrored, without overshoot.

    Estimator error: 0.63 deg in the prototype; 20 seeds had 0.60 here, of which biases of 5 mg are 0.29 deg.
    """
    run = stand_up(start, seed)
    assert not run["fallen"].any()
    assert np.max(np.abs(pitch(run, 0, 5))) <= abs(start) + 1e-9
    error = np.degrees(run["estimate"] - run["pitch"])[run["time"] > RELEASE]
    assert np.max(np.abs(error)) < 0.63
    if start > 0:
        assert np.min(pitch(run, 0, 5)) > 0


def test_it_rests_until_the_release():
    run = stand_up(27, 1)
    before = run["time"] < RELEASE - 0.5 * H
    assert np.all(run["pitch"][before] == math.radians(27))
    assert np.all(run["left_voltage"][before] == 0.0)
    assert run["left_voltage"][~before][0] > 2.0


def test_steady_pitch_with_and_without_compensation():
    """Fig 14: 1.75 deg with and 4.18 deg without compensation in the prototype.

    The difference is c2 Delta / (k c1) with k = eps1 / Phi1 = 10 and Delta = (M22 + M24) F_c / D = 4.17 rad/s2, that
    is 2.39 deg, plus M21 theta'' T / (k c1) of the sample delay T = 5 ms because the uncompensated robot gains speed
    faster, some 0.2 deg. The level itself holds the bias of 5 mg, 0.29 (1 + 161 / 100) deg. 20 seeds spread by 0.08
    deg.
    """
    compensated, bare = stand_up(27, 1), stand_up(27, 1, compensation=0.0)
    level, bare_level = np.mean(pitch(compensated, 3, 5)), np.mean(pitch(bare, 3, 5))
    assert level == pytest.approx(1.75, abs=0.25)
    assert bare_level == pytest.approx(4.18, abs=0.25)
    assert bare_level - level == pytest.approx(2.39 + 0.1, abs=0.15)
    # It is an accelerating robot: 4.0 m and 6.8 m in 5 s in the prototype. 0.1 deg of pitch bias is 0.13 m.
    assert compensated["x"][-1] == pytest.approx(4.0, abs=0.5)
    assert bare["x"][-1] == pytest.approx(6.8, abs=0.5)
    # Fig 15: 3.0 to 3.8 V with, 4.8 to 7.0 V without.
    assert 3.0 < peak_voltage(compensated, 3) < 3.8
    assert 4.8 < peak_voltage(bare, 3) < 7.0


@pytest.mark.parametrize("seed", [1, 4, 15])
def test_stays_in_place_with_the_velocity_loop(seed):
    """The demonstration: |pitch| below 1 deg from 3 s after the release on, in place; 20 seeds had at most 0.78 deg."""
    run = stand_up(27, seed, 10.0, speed_loop=1.0)
    assert not run["fallen"].any()
    assert np.max(np.abs(pitch(run, 3, 9))) < 1.0
    late = run["time"] > RELEASE + 6
    assert np.max(np.abs(run["wheel_rate"][late])) * 0.05 < 0.1
    assert np.ptp(run["x"][late]) < 0.2


def test_an_overcompensated_robot_rocks():
    """Twice the friction drives the robot against itself: a limit cycle of 2.4 deg in the prototype."""
    run = stand_up(10, 1, compensation=2.0)
    assert np.ptp(pitch(run, 3, 5)) > 0.8
    assert np.ptp(pitch(stand_up(10, 1), 3, 5)) < 0.2


def test_pid_overshoots_more_from_a_larger_pitch():
    """Fig 16: 0.47 to 1.02 deg tuned, 1.88 to 4.53 deg detuned, sliding mode none; from the final pitch on."""

    def overshoot(start, **controller):
        run = stand_up(start, 1, 4.0, **controller)
        assert not run["fallen"].any()
        return np.mean(pitch(run, 2.5, 3)) - np.min(pitch(run, 0, 3))

    tuned = [overshoot(start, control_law=2.0) for start in (10, 30)]
    detuned = [overshoot(start, control_law=2.0, integral_gain=100.0, derivative_gain=0.6) for start in (10, 30)]
    sliding = [overshoot(start) for start in (10, 30)]
    assert 0.2 < tuned[0] < tuned[1] < 1.2
    assert 1.0 < detuned[0] < detuned[1] < 5.0
    assert max(sliding) < 0.1  # the ripple of the noise


def test_the_literal_sign_law_stands_and_chatters():
    """Phi = 0: hardly a steady error, but a voltage that jumps at every sample; smooth with the boundary layer."""
    literal = stand_up(27, 1, boundary1=0.0, boundary2=0.0)
    assert not literal["fallen"].any()
    assert abs(np.mean(pitch(literal, 3, 5))) < 0.75  # the bias of 5 mg and what the chatter does to the estimate

    def jumps(run):
        return np.std(np.diff(run["left_voltage"][run["time"] > RELEASE + 3][::5]))

    assert jumps(literal) > 0.8
    assert jumps(stand_up(27, 1)) < 0.1


def test_turns_by_90_degrees():
    """Fig 19: 90.01 deg, 90 % in 1.1 s, pitch within 0.87 deg (2.72 deg without compensation) in the prototype.

    That run lacked the yaw terms in the sensor; with them and noise 0.96 deg.
    """

    def turn(robot, time):
        robot.controller.yaw_reference = math.pi / 2 if time >= 2.0 - 1e-9 else 0.0

    runs = {}
    for compensation in (1.0, 0.0):
        robot = Robot({"plant": {"pitch_start": 0.0}, "controller": {"speed_loop": 1.0, "compensation": compensation}})
        runs[compensation] = robot.run(6.0, turn)
    yaw = np.degrees(runs[1.0]["yaw"])
    assert yaw[-1] == pytest.approx(90.0, abs=0.2)
    assert np.max(yaw) < 90.5
    assert runs[1.0]["time"][np.argmax(yaw > 81.0)] - 2.0 == pytest.approx(1.1, abs=0.1)
    largest = {c: np.max(np.abs(np.degrees(run["pitch"][run["time"] > 2.0]))) for c, run in runs.items()}
    assert largest[1.0] < 1.1
    assert largest[0.0] > 1.5 * largest[1.0]


def test_an_offset_sets_the_acceleration():
    """Fig 18: 0.22, 0.33 and 0.43 m/s2 for 1, 2 and 3 deg: 0.105 m/s2 per degree, on the level of the bias."""
    found = []
    for degrees in (1.0, 3.0):

        def offset(robot, time, degrees=degrees):
            robot.controller.pitch_offset = math.radians(degrees) if time >= RELEASE - 1e-9 else 0.0

        run = Robot({"plant": {"pitch_start": 0.0}}).run(4.0, offset)
        speed = run["wheel_rate"] * 0.05
        found.append((speed[-1] - speed[-1501]) / 1.5)
    assert (found[1] - found[0]) / 2 == pytest.approx(0.105, abs=0.01)
    assert found[0] == pytest.approx(0.22, abs=0.04)


def test_the_robot_stands_with_other_sample_times():
    """2 to 20 ms stood in the prototype."""
    for sample_time in (0.002, 0.02):
        sampled = {name: {"sample_time": sample_time} for name in ("imu", "estimator", "controller")}
        sampled["controller"]["speed_loop"] = 1.0
        run = Robot(sampled).run(5.0)
        assert not run["fallen"].any()
        assert np.max(np.abs(pitch(run, 3, 4))) < 2.0
