"""The bench experiments of paper section 2, run through the bench and motor FMUs and logged as they are measured."""

import csv
import io
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

import numpy as np

from ...cosim import Attachment, Inputs, McapLog, Observer, Table, TimeGrid, columns, load, simulate
from ...outputs import write_file
from ...robot import value
from .recording import Array
from .sensor import CHANNEL, MeasuredSink, Sensor

ZERO_TIME = 4.0
"""Time at the beginning of each experiment in which the motor is switched off, in s: it tells the current's zero."""
DWELL = 6.0
"""Time for which a current is kept, in s: five time constants of the slowest shaft, 1.2 s."""
FRICTION_NAMES = (
    "coulomb_forward", "coulomb_reverse", "static_forward", "static_reverse", "viscous_forward", "viscous_reverse",
)  # fmt: skip


@dataclass(frozen=True)
class Experiment:
    """What is commanded: `steps` of (duration [s], command), the command a current [A] or a voltage [V]."""

    name: str
    steps: tuple[tuple[float, float], ...]
    by_current: bool = True

    @property
    def duration(self) -> float:
        """Time of all steps, in s."""
        return float(round(sum(duration for duration, _ in self.steps), 9))

    def write(self, path: Path) -> None:
        """Write the input series for `ssp/bench.ssp`, two rows at each jump."""
        name = "bench.current_command" if self.by_current else "bench.voltage_command"
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(["time", name])
        begin = 0.0
        for duration, command in self.steps:
            end = round(begin + duration, 9)
            writer.writerows([(repr(begin), repr(command)), (repr(end), repr(command))])
            begin = end
        write_file(path, text.getvalue().encode())


def both_ways(steps: Sequence[tuple[float, float]]) -> tuple[tuple[float, float], ...]:
    """Return the motor switched off to find the current's zero, then the steps, first forward and then in reverse."""
    return ((ZERO_TIME, 0.0), *steps, (3.0, 0.0), *((duration, -command) for duration, command in steps), (2.0, 0.0))


def staircase(lowest: float = 0.06, highest: float = 0.12, step: float = 0.01) -> Experiment:
    """Return a staircase of currents [A] in both directions: Figs 2 and 3."""
    levels = np.round(np.arange(lowest, highest + 0.5 * step, step), 9).tolist()
    return Experiment("staircase", both_ways([(DWELL, level) for level in levels]))


def run_up(current: float = 0.07) -> Experiment:
    """Return run-ups from rest at a constant current [A] in both directions: Fig 4."""
    return Experiment("run_up", both_ways([(DWELL, current)]))


def low_speeds(coulomb: Sequence[float], torque_constant: float, resistance: float) -> Experiment:
    """Return a fine staircase of voltages about what it takes to overcome `coulomb` [N.m], forward and reverse: speeds
    about the Stribeck speed.

    Voltage drive, because a current alone does not hold a speed on a falling friction curve; the back-EMF does. A
    motor starts at the highest voltage and slows down, so that static friction does not hold it.
    """
    shares = np.arange(1.4, 0.739, -0.02)
    forward, reverse = (np.round(resistance * limit / torque_constant * shares, 5).tolist() for limit in coulomb)
    steps = [(ZERO_TIME, 0.0), *((2.5, level) for level in forward), (3.0, 0.0), *((2.5, -level) for level in reverse)]
    return Experiment("low_speeds", (*steps, (2.0, 0.0)), by_current=False)


def held_out() -> Experiment:
    """Return an experiment that no fit sees: other currents [A], short, with reversals at full speed."""
    levels = (0.075, 0.105, 0.085, -0.095, -0.075, -0.115, 0.095, 0.115, -0.085)
    return Experiment("held_out", tuple((1.5, level) for level in levels))


@dataclass(frozen=True)
class Bench:
    """The bench's SSP at `ssp` with one motor on it: `start_values` by `component.variable`."""

    ssp: Path
    start_values: Mapping[str, float]

    def run(
        self,
        experiment: Experiment,
        folder: Path,
        log: Path | None = None,
        sensor: Sensor | None = None,
        notice: Callable[[str], None] | None = None,
    ) -> Table:
        """Run an experiment and return the true signals; `log` takes them as MCAP, with the readings of the `sensor`.

        The input series is written to `folder`. Raises KeyboardInterrupt.
        """
        series = folder / f"{experiment.name}.csv"
        experiment.write(series)
        values = {**self.start_values, "bench.current_drive": experiment.by_current}
        with load(self.ssp, start_values=values) as system:
            table = Table(system.channels)
            names = columns(system.channels)

            def sinks(grid: TimeGrid) -> list[Table | McapLog | MeasuredSink]:
                if log is None:
                    return [table]
                metadata = {**system.provenance(), "run": {"experiment": experiment.name, "twip": version("twip")}}
                attachments = [Attachment.file(self.ssp), Attachment.file(series)]
                if sensor is None:
                    return [table, McapLog(log, system.channels, metadata, attachments, start_time=grid.start)]
                channels = [*system.channels, CHANNEL]
                file = McapLog(log, channels, metadata, attachments, start_time=grid.start)
                where = names.index("motor.current"), names.index("bench.shaft_angle")
                return [table, MeasuredSink(file, sensor, *where)]

            result = simulate(
                system,
                stop_time=experiment.duration,
                inputs=Inputs(file=series),
                sinks=sinks,
                observer=Observer(notice=notice),
            )
        if result.interrupted:
            raise KeyboardInterrupt
        return table


def motor_values(side: str, changes: Mapping[str, float] | None = None) -> dict[str, float]:
    """Return the bench's start values for one side's motor, the nominal inertia, and `changes` by parameter name."""
    found = {name: value(f"{side}.{name}") for name in FRICTION_NAMES}
    found |= {name: value(name) for name in ("stribeck_speed", "bench_inertia")} | dict(changes or {})
    return {f"{'bench' if name == 'bench_inertia' else 'motor'}.{name}": number for name, number in found.items()}


def speed_error(truth: Table, model: Table) -> float:
    """Return the root mean square difference of the shaft speeds of two runs of one experiment, in rad/s."""
    difference: Array = truth["bench.shaft_speed"] - model["bench.shaft_speed"]
    return float(np.sqrt(np.mean(difference**2)))
