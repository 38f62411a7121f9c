"""Fig 14: steady state with and without friction compensation, the slope that it depends on, and crawling."""

import numpy as np

from ...robot import value
from ..drawing import BLUE, BROAD, GREY, INK, RED, label, legend, picture
from ..numbers import excursions, reversals
from .checks import Check, Result
from .laboratory import Experiment, Laboratory, Run
from .stand import END, RELEASE, STEADY, stand_up, stand_ups, steady_pitch

BOUNDARIES = (0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0)
"""Boundary layers Φ1 of the sweep, in rad/s; 0, the literal sign law, comes on top."""
SWEEP_SEEDS = 4
"""Seeds per point of the sweep; the steady pitch varies by 0.1° between seeds."""
CRAWL = (RELEASE + 10.0, RELEASE + 30.0)
"""Interval in s in which crawling is judged, with the velocity loop."""
LURCH = 2.0
"""Pitch in degrees beyond which a motion out of the rest counts as a lurch."""
MOVING = 0.2
"""Wheel rate in rad/s above which the robot counts as moving."""


def uncompensated_acceleration() -> float:
    """Return the Δ of eq (54), in rad/s2, that forward Coulomb friction makes when nothing compensates it.

    Δ = n (T_cl + T_cr) (M22 + M24) / D   upright
    """
    n, radius, height = value("gear_ratio"), value("wheel_radius"), value("cog_height")
    rotors = 2.0 * n * n * (value("rotor_inertia") + value("gear_inertia"))
    mass, wheels = value("body_mass"), 2.0 * value("wheel_mass")
    m22 = (mass + wheels) * radius**2 + 2.0 * value("wheel_inertia") + rotors
    m24 = mass * height * radius - rotors
    m44 = mass * height**2 + value("body_pitch_inertia") + rotors
    coulomb = n * (value("left.coulomb_forward") + value("right.coulomb_forward"))
    return coulomb * (m22 + m24) / (m22 * m44 - m24**2)


def improvement(boundary: float) -> float:
    """Return the difference in degrees that theory gives: c2 Δ / (k c1), with k = ε1/Φ1."""
    slope = value("epsilon1") / boundary
    return float(np.degrees(value("c2") * uncompensated_acceleration() / (slope * value("c1"))))


def run(laboratory: Laboratory) -> Result:
    """Stand up under the pitch-only law; sweep its slope; and stand for half a minute with the velocity loop."""
    with_runs, without_runs = stand_ups(laboratory, 27.0, True), stand_ups(laboratory, 27.0, False)
    steady, friction = ([steady_pitch(r) for r in runs] for runs in (with_runs, without_runs))
    gains = [b - a for a, b in zip(steady, friction, strict=True)]
    ways = [[float(r["plant.x"][-1]) for r in runs] for runs in (with_runs, without_runs)]
    swept = sweep(laboratory)
    inside = [k for k, (a, b) in swept.items() if k and 2.0 <= np.mean(b) - np.mean(a) <= 3.0]
    outside = [k for k in swept if k and k not in inside]
    ratios = [float(np.mean(b) - np.mean(a)) / improvement(k) for k, (a, b) in swept.items() if k]
    literal = [abs(b) - abs(a) for a, b in zip(*swept[0.0], strict=True)]
    low, high = 2.0 / improvement(1.0), 3.0 / improvement(1.0)
    others = ", ".join(f"{k:g}" for k in outside)
    slopes = [value("epsilon1") / k for k in inside]
    condition = f"for a slope k = ε1/Φ1 of {min(slopes):.0f} to {max(slopes):.0f} 1/s" if slopes else "for no slope"
    crawls = {c: laboratory.runs(Experiment(CRAWL[1], {}, () if c else ("no_compensation",))) for c in (True, False)}
    peaks, lurches, turns = (
        {c: [f(r) for r in runs] for c, runs in crawls.items()} for f in (peak, lurch_count, turn_count)
    )
    softer = Experiment(CRAWL[1], {"controller.boundary1": 5.0}, ("no_compensation",))
    soft = [peak(r) for r in laboratory.runs(softer, SWEEP_SEEDS)]
    crawling = min(lurches[False]) > 0
    checks = (
        Check("Fig 14", "friction compensation improves the steady state error by 2–3°",
              "steady pitch with compensation, Φ1 = 3", steady, 1.4, 1.95, "°", "prototype 1.75°"),
        Check("Fig 14", "", "steady pitch without compensation, Φ1 = 3", friction, 3.9, 4.4, "°", "prototype 4.18°"),
        Check("Fig 14", "", "difference, Φ1 = 3", gains, 2.0, 3.0, "°",
              f"paper 2–3°; theory c2Δ/(k c1) {improvement(3.0):.2f}°, prototype 2.43°",
              min(gains) >= 2.0 and max(gains) <= 3.0, condition),
        Check("Fig 14", "", "smallest Φ1 of the sweep with a difference of 2–3°", [min(inside, default=0.0)], 2.5, 2.5,
              "rad/s",
              f"theory: at least {low:.2f} rad/s", False if outside else None, f"not for Φ1 = {others} rad/s"),
        Check("Fig 14", "", "largest Φ1 of the sweep with a difference of 2–3°", [max(inside, default=0.0)], 3.0, 3.5,
              "rad/s",
              f"theory: at most {high:.2f} rad/s, less by the delay", False if outside else None,
              f"not for Φ1 = {others} rad/s"),
        Check("Fig 14", "", "difference over theory c2Δ/(k c1), whole sweep", ratios, 0.9, 1.2, "",
              "theory 1; the rest is the delay of 5 ms", each="points"),
        Check("Fig 14", "… under the literal sgn law (46)", "difference of the magnitudes, Φ1 = 0", literal, -0.8, 1.0,
              "°", "prototype 0.1°", min(literal) > 2.0, "",
              "the law chatters: which way it leans depends on the noise"),
        Check("Fig 14", "“steady state” is an accelerating robot", "way in 5 s with compensation", ways[0], 3.8, 4.7,
              "m", "prototype 4.0 m"),
        Check("Fig 14", "", "way in 5 s without compensation", ways[1], 6.5, 7.6, "m", "prototype 6.8 m"),
        Check("Fig 14", "without compensation the robot crawls", "lurches in 20 s without compensation (velocity loop)",
              lurches[False], 1, 12, "", "stick–slip", crawling,
              "where the robot comes to rest: with the velocity loop, not under the pitch-only law"),
        Check("Fig 14", "", "largest pitch without compensation", peaks[False], 3.5, 5.5, "°",
              "blocks in plain Python 4.6°; prototype 6–9°", None, "",
              "the lurch grows with the boundary layer, see the next row, and with the sample time (5.2° at 20 ms)"),
        Check("Fig 14", "", "largest pitch without compensation, Φ1 = 5", soft, 6.0, 9.0, "°", "prototype 6–9°"),
        Check("Fig 14", "", "reversals without compensation", turns[False], 0, 4, "",
              "at most one per lurch; prototype 10–12", None, "",
              "rolling resistance and stiction hold the robot for about 10 s between lurches"),
        Check("Fig 14", "with compensation there is no crawling", "lurches in 20 s with compensation", lurches[True], 0,
              0, "", "prototype none", max(lurches[True]) == 0,
              "" if max(lurches[True]) == 0 else "not in every run"),
        Check("Fig 14", "", "largest pitch with compensation", peaks[True], 0.0, 0.9, "°",
              "prototype 0.5° once at rest"),
        Check("Fig 14", "", "reversals with compensation", turns[True], 0, 0, "", "prototype none"),
    )  # fmt: skip
    draw(laboratory, (with_runs[0], without_runs[0]), swept, (crawls[True][0], crawls[False][0]))
    shown = [stand_up(27.0, True), stand_up(27.0, False), Experiment(CRAWL[1], {}, ("no_compensation",))]
    return Result("fig14", "Steady state with and without friction compensation", checks, [e.command() for e in shown])


def sweep(laboratory: Laboratory) -> dict[float, tuple[list[float], list[float]]]:
    """Return the steady pitch in degrees with and without compensation for each boundary layer Φ1 in rad/s."""
    found: dict[float, tuple[list[float], list[float]]] = {}
    for boundary in (0.0, *BOUNDARIES):
        seeds = None if boundary == 0.0 else SWEEP_SEEDS
        with_, without = (laboratory.runs(stand_up(27.0, c, boundary1=boundary), seeds) for c in (True, False))
        found[boundary] = [steady_pitch(r) for r in with_], [steady_pitch(r) for r in without]
    return found


def peak(run: Run) -> float:
    """Return the largest magnitude of the pitch in degrees in the interval of crawling."""
    return float(np.max(np.abs(run.during(*CRAWL).degrees("plant.pitch"))))


def lurch_count(run: Run) -> int:
    """Return the number of lurches in the interval of crawling."""
    return excursions(run.during(*CRAWL).degrees("plant.pitch"), LURCH)


def turn_count(run: Run) -> int:
    """Return the number of reversals in the interval of crawling."""
    return reversals(run.during(*CRAWL)["plant.wheel_rate"], MOVING)


def draw(
    laboratory: Laboratory,
    stood: tuple[Run, Run],
    swept: dict[float, tuple[list[float], list[float]]],
    crawled: tuple[Run, Run],
) -> None:
    """Draw the pitch of both stand-ups, the sweep of the boundary layer, and the crawling."""
    both = ((RED, "without compensation", 1), (BLUE, "with compensation", 0))
    with picture(
        laboratory.out / "fig14.png", "Fig 14: steady state with and without friction compensation", (2.5, 2.7, 2.4)
    ) as (top, middle, low):
        for colour, words, i in both:
            top.plot(stood[i].times - RELEASE, stood[i].degrees("plant.pitch"), color=colour, label=words, **BROAD)
            low.plot(crawled[i].times - RELEASE, crawled[i].degrees("plant.pitch"), color=colour, label=words, **BROAD)
        top.set_title("standing up, pitch-only law")
        top.axvspan(STEADY[0] - RELEASE, STEADY[1] - RELEASE, color=GREY, alpha=0.12, linewidth=0, label="steady state")
        top.set_xlim(-0.2, END - RELEASE)
        top.set_ylim(-2.0, 28.0)
        label(top, "pitch [°]", "time after the release [s]")
        boundaries = np.array(BOUNDARIES)
        fine = np.linspace(0.02, boundaries[-1], 50)
        middle.axhspan(2.0, 3.0, color=GREY, alpha=0.15, linewidth=0, label="the paper's 2–3°")
        middle.plot(
            fine, [improvement(b) for b in fine], color=INK, linestyle="--", linewidth=1.0, label="theory c2Δ/(k c1)"
        )
        differences = [np.mean(swept[b][1]) - np.mean(swept[b][0]) for b in BOUNDARIES]
        middle.plot(boundaries, differences, "o-", color=INK, markersize=4, linewidth=1.4, label="difference")
        literal = [abs(b) - abs(a) for a, b in zip(*swept[0.0], strict=True)]
        middle.plot(np.zeros(len(literal)), literal, "x", color=INK, markersize=4, label="literal sgn law")
        for colour, words, i in both:
            middle.plot(
                boundaries,
                [np.mean(swept[b][i]) for b in BOUNDARIES],
                "o-",
                color=colour,
                markersize=3,
                linewidth=1.0,
                label=words,
            )
        middle.set_title("steady pitch")
        label(middle, "pitch [°]", "boundary layer Φ1 [rad/s] (slope k = ε1/Φ1, ε1 = 30 rad/s²)")
        low.set_title("standing still, velocity loop")
        low.set_xlim(2.0, CRAWL[1] - RELEASE)
        low.set_ylim(-6.5, 6.5)
        label(low, "pitch [°]", "time after the release [s]")
        middle.set_ylim(-0.6, 6.6)
        middle.legend(loc="upper left", ncols=3)
        legend(top)
        legend(low)
