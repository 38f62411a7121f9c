"""The numbers the robot is judged by, from any record of a run that has its signals: a log or a table in memory.

`measure(log)` gives all of them by name, `METRICS` says what each one is, `judge(log)` puts a run into words. Angles in
rad, times in s as the record counts them, voltages in V, energy in J.

Metrics that assume a standing robot are nan where it fell: what lies on the floor has no steady state.

A record that continues a run from a checkpoint holds no release if the robot was released before: what is counted from
the release is then nan, and the run is not judged.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import degrees, inf, isnan, nan
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ..errors import TwipError
from .numbers import Array, overshoot, settling_time

SETTLED_AFTER = 3.0
"""Time after the release from which the pitch must stay within `PITCH_LIMIT`, in s."""
PITCH_LIMIT = np.radians(1.0)
"""Largest pitch of a balanced robot, in rad."""
FAR = 1e7
"""Magnitude from which a metric is shown with a power of ten: a run that fails may compute anything before."""
SIDES = ("left", "right")
REQUIRED = (
    *("plant.pitch", "plant.pitch_rate", "plant.yaw", "plant.wheel_angle", "plant.wheel_rate", "plant.x", "plant.y"),
    *("plant.ground_slope", "plant.push_force", "plant.fallen"),
    *(f"plant.{side}.{name}" for side in SIDES for name in ("shaft_speed", "shaft_angle", "stribeck_speed_limit")),
    *(f"plant.{side}.{limit}_limit" for side in SIDES for limit in ("coulomb_forward", "coulomb_reverse")),
    *(f"plant.{side}.{limit}_limit" for side in SIDES for limit in ("static_forward", "static_reverse")),
    *(f"{side}.{name}" for side in SIDES for name in ("voltage", "current")),
)
"""Signals that a record of the robot has, those of plant and motors; without them it is of another system."""
BLOCKS = (
    *("estimator.pitch", "estimator.wheel_rate", "estimator.yaw"),
    *("controller.left.voltage", "controller.right.voltage", "controller.s1", "controller.s2"),
    *("controller.pitch_reference", "controller.speed_reference", "controller.yaw_reference"),
)
"""Signals of the blocks that others may stand for: what is drawn or computed of them is left out where they lack."""


class Record(Protocol):
    """A `Playback`, a `Result` or a `Table`."""

    @property
    def times(self) -> NDArray[np.float64]:
        """Times of the rows in s, (rows,)."""

    @property
    def continued(self) -> bool:
        """Whether the record goes on from a checkpoint instead of the run's start."""

    def __contains__(self, name: object) -> bool:
        """Whether the record has a signal of this name."""

    def __getitem__(self, name: str) -> NDArray[Any]:
        """Values of `component.variable`, (rows,)."""


def is_robot(names: Mapping[str, object] | list[str]) -> bool:
    """Tell whether the signals of a record, by these names, are those of the robot, whatever controls it."""
    return all(name in names for name in REQUIRED)


def released_before(record: Record) -> bool:
    """Tell whether the robot moves already when the record begins, because an earlier one holds its release."""
    return record.continued and bool(record["plant.pitch_rate"][0] != 0.0)


def release_time(record: Record) -> float:
    """Return the last time at which the robot is still held (or rests) at first, in s.

    nan if it never moves, or was released before the record begins.
    """
    moving = np.flatnonzero(record["plant.pitch_rate"] != 0.0)
    if not moving.size or released_before(record):
        return nan
    return float(record.times[moving[0] - 1]) if moving[0] else float(record.times[0])


def fallen_at(record: Record) -> float:
    """Return when the robot fell, in s; inf if it did not."""
    fallen = np.flatnonzero(record["plant.fallen"] > 0.5)
    return float(record.times[fallen[0]]) if fallen.size else inf


def steady_pitch(record: Record) -> Array:
    """Return the pitch from `SETTLED_AFTER` s after the release on, in rad; nothing of a shorter record."""
    pitch: Array = record["plant.pitch"]
    return pitch[record.times >= release_time(record) + SETTLED_AFTER]


def balanced(record: Record) -> float:
    """Return 1 when the robot stands and its pitch is within `PITCH_LIMIT` from `SETTLED_AFTER` on, else 0.

    nan where the robot stands and was released before the record begins.
    """
    if released_before(record) and fallen_at(record) == inf:
        return nan
    lasts = record.times[-1] >= release_time(record) + SETTLED_AFTER
    return float(lasts and fallen_at(record) == inf and peak_pitch_settled(record) < PITCH_LIMIT)


def peak_pitch_settled(record: Record) -> float:
    """Return the largest magnitude of the pitch in steady state, in rad; nan of a record that ends before."""
    steady = steady_pitch(record)
    return float(np.max(np.abs(steady))) if steady.size else nan


def steady_state_error(record: Record) -> float:
    """Return the magnitude of the mean pitch in steady state, in rad; nan of a record that ends before."""
    steady = steady_pitch(record)
    return float(abs(np.mean(steady))) if steady.size else nan


def pitch_overshoot(record: Record) -> float:
    """Return how far the pitch swings beyond upright, seen from where it is released, in rad."""
    pitch = _released(record)[1]
    return overshoot(pitch, 0.0) if pitch.size else nan


def pitch_settling_time(record: Record) -> float:
    """Return the time from the release until the pitch stays within `PITCH_LIMIT`, in s; inf if it never does.

    nan of a record that ends before the steady state: it cannot tell.
    """
    if not steady_pitch(record).size:
        return nan
    return settling_time(*_released(record), 0.0, PITCH_LIMIT)


def peak_voltage(record: Record) -> float:
    """Return the largest magnitude of a motor's voltage, in V."""
    return float(max(np.max(np.abs(record[f"{side}.voltage"])) for side in SIDES))


def energy(record: Record) -> float:
    """Return the electrical energy that both motors took, less what they gave back, in J.

    The integral of voltage times current; a row holds the voltage of the step that ended there.
    """
    step = np.diff(record.times)
    power = sum(record[f"{side}.voltage"] * record[f"{side}.current"] for side in SIDES)
    return float(np.sum(power[1:] * step))


def estimator_error(record: Record) -> float:
    """Return the largest difference between estimated and real pitch from the release on, in rad."""
    since = released_before(record) | (record.times >= release_time(record))
    error = np.abs(record["estimator.pitch"] - record["plant.pitch"])[since]
    return float(np.max(error)) if error.size else nan


def _released(record: Record) -> tuple[Array, Array]:
    """Return times and pitch from the release on."""
    since = record.times >= release_time(record)
    return record.times[since], record["plant.pitch"][since]


@dataclass(frozen=True)
class Metric:
    """One number of a run; `of` computes it in `unit`, people read it in `shown_unit` (`scale` times the value)."""

    label: str
    unit: str
    of: Callable[[Record], float]
    shown_unit: str = ""
    scale: float = 1.0
    digits: int = 2
    infinite: str = "never"
    """What an infinite value means."""
    needs: tuple[str, ...] = ()
    """Signals beyond `REQUIRED` without which it is nan."""
    standing: bool = False
    """It assumes that the robot stands to the end: nan where it fell."""

    def value(self, record: Record) -> float:
        """Return the number in `unit`; nan where a signal that it `needs` is missing, or the robot fell."""
        told = all(signal in record for signal in self.needs) and not (self.standing and fallen_at(record) < inf)
        return self.of(record) if told else nan

    def text(self, value: float) -> str:
        """Return a value as people read it, with its unit."""
        if not np.isfinite(value):
            return "–" if isnan(value) else self.infinite
        unit = self.shown_unit or self.unit
        if unit == "1":
            return f"{value:g}"
        shown = self.scale * value
        number = f"{shown:.{self.digits}f}" if abs(shown) < FAR else f"{shown:.3g}"
        return f"{number}°" if unit == "deg" else f"{number} {unit}"


def _angle(label: str, of: Callable[[Record], float], needs: tuple[str, ...] = ()) -> Metric:
    """Return a metric of a standing robot's pitch."""
    return Metric(label, "rad", of, "deg", degrees(1.0), needs=needs, standing=True)


METRICS: dict[str, Metric] = {
    "balanced": Metric("balanced", "1", balanced, digits=0),
    "fallen_at": Metric("fell at", "s", fallen_at, digits=3),
    "release_time": Metric("released at", "s", release_time),
    "steady_state_error": _angle("steady-state error", steady_state_error),
    "peak_pitch_settled": _angle("largest pitch in steady state", peak_pitch_settled),
    "pitch_overshoot": _angle("overshoot", pitch_overshoot),
    "settling_time": Metric("settling time", "s", pitch_settling_time, infinite="not reached", standing=True),
    "peak_voltage": Metric("peak voltage", "V", peak_voltage),
    "energy": Metric("energy", "J", energy),
    "estimator_error": _angle("estimator error", estimator_error, ("estimator.pitch",)),
}
"""Every metric of a run by name."""


def measure(record: Record) -> dict[str, float]:
    """Return every metric of a record by its name, in its unit; nan where it cannot be told (`Metric.value`).

    Raises TwipError where rows or a signal of `REQUIRED` are missing.
    """
    if not len(record.times):
        raise TwipError("the record has no rows to judge")
    return {name: metric.value(record) for name, metric in METRICS.items()}


@dataclass(frozen=True)
class Verdict:
    """How a run went: `metrics` as `measure` gives them, when the record `began` and `ended` in s, and a sentence."""

    metrics: Mapping[str, float]
    began: float
    ended: float
    released_before: bool = False
    """The record continues a run whose robot was released before it begins."""

    @property
    def balanced(self) -> bool:
        """The robot stands and its pitch is within the limit from `SETTLED_AFTER` on."""
        return self.metrics["balanced"] == 1.0

    @property
    def release(self) -> float:
        """When the robot was released, in s; nan if it was not."""
        return self.metrics["release_time"]

    @property
    def decided(self) -> bool:
        """The record is long enough to tell whether the robot balances, or it fell."""
        return self.metrics["fallen_at"] < inf or not isnan(self.metrics["peak_pitch_settled"])

    def sentence(self) -> str:
        """The verdict in words."""
        if self.metrics["fallen_at"] < inf:
            before = self.released_before and self.metrics["fallen_at"] == self.began
            return f"fell {'before' if before else 'at'} {self.metrics['fallen_at']:.3f} s"
        if self.released_before:
            return f"stands from {self.began:g} s to {self.ended:g} s; not judged, for it was released before"
        if isnan(self.release):
            return "not released"
        if not self.decided:
            return f"ended {self.ended - self.release:.3g} s after release, too early to tell"
        late = self.metrics["settling_time"] < inf
        verdict = "balanced" if self.balanced else "stands, settled late" if late else "stands, not settled"
        bound, most = f"{degrees(PITCH_LIMIT):.0f}°", f"at most {degrees(self.metrics['peak_pitch_settled']):.2f}°"
        if self.balanced:
            return f"{verdict}: |pitch| < {bound} from {SETTLED_AFTER:g} s after release on, {most}"
        within = f"; within it from {self.release + self.metrics['settling_time']:.2f} s on" if late else ""
        return f"{verdict}: |pitch| > {bound} later than {SETTLED_AFTER:g} s after release, {most}{within}"

    def text(self, name: str) -> str:
        """Return a metric as people read it."""
        return METRICS[name].text(self.metrics[name])


def judge(record: Record) -> Verdict:
    """Judge a run; raises TwipError where a signal is missing."""
    return Verdict(measure(record), float(record.times[0]), float(record.times[-1]), released_before(record))
