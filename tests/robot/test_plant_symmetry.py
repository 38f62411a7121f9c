"""A mirrored robot moves as the mirror image, bit for bit: sums are formed in an order that both sides share."""

from math import sin
from typing import Any

import pytest
from plain import load, nominal_friction, started

PLANT = load("plant").BLOCK
SIGNALS = (
    *(f"{q}{s}" for q in ("pitch", "wheel", "yaw") for s in ("_rate", "_acceleration")),
    "pitch", "wheel_angle", "yaw", "x", "y", "left_shaft_speed", "right_shaft_speed", "left_shaft_angle",
    "right_shaft_angle", "ground_slope",
)  # fmt: skip


def motion(
    friction: dict[str, float],
    torque: Any,
    pitch: float,
    yaw_rate: float,
    push: float,
    slope: float = 0.0,
    **values: float,
) -> list[tuple[float, ...]]:
    """Return all signals over 1.5 s; `torque` gives both drive torques [N.m] at a time, pitch and pitch rate."""
    v = started(PLANT, **friction, pitch_start=pitch, yaw_rate_start=yaw_rate, slope=slope, **values)
    rows = []
    for k in range(1500):
        v.left_drive_torque, v.right_drive_torque = torque(k * 1e-3, v.pitch, v.pitch_rate)
        v.push_force = push if 0.5 < k * 1e-3 < 0.6 else 0.0
        PLANT.step(v, k * 1e-3, 1e-3)
        rows.append(tuple(getattr(v, name) for name in SIGNALS))
    return rows


def drive(t: float, pitch: float, pitch_rate: float) -> tuple[float, float]:
    """Balance roughly, with different ripples left and right."""
    balance = 0.1 * pitch + 0.01 * pitch_rate
    return balance + 0.0015 * sin(11.0 * t), balance - 0.001 * sin(5.0 * t)


def expected(rows: list[tuple[float, ...]], sign: dict[str, float], other: dict[str, str]) -> list[tuple[float, ...]]:
    column = {name: i for i, name in enumerate(SIGNALS)}
    return [tuple(sign.get(n, 1.0) * row[column[other.get(n, n)]] for n in SIGNALS) for row in rows]


@pytest.mark.parametrize("static", [1.0, 1.4])
@pytest.mark.parametrize("bumps", [0.0, 0.01])
def test_left_and_right(static: float, bumps: float) -> None:
    friction = nominal_friction(static)
    swapped = {name: friction[other_side(name)] for name in friction}
    values = {"bump_height": bumps, "wheel_rate_start": 5.0, "slope": 0.05}
    image = motion(swapped, lambda *a: drive(*a)[::-1], 0.2, -1.0, 3.0, **values)
    rows = motion(friction, drive, 0.2, 1.0, 3.0, **values)
    sign = dict.fromkeys(("yaw", "yaw_rate", "yaw_acceleration", "y"), -1.0)
    assert image == expected(rows, sign, {name: other_side(name) for name in SIGNALS})


@pytest.mark.parametrize("static", [1.0, 1.4])
def test_forward_and_backward(static: float) -> None:
    friction = nominal_friction(static)
    turned = {name: friction[other_way(name)] for name in friction}
    image = motion(
        turned, lambda t, p, r: tuple(-x for x in drive(t, -p, -r)), -0.2, -1.0, -3.0, -0.05, wheel_rate_start=-5.0
    )
    rows = motion(friction, drive, 0.2, 1.0, 3.0, 0.05, wheel_rate_start=5.0)
    assert image == expected(rows, {name: -1.0 for name in SIGNALS if name != "y"}, {})


def other_side(name: str) -> str:
    if name.startswith("left"):
        return "right" + name[4:]
    return "left" + name[5:] if name.startswith("right") else name


def other_way(name: str) -> str:
    if "forward" in name:
        return name.replace("forward", "reverse")
    return name.replace("reverse", "forward")
