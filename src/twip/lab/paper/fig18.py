"""Fig 18: straight driving by an offset of the pitch reference, over flat ground and over bumps."""

import numpy as np

from ...robot import value
from ..drawing import BLUE, BROAD, GREEN, GREY, INK, ORANGE, REAL, RED, THIN, label, legend, picture
from ..numbers import slope
from .checks import Check, Result
from .laboratory import Array, Experiment, Laboratory, Run
from .stand import PITCH_ONLY, RELEASE

CHANGE = RELEASE + 1.5
"""Time in s of the first change of the offset, as in the paper 1.5 s after the drive is on."""
FORWARD, BACKWARD = 3.0, -5.0
"""Offsets in degrees; the one backward is larger, for bias and friction lean the robot forward by 1.6°."""
FORWARD_END, BACKWARD_END, END = CHANGE + 1.5, CHANGE + 5.0, CHANGE + 6.0
OFFSETS = (1, 2, 3)
"""Offsets of the sweep in degrees."""
SWEEP_END = CHANGE + 4.5
FIRST_HALF, SECOND_HALF = (CHANGE + 0.5, CHANGE + 2.5), (CHANGE + 2.5, CHANGE + 4.5)
"""Intervals in s in which the acceleration is measured."""
UPRIGHT = {"plant.pitch_start": 0.0, **PITCH_ONLY}
UNBIASED = {"imu.accel_x_bias": 0.0, "imu.accel_z_bias": 0.0}
BUMPS = {"plant.bump_height": 0.003, "plant.bump_start": 0.24}
"""Bumps of 3 mm, 0.10 m long, the first one reached 2.8 s after the drive is on."""


def run(laboratory: Laboratory) -> Result:
    """Drive forward and backward, flat and over bumps; and hold offsets of 1, 2 and 3 degrees."""
    offset = laboratory.write_input(
        "offset_forward_backward.csv", changes((CHANGE, FORWARD), (FORWARD_END, BACKWARD), (BACKWARD_END, 0.0))
    )
    drive = Experiment(END, UPRIGHT, (), offset)
    bumpy = Experiment(END, {**UPRIGHT, **BUMPS}, (), offset)
    flat, rough = laboratory.runs(drive), laboratory.runs(bumpy)
    held = {
        a: Experiment(SWEEP_END, UPRIGHT, (), laboratory.write_input(f"offset_{a}deg.csv", changes((CHANGE, a))))
        for a in OFFSETS
    }
    swept = {a: laboratory.runs(e) for a, e in held.items()}
    unbiased = {
        a: laboratory.runs(Experiment(SWEEP_END, {**UPRIGHT, **UNBIASED}, (), e.inputs), 8) for a, e in held.items()
    }
    gains = {a: [acceleration(r, (FIRST_HALF[0], SECOND_HALF[1])) for r in runs] for a, runs in swept.items()}
    free = {a: [acceleration(r, (FIRST_HALF[0], SECOND_HALF[1])) for r in runs] for a, runs in unbiased.items()}
    halves = [acceleration(r, SECOND_HALF) / acceleration(r, FIRST_HALF) for runs in swept.values() for r in runs]
    theory = [acceleration(r, SECOND_HALF) / expected_acceleration(r) for runs in swept.values() for r in runs]
    slowly = [float(speed(a)[-1]) / speed_at(b, CHANGE + 1.0) for a, b in zip(swept[1], swept[3], strict=True)]
    forward = [speed_at(r, FORWARD_END) for r in flat]
    backward = [speed_at(r, BACKWARD_END) for r in flat]
    bumps = [float(np.ptp(deviation(a, b))) for a, b in zip(rough, flat, strict=True)]
    standing = sum(not r.fallen for r in (*flat, *rough))
    sets = "the offset sets the acceleration; the speed grows as long as it lasts"
    checks = (
        Check("Fig 18", "the robot moves by adding an offset angle to the reference", "speed after 1.5 s of +3°",
              forward, 0.45, 0.75, "m/s", "1.5 s at 0.43 m/s², prototype", min(forward) > 0.0),
        Check("Fig 18", "… forward and backward", "speed after 3.5 s of −5°", backward, -1.5, -0.2, "m/s",
              "the offset acts the other way: forward speed is gone", max(backward) < 0.0, "",
              "equal offsets do not give equal motions: bias and friction lean the robot forward by 1.6°"),
        Check("Fig 18", "with a larger offset angle the robot moves faster", "acceleration at an offset of 1°",
              gains[1], 0.18, 0.27, "m/s²", "prototype 0.22 m/s²"),
        Check("Fig 18", "", "acceleration at an offset of 2°", gains[2], 0.29, 0.37, "m/s²", "prototype 0.33 m/s²"),
        Check("Fig 18", "", "acceleration at an offset of 3°", gains[3], 0.39, 0.48, "m/s²", "prototype 0.43 m/s²"),
        Check("Fig 18", "", "acceleration, third and fourth second over first and second", halves, 0.85, 1.15, "",
              "1: no speed is approached", max(halves) < 0.5, sets, each="runs"),
        Check("Fig 18", "", "acceleration over R (M g L sin ψ − rolling) / (M22 + M24)", theory, 0.95, 1.05, "",
              "theory 1, with the measured pitch ψ", each="runs"),
        Check("Fig 18", "", "speed after 4.5 s of 1° over speed after 1 s of 3°", slowly, 1.5, 4.0, "",
              "0.22·4.5 / (0.43·1) = 2.3", max(slowly) < 1.0, "a small offset held longer moves faster"),
        *(Check("Fig 18", "", f"acceleration at {a}°, accelerometer without bias", free[a], reference - 0.03,
                reference + 0.03, "m/s²", f"blocks in plain Python {reference} m/s²", None, "",
                "a bias leans the robot as an offset does, 2.6 times amplified")
          for a, reference in ((1, 0.15), (2, 0.25), (3, 0.35))),
        Check("Fig 18", "little bumps change the velocity, at about 2.8 s",
              "range of the speed's deviation from flat ground, 2.7 to 3.5 s", bumps, 0.01, 0.3, "m/s",
              "a bump of 3 mm: visible, and ridden over", min(bumps) > 0.01),
        Check("Fig 18", "(the robot keeps its balance)", "runs that stand, flat and over bumps", [standing],
              2 * len(flat), 2 * len(flat), f"of {2 * len(flat)}", "all", standing == 2 * len(flat)),
    )  # fmt: skip
    draw(laboratory, flat[0], rough[0], {a: runs[0] for a, runs in swept.items()})
    return Result(
        "fig18", "Straight driving by a pitch offset", checks, [e.command() for e in (drive, bumpy, *held.values())]
    )


def changes(*steps: tuple[float, float]) -> dict[str, Array]:
    """Return an input series of the pitch offset that jumps to (time in s, offset in degrees)."""
    times, offsets = [0.0], [0.0]
    for time, offset in steps:
        times += [time, time]
        offsets += [offsets[-1], np.radians(offset)]
    return {"time": np.array([*times, times[-1] + 1.0]), "controller.pitch_offset": np.array([*offsets, offsets[-1]])}


def speed(run: Run) -> Array:
    """Return the axle's speed in m/s."""
    return value("wheel_radius") * run["plant.wheel_rate"]


def speed_at(run: Run, time: float) -> float:
    """Return the axle's speed in m/s at a time in s."""
    return float(np.interp(time, run.times, speed(run)))


def acceleration(run: Run, interval: tuple[float, float]) -> float:
    """Return the mean acceleration in m/s2 in an interval [s]."""
    part = run.during(*interval)
    return slope(part.times, speed(part))


def expected_acceleration(run: Run) -> float:
    """Return the acceleration in m/s2 that belongs to the mean pitch in the second half when the pitch is constant.

    R (M g L sin(psi) - C_rr (M + 2 m) g R) / (M22 + M24)

    The sum of rows 1 and 2 of the equations of motion: the motors' torque and the rotors' inertia fall out of it.
    """
    pitch = float(np.mean(run.during(*SECOND_HALF)["plant.pitch"]))
    radius, mass, wheels = value("wheel_radius"), value("body_mass"), 2.0 * value("wheel_mass")
    weight = mass * value("gravity") * value("cog_height") * np.sin(pitch)
    rolling = value("rolling_resistance") * (mass + wheels) * value("gravity") * radius
    m22_without_rotors = (mass + wheels) * radius**2 + 2.0 * value("wheel_inertia")
    m24_without_rotors = mass * value("cog_height") * radius * np.cos(pitch)
    return float(radius * (weight - rolling) / (m22_without_rotors + m24_without_rotors))


def deviation(run: Run, flat: Run) -> Array:
    """Return by how much the speed (m/s) differs from that on flat ground around the first bump."""
    interval = (RELEASE + 2.7, RELEASE + 3.5)
    return speed(run.during(*interval)) - speed(flat.during(*interval))


def draw(laboratory: Laboratory, flat: Run, rough: Run, swept: dict[int, Run]) -> None:
    """Draw pitch and offset, the speed over flat ground and bumps, and the speeds of the sweep."""
    with picture(
        laboratory.out / "fig18.png", "Fig 18: driving by an offset of the pitch reference", (2.3, 2.3, 2.3)
    ) as (top, middle, low):
        top.plot(flat.times - RELEASE, flat.degrees("plant.pitch"), label="real pitch, flat", **REAL)
        top.plot(rough.times - RELEASE, rough.degrees("plant.pitch"), color=ORANGE, label="real pitch, bumps", **THIN)
        top.plot(
            flat.times - RELEASE,
            flat.degrees("controller.pitch_offset"),
            color=RED,
            linestyle="--",
            label="offset of the reference",
            **THIN,
        )
        middle.plot(flat.times - RELEASE, speed(flat), label="flat", **REAL)
        middle.plot(rough.times - RELEASE, speed(rough), color=ORANGE, label="bumps of 3 mm", **BROAD)
        on_bump = rough["plant.ground_slope"] != 0.0
        middle.fill_between(rough.times - RELEASE, 0, 1, where=on_bump, color=GREY, alpha=0.2, linewidth=0,
                            transform=middle.get_xaxis_transform(), label="on a bump")  # fmt: skip
        for (angle, run), colour in zip(swept.items(), (BLUE, GREEN, RED), strict=True):
            low.plot(run.times - RELEASE, speed(run), color=colour, label=f"offset {angle}°", **BROAD)
        low.axhline(speed_at(swept[3], CHANGE + 1.0), color=INK, linestyle=":", linewidth=1.0, label="3° after 1 s")
        low.set_title("offsets held: the speed keeps growing")
        label(top, "pitch [°]", "time after the drive is on [s]")
        label(middle, "speed [m/s]", "time after the drive is on [s]")
        label(low, "speed [m/s]", "time after the drive is on [s]")
        for axes in (top, middle, low):
            axes.set_xlim(0.0, END - RELEASE)
            legend(axes)
