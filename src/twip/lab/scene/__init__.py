"""The robot in 3D for viewers, as channels beside the signals of a log: poses on `/tf` and a URDF of its shapes.

    world (z up) ── base (axle's middle; yaw) ── body (pitch) ── left_wheel, right_wheel (shaft angle / gear ratio)

The floor is drawn level: a slope turns no frame.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ...cosim import Channel, columns
from ...cosim.log import ExtraChannel
from ..run_parameters import number
from .text import TextChannel
from .transforms import Column, Frame, TransformChannel
from .urdf import Shape, urdf

RATE = 100.0
"""Poses per second."""
SIGNALS = ("plant.x", "plant.y", "plant.yaw", "plant.pitch", "plant.left.shaft_angle", "plant.right.shaft_angle")


@dataclass(frozen=True)
class One:
    """One of several robots in a scene: `name` is an identifier, it stands `aside` m to the left of where it is."""

    name: str
    aside: float
    color: str
    """Such as `#0072b2`."""


def scene(
    channels: Sequence[Channel], metadata: Mapping[str, Mapping[str, str]], one: One | None = None
) -> list[ExtraChannel]:
    """Return what shows the robot to whoever reads a log with these channels, nothing if they are not the robot's.

    `metadata` as `System.provenance` gives it holds the parameters that the run has. `one` of several robots has topics
    and frames of its own.
    """
    names = columns(channels)
    if any(name not in names for name in SIGNALS):
        return []
    x, y, yaw, pitch, left, right = (names.index(name) for name in SIGNALS)
    gear = number(metadata, "plant", "gear_ratio")
    radius, track = number(metadata, "plant", "wheel_radius"), number(metadata, "plant", "track_width")

    prefix, topic, ground, beside = "", "", "world", list[Frame]()
    if one is not None:
        prefix, topic, ground = f"{one.name}_", f"/{one.name}", f"{one.name}_ground"
        beside.append(Frame("world", ground, "z", Column(x, 0.0), (0.0, one.aside, 0.0)))

    def wheel(name: str, angle: int, y: float) -> Frame:
        return Frame(f"{prefix}body", f"{prefix}{name}", "y", Column(angle, 1.0 / gear), (0.0, y, 0.0))

    frames = (
        *beside,
        Frame(ground, f"{prefix}base", "z", Column(yaw), (Column(x), Column(y), radius)),
        Frame(f"{prefix}base", f"{prefix}body", "y", Column(pitch)),
        wheel("left_wheel", left, track / 2.0),
        wheel("right_wheel", right, -track / 2.0),
    )
    shape = Shape(
        wheel_radius=radius,
        track_width=track,
        body_height=2.0 * number(metadata, "plant", "cog_height"),
        sensor_distance=number(metadata, "imu", "sensor_distance"),
        sensor_elevation=number(metadata, "imu", "sensor_elevation"),
    )
    description = urdf(shape, prefix, None if one is None else one.color)
    return [
        TransformChannel(frames, RATE, f"{topic}/tf"),
        TextChannel(f"{topic}/robot_description", description),
    ]
