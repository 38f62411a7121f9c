"""The yardstick of the coupling: the closed loop as one simulation, with the controller's ticks.

Motors and mechanics are one system of equations (`monolithic_events`) that shares no code with the blocks, only the
nominal parameters. The controller is the block's own: it is a sampled algorithm and not under test.

Tick rule: the controller samples the true state at t_k and its voltage acts from t_k on, as in the robot's own
Gauss–Seidel order (motors, plant, sensor, estimator, controller). t_k = k T_s; if T_s is not a multiple of the
communication step, a tick waits for the step's end. Jacobi coupling over the whole chain has one step between sample
and voltage, which `delay` stands for.
"""

from dataclasses import dataclass
from math import ceil

import numpy as np
from monolithic_events import (
    GEAR,
    LEFT,
    PITCH,
    RADIUS,
    RATE,
    RIGHT,
    TRACK,
    YAW,
    Array,
    contact_rows,
    next_mode,
    parameters,
    record,
)
from plain import instance, load

STEP = 1.25e-5
"""Longest step of integration, in s: a third of the windings' time constant."""
SAMPLE_TIME = 0.005
"""The controller's, in s."""
MICROSECOND = 1e-6


@dataclass(frozen=True)
class Scenario:
    """What the robot does, from rest or rolling, with the true state fed back."""

    duration: float
    """In s."""
    pitch_start: float
    """In rad."""
    wheel_rate_start: float = 0.0
    """In rad/s; the body does not turn."""
    controller: tuple[tuple[str, float], ...] = ()
    """Parameters of the controller by name; nominal else, and without rest."""
    references: tuple[tuple[float, str, float], ...] = ()
    """Steps of the controller's references: time in s, name, value from then on."""


@dataclass(frozen=True)
class Solution:
    """What the reference gives."""

    spacing: float
    """Time between two rows, in s."""
    states: Array
    """States (rows, 8), see `monolithic_events`."""
    voltages: Array
    """Voltages of the left and the right motor from each row on, (rows, 2)."""
    events: int
    """How often friction changed its mode."""

    def at(self, step_size: float, place: int) -> Array:
        """Return one component of the state at the multiples of `step_size`, a multiple of the spacing."""
        every = round(step_size / self.spacing)
        assert abs(every * self.spacing - step_size) < 1e-9 * step_size
        return self.states[::every, place]


def solve(
    scenario: Scenario,
    *,
    communication_step: float | None = None,
    delay: float = 0.0,
    step: float = STEP,
    spacing: float = 5e-5,
    **changes: float,
) -> Solution:
    """Solve a scenario; `changes` are parameters of the robot that differ from the nominal ones.

    All times are multiples of `spacing`, at which the states are kept. Without `communication_step` every T_s is a
    tick. The controller's integrals begin with a sample of length `communication_step`, so their first error should
    be zero.
    """
    p = parameters(**changes)
    y = np.zeros(8)
    y[PITCH] = scenario.pitch_start
    y[LEFT] = y[RIGHT] = p[GEAR] * scenario.wheel_rate_start
    contacts = np.array([row @ y[LEFT : RATE + 1] for row in contact_rows(p)])
    mode = next_mode(y, p, np.sign(contacts), contacts == 0.0)

    def rows(time: float) -> int:
        count = round(time / spacing)
        assert abs(count * spacing - time) < 1e-3 * MICROSECOND, f"{time} s is no multiple of {spacing} s"
        return count

    end, late = rows(scenario.duration), rows(delay)
    sample, grid = rows(SAMPLE_TIME), rows(communication_step or SAMPLE_TIME)
    ticks = {ceil(k * sample / grid) * grid for k in range(end // sample + 1)}
    face = load("controller").BLOCK
    controller = instance(
        face, rest_time=0.0, sample_time=SAMPLE_TIME, sample_offset=grid * spacing, **dict(scenario.controller)
    )
    face.initialize(controller, 0.0)
    commands: dict[int, tuple[float, float]] = {}
    states, voltages = np.empty((end + 1, 8)), np.zeros((end + 1, 2))
    states[0] = y
    instants = sorted({0, end} | ticks | {t + late for t in ticks})
    instants = [t for t in instants if t <= end]
    voltage, events, substeps = np.zeros(2), 0, ceil(spacing / step - 1e-9)
    for now, until in zip(instants, [*instants[1:], end], strict=True):
        if now in ticks:
            for time, name, number in scenario.references:
                if rows(time) <= now:
                    setattr(controller, name, number)
            commands[now + late] = command(face, controller, y, p, now * spacing, grid * spacing)
        voltage[:] = commands.pop(now, voltage)
        voltages[now : until + 1] = voltage
        found = record(
            y, p, mode, voltage, spacing / substeps, (until - now) * substeps, substeps, states[now + 1 : until + 1]
        )
        assert found >= 0, f"events of friction accumulate after {now * spacing} s"
        events += found
    return Solution(spacing, states, voltages, events)


def command(face: object, controller: object, y: Array, p: Array, time: float, grid: float) -> tuple[float, float]:
    """Return the voltages that the controller commands when it sees the state `y` at a tick."""
    n = p[GEAR]
    seen = {
        "pitch": y[PITCH],
        "pitch_rate": y[RATE],
        "wheel_rate": 0.5 * (y[LEFT] + y[RIGHT]) / n + y[RATE],
        "yaw": y[YAW],
        "yaw_rate": p[RADIUS] / p[TRACK] * (y[RIGHT] - y[LEFT]) / n,
        "left_shaft_speed": y[LEFT],
        "right_shaft_speed": y[RIGHT],
    }
    for name, number in seen.items():
        setattr(controller, name, float(number))
    before = controller.ticks
    face.step(controller, time, grid)
    assert controller.ticks > before, f"the controller does not act at {time} s"
    return controller.left_voltage, controller.right_voltage
