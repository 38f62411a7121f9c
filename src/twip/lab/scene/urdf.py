"""The robot's shapes as URDF: boxes and cylinders, sized by its parameters."""

from dataclasses import dataclass
from math import cos, pi, sin

BODY_DEPTH, WHEEL_WIDTH, GAP = 0.07, 0.022, 0.008
"""Sizes that no parameter gives, in m; the gap is between body and wheel."""
COLOURS = {
    "body": "0.35 0.55 0.75 1",
    "head": "0.20 0.35 0.55 1",
    "tyre": "0.32 0.32 0.36 1",
    "hub": "0.85 0.85 0.85 1",
    "sensor": "0.80 0.25 0.30 1",
}


@dataclass(frozen=True)
class Shape:
    """Sizes in m, angle in rad."""

    wheel_radius: float
    track_width: float
    body_height: float
    sensor_distance: float
    sensor_elevation: float


def urdf(shape: Shape, prefix: str = "", color: str | None = None) -> str:
    """Return the robot description; links as the frames of `scene`, x forward, y left, z up.

    One of several robots has a `prefix` before its links, and a `color` such as `#0072b2` of its own.
    """
    width = max(0.02, shape.track_width - WHEEL_WIDTH - 2.0 * GAP)
    height, foot = shape.body_height, 0.1 * shape.body_height
    along, up = (shape.sensor_distance * f(shape.sensor_elevation) for f in (cos, sin))
    body = [
        _box("body", (BODY_DEPTH, width, height - foot), (0.0, 0.0, foot + (height - foot) / 2.0)),
        _box("head", (1.06 * BODY_DEPTH, 0.9 * width, 0.16 * height), (0.0, 0.0, 0.9 * height)),
        _box("sensor", (0.02, 0.02, 0.008), (along, 0.0, up)),
        _cylinder("hub", 0.012, shape.track_width, 0.0),
    ]
    wheel = [
        _cylinder("tyre", shape.wheel_radius, WHEEL_WIDTH, 0.0),
        *(_spoke(shape.wheel_radius, angle) for angle in (0.0, pi / 3.0, 2.0 * pi / 3.0)),
    ]
    colours = COLOURS
    if color is not None:
        own = " ".join(f"{_linear(int(color[i : i + 2], 16) / 255.0):.4f}" for i in (1, 3, 5))
        colours = {**COLOURS, **dict.fromkeys(("body", "head", "tyre"), f"{own} 1")}
    links = {name: f"{prefix}{name}" for name in ("base", "body", "left_wheel", "right_wheel")}
    lines = [f'<robot name="{prefix}twip">']
    lines += [f'<material name="{name}"><color rgba="{rgba}"/></material>' for name, rgba in colours.items()]
    lines += [f'<link name="{links["base"]}"/>', _link(links["body"], body)]
    lines += [_link(links["left_wheel"], wheel), _link(links["right_wheel"], wheel)]
    lines.append(_joint(links["base"], links["body"], 0.0))
    half = shape.track_width / 2
    lines += [_joint(links["body"], links[f"{n}_wheel"], y * half) for n, y in (("left", 1.0), ("right", -1.0))]
    return "\n".join([*lines, "</robot>"])


def _linear(encoded: float) -> float:
    """Return how much light a number of sRGB (IEC 61966-2-1) stands for, which is what viewers take colours for."""
    return ((encoded + 0.055) / 1.055) ** 2.4 if encoded > 0.04045 else encoded / 12.92


def _link(name: str, visuals: list[str]) -> str:
    return "\n".join([f'<link name="{name}">', *visuals, "</link>"])


def _joint(parent: str, child: str, y: float) -> str:
    return (
        f'<joint name="{child}_joint" type="continuous"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="0 {y:.6g} 0"/><axis xyz="0 1 0"/></joint>'
    )


def _visual(colour: str, geometry: str, place: tuple[float, float, float], turn: tuple[float, float, float]) -> str:
    xyz, rpy = (" ".join(f"{number:.9g}" for number in numbers) for numbers in (place, turn))
    return (
        f'<visual><origin xyz="{xyz}" rpy="{rpy}"/><geometry>{geometry}</geometry><material name="{colour}"/></visual>'
    )


def _box(colour: str, size: tuple[float, float, float], place: tuple[float, float, float], pitch: float = 0.0) -> str:
    text = " ".join(f"{number:.6g}" for number in size)
    return _visual(colour, f'<box size="{text}"/>', place, (0.0, pitch, 0.0))


def _cylinder(colour: str, radius: float, length: float, y: float) -> str:
    geometry = f'<cylinder radius="{radius:.6g}" length="{length:.6g}"/>'
    return _visual(colour, geometry, (0.0, y, 0.0), (pi / 2.0, 0.0, 0.0))


def _spoke(radius: float, angle: float) -> str:
    return _box("hub", (1.6 * radius, WHEEL_WIDTH + 0.003, 0.12 * radius), (0.0, 0.0, 0.0), angle)
