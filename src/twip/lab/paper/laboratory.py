"""Where the experiments run: the built robot, the seeds, and the folder that takes pictures and inputs."""

import csv
import io
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...cosim import Inputs, load, simulate
from ...outputs import write_file

Array = NDArray[np.float64]

KEPT = (
    "plant.pitch", "plant.pitch_rate", "plant.yaw", "plant.yaw_rate", "plant.wheel_rate", "plant.wheel_acceleration",
    "plant.x", "plant.ground_slope", "plant.fallen", "left.encoder_count", "right.encoder_count",
    "imu.accel_x", "imu.accel_z",
    "estimator.pitch", "estimator.pitch_arcsin", "estimator.pitch_arctan", "estimator.pitch_gyro",
    "estimator.pitch_lever_arm", "estimator.pitch_low_pass", "estimator.pitch_lever_arm_low_pass",
    "controller.left.voltage", "controller.right.voltage", "controller.pitch_offset",
)  # fmt: skip
"""Columns of a run that the figures use; the rest is dropped, for many runs are held at a time."""


@dataclass(frozen=True)
class Run:
    """What one run left: `run["plant.pitch"]` is an array over `run.times` in s, SI units."""

    times: Array
    columns: Mapping[str, Array]

    def __getitem__(self, name: str) -> Array:
        return self.columns[name]

    def degrees(self, name: str) -> Array:
        """Return a column of angles in degrees."""
        return np.degrees(self.columns[name])

    def during(self, begin: float, end: float = np.inf) -> "Run":
        """Return the part of the run between two times in s, both included."""
        kept = (self.times >= begin - 1e-9) & (self.times <= end + 1e-9)
        return Run(self.times[kept], {name: column[kept] for name, column in self.columns.items()})

    def sampled(self, period: float = 0.005) -> "Run":
        """Return the rows at multiples of `period` s: where sensor and estimator act, their outputs are not yet old."""
        ticks = self.times / period
        kept = np.abs(ticks - np.rint(ticks)) < 1e-6
        return Run(self.times[kept], {name: column[kept] for name, column in self.columns.items()})

    @cached_property
    def fallen(self) -> bool:
        """Tells whether the robot fell."""
        return bool(np.any(self["plant.fallen"] > 0.5))


@dataclass(frozen=True)
class Experiment:
    """One run of the robot but for its seed: what differs from the SSP as it stands, times in s."""

    stop_time: float
    start_values: Mapping[str, float] = field(default_factory=dict)
    parameters: Sequence[str] = ()
    """Names of parameter sets in `ssp/parameters`."""
    inputs: str | None = None
    """Name of a CSV file in `ssp/inputs`, or of one that `Laboratory.write_input` has written."""

    def command(self, seed: int = 1) -> str:
        """Return the command that repeats the run, from the project's root."""
        words = ["twip", "run", "ssp/twip.ssp", "--stop-time", f"{self.stop_time:g}"]
        if self.parameters:
            words += ["--parameters", *(f"ssp/parameters/{name}.ssv" for name in self.parameters)]
        if self.inputs is not None:
            words += ["--input-file", self.inputs]
        words += ["--start-values", "imu.seed", str(seed)]
        for name, value in self.start_values.items():
            words += [name, f"{value:.10g}"]
        return shlex.join(words)


@dataclass(frozen=True)
class Laboratory:
    """The built robot below `built` (folders `fmus`, `ssp`), and the folder `out` for what the experiments write."""

    built: Path
    out: Path
    seeds: int = 20
    """Runs with different sensor noise behind every statistic; their seeds are 1, 2, …"""

    def run(self, experiment: Experiment, seed: int = 1) -> Run:
        """Do one run through the FMUs and the master."""
        files = [self.built / "ssp" / "parameters" / f"{name}.ssv" for name in experiment.parameters]
        values: dict[str, float | int] = {"imu.seed": seed, **experiment.start_values}
        with load(self.built / "ssp" / "twip.ssp", parameters=files, start_values=values) as system:
            result = simulate(
                system, stop_time=experiment.stop_time, inputs=Inputs(file=self._input(experiment.inputs))
            )
        if result.interrupted:
            raise KeyboardInterrupt
        return Run(result.times, {name: result[name] for name in KEPT})

    def runs(self, experiment: Experiment, seeds: int | None = None) -> list[Run]:
        """Repeat an experiment with the seeds 1, 2, …; `seeds` of them, or as many as the laboratory has if fewer."""
        count = self.seeds if seeds is None else min(seeds, self.seeds)
        return [self.run(experiment, seed) for seed in range(1, count + 1)]

    def write_input(self, name: str, columns: Mapping[str, Array]) -> str:
        """Write an input series (`time` in s first, then `component.variable`) as CSV and return its name.

        Numbers have nine significant digits.
        """
        path = self.out / "inputs" / name
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows([f"{value:.9g}" for value in row] for row in zip(*columns.values(), strict=True))
        write_file(path, text.getvalue().encode())
        return str(path)

    def _input(self, name: str | None) -> Path | None:
        if name is None:
            return None
        path = Path(name)
        return path if path.is_file() else self.built / path
