"""The stand-ups that Figs 14 and 15 share: pitch-only law, with and without friction compensation."""

from collections.abc import Mapping
from functools import lru_cache

import numpy as np

from .laboratory import Array, Experiment, Laboratory, Run

RELEASE = 1.0
"""Time in s until which the robot is held and the drive is off."""
END = RELEASE + 5.0
STEADY = (RELEASE + 2.0, END)
"""Interval in s of the steady state: the pitch is constant, the robot accelerates."""
PITCH_ONLY = {"controller.speed_loop": 0}
"""The paper's law: nothing is said of the speed."""


def stand_up(angle: float, compensation: bool, **more: float) -> Experiment:
    """Return a stand-up from an angle in degrees under the pitch-only law; `more` are controller parameters."""
    start: Mapping[str, float] = {"plant.pitch_start": np.radians(angle), **PITCH_ONLY}
    extra = {f"controller.{name}": value for name, value in more.items()}
    return Experiment(END, {**start, **extra}, () if compensation else ("no_compensation",))


@lru_cache(maxsize=4)
def stand_ups(laboratory: Laboratory, angle: float, compensation: bool) -> tuple[Run, ...]:
    """Repeat a stand-up once per seed."""
    return tuple(laboratory.runs(stand_up(angle, compensation)))


def steady_pitch(run: Run) -> float:
    """Return the mean pitch in degrees in the steady state."""
    return float(np.mean(run.during(*STEADY).degrees("plant.pitch")))


def voltage(run: Run) -> Array:
    """Return the larger magnitude of both motor voltages in V."""
    return np.maximum(np.abs(run["controller.left.voltage"]), np.abs(run["controller.right.voltage"]))
