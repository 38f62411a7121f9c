"""Run-ups: the parts of a recording in which the speed changes at constant current."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .motion import quarter_speeds
from .recording import Array, Recording
from .steady import BATCHES, steady_windows
from .stretches import Stretch, constant_stretches

POINTS = 80
"""Most points taken from one run-up."""
SLOWEST = 5.0
"""Slowest mean speed of a quarter of a run-up, in rad/s: below, friction may not be Coulomb plus viscous."""
SMALLEST_CHANGE = 0.1
"""Smallest change of speed from the first to the last quarter of a run-up, relative to the larger one."""


@dataclass(frozen=True)
class RunUp:
    """One run-up in `direction` (1 or -1) from recording number `recording`.

    `time` (n,) [s] since its beginning; `values` (n,) angle [rad] if `angular`, else speed [rad/s], both as magnitudes
    of the direction; `error` standard error of one value; `current` [A] mean magnitude, `current_error` its standard
    error; `acceleration` [rad/s2] and `speed` [rad/s] rough means.
    """

    recording: int
    direction: int
    time: Array
    values: Array
    angular: bool
    error: float
    current: float
    current_error: float
    speed: float
    acceleration: float


def run_ups(recordings: Sequence[Recording]) -> list[RunUp]:
    """Return the run-ups of some recordings, each up to where its steady windows begin.

    So they share no sample with the steady samples, and the errors of both are independent.
    """
    found = []
    for number, recording in enumerate(recordings):
        parts = []
        for stretch in constant_stretches(recording):
            windows = steady_windows(recording, stretch)
            parts.append(Stretch(stretch.begin, windows[-1].begin if windows else stretch.end))
        runs = [run for part in parts if (run := _run_up(number, recording, part)) is not None]
        found += _pooled(runs, recording.rounding_error)
    return found


def _run_up(number: int, recording: Recording, part: Stretch) -> RunUp | None:
    begin, end = part.begin, part.end
    if end - begin < 2 * BATCHES:
        return None
    quarters = quarter_speeds(recording, begin, end)
    direction = 1 if quarters[-1] > 0.0 else -1
    quarters = direction * quarters
    if quarters.min() < SLOWEST or abs(quarters[-1] - quarters[0]) < SMALLEST_CHANGE * quarters.max():
        return None
    time, current = recording.time[begin:end] - recording.time[begin], direction * recording.current[begin:end]
    batches = np.array([batch.mean() for batch in np.array_split(current, BATCHES)])
    if recording.angle is not None:
        chosen = np.unique(np.linspace(0, end - begin - 1, POINTS).astype(int))
        values = direction * (recording.angle[begin:end] - recording.angle[begin])[chosen]
        times, error = time[chosen], recording.angle_step / np.sqrt(12.0)
    else:
        speed = direction * (recording.speed[begin:end] if recording.speed is not None else np.zeros(0))
        groups = np.array_split(np.arange(end - begin), min(POINTS, end - begin))
        values = np.array([speed[g].mean() for g in groups])
        times = np.array([time[g].mean() for g in groups])
        error = float(np.std(np.diff(speed))) / np.sqrt(2.0 * len(groups[0]))
    duration = float(time[-1])
    return RunUp(
        recording=number,
        direction=direction,
        time=times,
        values=values,
        angular=recording.angle is not None,
        error=max(float(error), 1e-9 * float(np.max(np.abs(values)))),
        current=float(current.mean()),
        current_error=float(np.std(batches, ddof=1) / np.sqrt(BATCHES)),
        speed=float(quarters.mean()),
        acceleration=float((quarters[-1] - quarters[0]) / (0.75 * duration)),
    )


def _pooled(runs: list[RunUp], rounding: float) -> list[RunUp]:
    """Return the run-ups of one recording with the noise of their currents pooled, and the converter's `rounding`."""
    if not runs:
        return []
    durations = np.array([run.time[-1] for run in runs])
    density = float(np.mean([run.current_error**2 for run in runs] * durations))
    floor = 1e-6 * max(abs(run.current) for run in runs)
    errors = np.hypot(np.maximum(np.sqrt(density / durations), floor), rounding)
    return [
        RunUp(**{**vars(run), "current_error": float(error)}) for run, error in zip(runs, errors.tolist(), strict=True)
    ]
