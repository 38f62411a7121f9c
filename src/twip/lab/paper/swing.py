"""The robot as a simple pendulum: wheels locked, the body moved along a given path, the encoder as the pitch's truth.

As in section 4 of the paper. The torque that moves the body (a hand's) comes from inverse dynamics. Upright the
pendulum is unstable and no torque given in advance keeps it on a path, so the robot's own motors, controlled by the
PID law with the path as its reference, guide it: the hand's torque includes what they take away.

Source: paper sections 4.1 and 4.4. Angles in rad, forward lean positive.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from matplotlib.axes import Axes

from ...robot import value
from ..drawing import REAL, THIN, label, legend
from .laboratory import Array, Experiment, Laboratory, Run

Motion = Callable[[Array], Array]
RELEASE = 1.0
"""Time in s until which the robot is held, upright."""
SLOW, SLOW_FREQUENCY, SLOW_AMPLITUDE = (2.0, 10.0), 0.2, np.radians(20.0)
FAST, FAST_FREQUENCY, FAST_AMPLITUDE = (12.5, 16.5), 3.0, np.radians(12.0)
"""Interval in s in which a motion is judged, frequency in Hz, amplitude in rad."""
STOP = 16.5
GAIN, DAMPING = 25.0, 1.0
"""Gains of the PID law that guides the body, in V/rad and V.s/rad; its integral part is off."""
GUIDED = {
    "plant.pitch_start": 0.0,
    "plant.wheels_locked": 1.0,
    "controller.control_law": 2,
    "controller.speed_loop": 0,
    "controller.compensation": 0.0,
    "controller.proportional_gain": GAIN,
    "controller.integral_gain": 0.0,
    "controller.derivative_gain": DAMPING,
}
PRINTED_SIGNS = {
    "estimator.sensor_elevation": -value("sensor_elevation"),
    "estimator.kalman_measurement_noise": 10.0,
    "imu.gyro_bias": 0.0,
}
"""Both terms with sin of eqs (43) and (44) with the sign that is printed: the same as an angle of the other sign.

The Kalman filter, whose measurement is then useless, follows the gyro alone, and that has no bias: the body is guided
by its estimate and shall move as it does with the right signs.
"""


def smooth_step(times: Array, begin: float, duration: float) -> Array:
    """Return a step from 0 to 1 that begins at `begin` and takes `duration` s, with continuous acceleration."""
    share = np.clip((times - begin) / duration, 0.0, 1.0)
    return np.asarray(share**3 * (10.0 - 15.0 * share + 6.0 * share**2))


def slow_then_fast(times: Array) -> Array:
    """Return the pitch of Figs 7 and 10 to 12: slow swings, a short rest, fast swings."""
    slow = SLOW_AMPLITUDE * np.sin(2.0 * np.pi * SLOW_FREQUENCY * (times - RELEASE))
    fast = FAST_AMPLITUDE * np.sin(2.0 * np.pi * FAST_FREQUENCY * (times - SLOW[1] - 1.5))
    until = smooth_step(times, RELEASE, 1.0) - smooth_step(times, SLOW[1], 1.0)
    return np.asarray(until * slow + smooth_step(times, SLOW[1] + 1.5, 1.0) * fast)


def hand_torque(times: Array, path: Motion) -> Array:
    """Return the torque [N.m] on the body that moves it along a path while the motors guide it.

        T = (M L^2 + J_psi + 2 n^2 J_m) psi'' + n (T_cl + T_cr) sgn(psi') + n^2 (sigma_l + sigma_r) psi'
            + 2 n K_t (n K_b psi' + k_d psi') / R_m - M g L sin(psi)

    Row 2 of the equations of motion with the wheels at rest, and the motors at the voltage k_d psi' that the PID law
    commands on the path. Leaning forward turns the shafts in reverse relative to the body, which decides the friction
    coefficients. Neglected: the motors' inductance, the delay of the sampled voltage.
    """
    step = 1e-4
    ahead, here, behind = path(times + step), path(times), path(times - step)
    rate, acceleration = (ahead - behind) / (2.0 * step), (ahead - 2.0 * here + behind) / step**2
    n, first_moment = value("gear_ratio"), value("body_mass") * value("cog_height")
    inertia = first_moment * value("cog_height") + value("body_pitch_inertia")
    inertia += 2.0 * n * n * (value("rotor_inertia") + value("gear_inertia"))
    coulomb = {way: n * sum(value(f"{side}.coulomb_{way}") for side in ("left", "right")) for way in WAYS}
    viscous = {way: n * n * sum(value(f"{side}.viscous_{way}") for side in ("left", "right")) for way in WAYS}
    dry = np.where(rate > 1e-3, coulomb["reverse"], np.where(rate < -1e-3, -coulomb["forward"], 0.0))
    damping = 2.0 * n * value("torque_constant") / value("resistance") * (n * value("back_emf_constant") + DAMPING)
    losses = (damping + np.where(rate > 0.0, viscous["reverse"], viscous["forward"])) * rate
    return np.asarray(inertia * acceleration + dry + losses - first_moment * value("gravity") * np.sin(here))


WAYS = ("forward", "reverse")


def swung(laboratory: Laboratory, name: str, path: Motion, stop_time: float, period: float) -> Experiment:
    """Write the input series that moves the body along a path, a row every `period` s, and return the experiment."""
    times = np.round(np.arange(0.0, stop_time + 0.5 * period, period), 9)
    columns = {"time": times, "plant.body_torque": hand_torque(times, path), "controller.pitch_offset": path(times)}
    return Experiment(stop_time, GUIDED, (), laboratory.write_input(name, columns))


def encoder_pitch(run: Run) -> Array:
    """Return the pitch [rad] that the encoders show while the wheels are locked, the mean of both sides.

    A count stands for the angles from itself to the next, so its middle is taken.
    """
    counts = 0.5 * (run["left.encoder_count"] + run["right.encoder_count"]) + 0.5
    return -counts * (2.0 * np.pi / (value("encoder_resolution") * value("gear_ratio")))


def draw_estimates(axes: Axes, part: Run, *estimates: tuple[str, str, str, str]) -> None:
    """Draw the encoder's pitch and estimates of it: each a name, a label, a colour and a line style."""
    axes.plot(part.times, np.degrees(encoder_pitch(part)), label="real (encoder)", **REAL)
    for name, words, color, style in estimates:
        shown = part.degrees(f"estimator.{name}")
        axes.plot(part.times, shown, color=color, linestyle=style, label=words, **THIN)
    label(axes, "pitch [°]")
    legend(axes)


@dataclass(frozen=True)
class Swings:
    """The runs that Figs 7, 10, 11 and 12 share, at the estimator's samples."""

    experiment: Experiment
    runs: tuple[Run, ...]

    def errors(self, name: str, interval: tuple[float, float]) -> list[float]:
        """Return, for each run, the rms difference in degrees between an estimate and the encoder's pitch."""
        return [error(run, name, interval) for run in self.runs]


def error(run: Run, name: str, interval: tuple[float, float]) -> float:
    """Return the rms difference in degrees between an estimate and the encoder's pitch in an interval [s]."""
    part = run.during(*interval)
    return float(np.degrees(np.sqrt(np.mean((part[f"estimator.{name}"] - encoder_pitch(part)) ** 2))))


@lru_cache(maxsize=1)
def swings(laboratory: Laboratory) -> Swings:
    """Swing the body slowly, then fast, once per seed."""
    experiment = swung(laboratory, "swing.csv", slow_then_fast, STOP, 0.005)
    return Swings(experiment, tuple(run.sampled() for run in laboratory.runs(experiment)))
