"""The robot in 3D for viewers, as channels beside the signals of a log: poses on `/tf` and a URDF of its shapes.

    world (z up) ── base (axle's middle; yaw) ── body (pitch) ── left_wheel, right_wheel (shaft angle / gear ratio)

The floor is drawn level: a slope turns no frame.
"""

from collections.abc import Mapping, Sequence

from ...cosim.log_extra import ExtraChannel
from ...cosim.record import Channel, columns
from ..run_parameters import number
from .text import TextChannel
from .transforms import Column, Frame, TransformChannel
from .urdf import Shape, urdf

RATE = 100.0
"""Poses per second."""
SIGNALS = ("plant.x", "plant.y", "plant.yaw", "plant.pitch", "plant.left.shaft_angle", "plant.right.shaft_angle")


def scene(channels: Sequence[Channel], metadata: Mapping[str, Mapping[str, str]]) -> list[ExtraChannel]:
    """Return what shows the robot to whoever reads a log with these channels, nothing if they are not the robot's.

    `metadata` as `System.provenance` gives it holds the parameters that the run has.
    """
    names = columns(channels)
    if any(name not in names for name in SIGNALS):
        return []
    x, y, yaw, pitch, left, right = (names.index(name) for name in SIGNALS)
    gear = number(metadata, "plant", "gear_ratio")
    radius, track = number(metadata, "plant", "wheel_radius"), number(metadata, "plant", "track_width")

    def wheel(name: str, angle: int, y: float) -> Frame:
        return Frame("body", name, "y", Column(angle, 1.0 / gear), (0.0, y, 0.0))

    frames = (
        Frame("world", "base", "z", Column(yaw), (Column(x), Column(y), radius)),
        Frame("base", "body", "y", Column(pitch)),
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
    return [TransformChannel(frames, RATE), TextChannel("/robot_description", urdf(shape))]
