"""A small log with the robot's signals, made up: the pitch is a known function of time."""

from math import radians

import numpy as np

from twip.cosim.log.playback import read
from twip.cosim.model.signals import Channel, Signal
from twip.cosim.sinks.mcap_log import McapLog
from twip.lab.metrics import BLOCKS, REQUIRED

UNITS = {
    "pitch": "rad", "yaw": "rad", "x": "m", "y": "m", "voltage": "V", "current": "A", "wheel_angle": "rad",
    "speed_reference": "m/s", "push_force": "N", "s1": "rad/s", "s2": "rad/s",
}  # fmt: skip
METADATA = {
    "system": {"name": "twip"},
    "start values plant": {"wheel_radius": "0.06", "body_mass": "2.0", "pitch_start": "0.35"},
    "start values left": {"coulomb_forward": "0.0007223", "viscous_forward": "3e-06"},
    "run": {"command": "twip run robot.ssp", "twip": "0.1.0"},
}


def pitch(times):
    """Held for 0.5 s, then falling to upright within some tenths of a second."""
    return radians(20.0) * np.exp(-np.maximum(0.0, times - 0.5) / 0.2)


def columns(times, **given):
    """Return the robot's signals over `times`; `given` replaces some, dots as double underscores."""
    zero = np.zeros_like(times)
    found = dict.fromkeys((*REQUIRED, *BLOCKS), zero)
    lean = pitch(times)
    found |= {
        "plant.pitch": lean,
        "plant.pitch_rate": np.where(times > 0.5, -lean / 0.2, 0.0),
        "estimator.pitch": lean + radians(0.2) * np.sin(40.0 * times),
        "plant.yaw": radians(30.0) * np.sin(times),
        "plant.x": 0.3 * np.sin(2.0 * times),
        "plant.y": 0.1 * times,
        "plant.wheel_angle": 5.0 * np.sin(2.0 * times),
        "plant.left.shaft_speed": np.where(times < 0.5, 0.0, np.cos(times)),
        "plant.left.coulomb_forward_limit": zero + 7e-4,
        "plant.left.static_forward_limit": zero + 7e-4,
        "left.voltage": 3.0 * np.sin(5.0 * times),
        "controller.left.voltage": 3.0 * np.sin(5.0 * times),
    }
    return found | {name.replace("__", "."): values for name, values in given.items()}


def write(path, signals, times, metadata=METADATA, causality="output"):
    """Write a log of `signals` (component.variable to values), and return it read back."""
    grouped = {}
    for name in signals:
        component, _, variable = name.partition(".")
        grouped.setdefault(component, []).append(variable)
    channels = [
        Channel(c, tuple(Signal(v, "Real", UNITS.get(v.split(".")[-1]), causality) for v in names))
        for c, names in grouped.items()
    ]
    rows = np.column_stack([signals[f"{c}.{v}"] for c, names in grouped.items() for v in names])
    with McapLog(path, channels, metadata) as log:
        log.write(times, rows)
    return read(path)


def robot_log(path, duration=4.0, rate=1000.0, **given):
    """Write the made-up robot's log, and return it read back."""
    times = np.arange(round(duration * rate) + 1) / rate
    return write(path, columns(times, **given), times)
