"""What of a log is worth drawing, and together: the same panels for the report, the plot and the views.

A robot's log has panels of its own; any other log is grouped by component and unit, outputs only, for inputs repeat
what another component puts out.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from math import degrees

import numpy as np

from ..cosim import Playback
from ..errors import Problem, TwipError
from .metrics import SIDES, is_robot
from .numbers import Array
from .run_parameters import number

REST_WINDOW = 0.1
"""Time over which the share of sticking is taken, in s."""
STICTION = (
    "Sliding, a shaft has the friction of its speed, against the motion; sticking, what keeps it at rest, within the "
    "static limits (dotted). With both shafts and both wheels at rest the split between them is not unique: drawn is "
    "the middle of the possible values. While the robot is held, friction counts as 0. Compensated: the friction that "
    "the controller's share of the voltage pays for."
)
"""What holds of the friction drawn."""
KINDS = ("real", "estimate", "reference")
MOST_LINES = 6
"""Lines of one panel of an unknown system."""
MOST_PANELS = 24
"""Panels of an unknown system."""


@dataclass(frozen=True)
class Line:
    """One line of a panel, in the panel's unit. `role` gives it its looks, see `drawing.LOOKS`."""

    label: str
    role: str
    values: Array = field(repr=False)
    source: str = ""
    """The signal it comes from, where it is one."""


@dataclass(frozen=True)
class Panel:
    """Lines that share their axes."""

    title: str
    unit: str
    lines: tuple[Line, ...]
    note: str = ""
    """What one must know to read it."""


def panels(log: Playback, names: Sequence[str] = ()) -> list[Panel]:
    """Return the panels of a log: the robot's own or those of any system, or of the signals that `names` match.

    `names` are `component.variable`, `*` and `?` stand for any text and letter. Raises TwipError for a name that
    matches nothing or only a String.
    """
    if names:
        return _of_signals(log, matching(log, names))
    return list(_robot(log)) if is_robot(list(log.signals)) else _of_signals(log, chosen(log)[0])


def matching(log: Playback, names: Sequence[str]) -> list[str]:
    """Return the signals that match, each once; raises TwipError that names every pattern that matches nothing that can
    be drawn.
    """
    found: dict[str, None] = {}
    problems: list[str | Problem] = []
    for name in names:
        matched = [name] if name in log.signals else [s for s in log.signals if fnmatchcase(s, name)]
        hits = [s for s in matched if _has_numbers(log, s)]
        if matched and not hits:
            problems.append(f"{name} is a String in {log.path}, which cannot be drawn")
        elif not hits:
            try:
                log[name]
            except TwipError as error:
                problems += error.problems
        found.update(dict.fromkeys(hits))
    if problems:
        raise TwipError(problems)
    return list(found)


def _has_numbers(log: Playback, name: str) -> bool:
    return log.signals[name].dtype != object


def chosen(log: Playback) -> tuple[list[str], list[str]]:
    """Return the signals of an unknown system that are drawn, and those that are left out because they are too many."""
    names = [
        f"{channel.component}.{signal.name}" if channel.component else signal.name
        for channel in log.channels
        for signal in channel.signals
        if (signal.causality == "output" or not channel.component) and signal.type != "String"
    ]
    drawn = [line.source for panel in _of_signals(log, names)[:MOST_PANELS] for line in panel.lines]
    return drawn, [name for name in names if name not in set(drawn)]


def _of_signals(log: Playback, names: Iterable[str]) -> list[Panel]:
    """Return panels with the lines of one component and unit each."""
    owners = {
        (f"{channel.component}.{signal.name}" if channel.component else signal.name): (channel.component, signal.name)
        for channel in log.channels
        for signal in channel.signals
    }
    groups: dict[tuple[str, str], list[Line]] = {}
    for name in names:
        component, variable = owners[name]
        line = Line(variable, "other", np.asarray(log[name], np.float64), name)
        groups.setdefault((component, log.unit(name) or ""), []).append(line)
    panels = []
    for (component, unit), lines in groups.items():
        title = component or log.metadata.get("system", {}).get("name", "system")
        for part, first in enumerate(range(0, len(lines), MOST_LINES), 1):
            numbered = title if part == 1 else f"{title} ({part})"
            panels.append(Panel(numbered, unit, tuple(lines[first : first + MOST_LINES])))
    return panels


def _robot(log: Playback) -> Iterator[Panel]:
    """Yield the robot's panels; what a block has not put out that stands for one of the robot's is left out."""

    def line(label: str, role: str, name: str, scale: float = 1.0) -> Line:
        return Line(label, role, scale * log[name], name)

    def three(title: str, unit: str, *of: tuple[str, float]) -> Panel:
        """Return the panel of a real quantity, its estimate and its reference, each a signal and its factor."""
        kinds = zip((title.lower(), "estimate", "reference"), KINDS, of, strict=True)
        known = (line(label, role, *signal) for label, role, signal in kinds if signal[0] in log)
        return Panel(title, unit, tuple(known))

    def parameter(component: str, name: str) -> float:
        return number(log.metadata, component, name, str(log.path))

    angle, radius = degrees(1.0), parameter("plant", "wheel_radius")
    pitch = (("plant.pitch", angle), ("estimator.pitch", angle), ("controller.pitch_reference", angle))
    yield three("Pitch", "°", *pitch)
    if "estimator.pitch" in log:
        error = angle * (log["estimator.pitch"] - log["plant.pitch"])
        yield Panel("Estimator error", "°", (Line("estimate − pitch", "estimate", error),))
    speed = (("plant.wheel_rate", radius), ("estimator.wheel_rate", radius), ("controller.speed_reference", 1.0))
    yield three("Speed", "m/s", *speed)
    yield three("Yaw", "°", ("plant.yaw", angle), ("estimator.yaw", angle), ("controller.yaw_reference", angle))
    supply = np.full(len(log.times), parameter("controller", "supply_voltage"))
    limits = (Line("supply", "limit", supply), Line("−supply", "limit", -supply))
    yield Panel("Voltage", "V", (*(line(side, side, f"{side}.voltage") for side in SIDES), *limits))
    surfaces = (("s1 balance", "left", "controller.s1"), ("s2 yaw", "right", "controller.s2"))
    if known := tuple(line(*surface) for surface in surfaces if surface[-1] in log):
        yield Panel("Sliding surfaces", "rad/s", known)
    yield Panel("Place", "m", (line("x", "left", "plant.x"), line("y", "right", "plant.y")))
    for side in SIDES:
        if f"plant.{side}.friction_torque" in log.signals:
            torque_per_volt = parameter("controller", "torque_constant") / parameter("controller", "resistance")
            yield _friction(log, side, torque_per_volt)
    yield Panel(f"Share of {REST_WINDOW:g} s at rest", "%", tuple(Line(s, s, 100.0 * rest(log, s)) for s in SIDES))
    acting: list[tuple[str, str, str, float]] = [
        ("Push", "N", "plant.push_force", 1.0),
        ("Ground slope", "°", "plant.ground_slope", angle),
        ("Torque on the body", "mN·m", "plant.body_torque", 1e3),
    ]
    for title, unit, name, scale in acting:
        if name in log.signals and np.any(log[name] != 0.0):
            yield Panel(title, unit, (line(title.lower(), "real", name, scale),))


def _friction(log: Playback, side: str, torque_per_volt: float) -> Panel:
    """Return the panel of a shaft's dry friction in mN.m: what acts, what the controller pays for, the limits at rest.

    The controller's share of the voltage makes the torque K_t / R_m v_c; the friction it pays for is the opposite.
    """
    milli = 1e3
    torque, paid = f"plant.{side}.friction_torque", f"controller.{side}.compensation_voltage"
    lines = [Line("friction", "real", milli * log[torque], torque)]
    if paid in log.signals:
        lines.append(Line("compensated", "estimate", -milli * torque_per_volt * log[paid], paid))
    for way, sign in (("forward", -1.0), ("reverse", 1.0)):
        lines.append(Line(f"static {way}", "limit", sign * milli * log[f"plant.{side}.static_{way}_limit"]))
    return Panel(f"Dry friction, {side}", "mN·m", tuple(lines), STICTION if side == SIDES[0] else "")


def rest(log: Playback, side: str) -> Array:
    """Return the share of the rows of the last `REST_WINDOW` s in which a shaft sticks, 0 to 1."""
    sticks = np.concatenate([[0.0], np.cumsum(log[f"plant.{side}.shaft_speed"] == 0.0)])
    last = np.arange(1, len(log.times) + 1)
    first = np.minimum(np.searchsorted(log.times, log.times - REST_WINDOW, side="right"), last - 1)
    share: Array = (sticks[last] - sticks[first]) / (last - first)
    return share
