"""Plays recorded signals behind pythonfmu: what an FMU made of a log runs. Standard library only.

The record lies beside this module: `record.json` says how to read it, `record.bin` holds the times (s), then each
signal's values, as little-endian float64.
"""

import json
import sys
from array import array
from bisect import bisect_right
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pythonfmu import Fmi2Slave
from pythonfmu.enums import Fmi2Status

from .exit_guard import guard_exit

TOLERANCE = 0.5e-9
"""Times that differ by less are one, in s: a log counts nanoseconds."""


class Record:
    """A record in memory; loaded once per process."""

    def __init__(self, folder: Path):
        head = json.loads((folder / "record.json").read_text(encoding="utf-8"))
        self.name: str = head["name"]
        self.linear: list[bool] = head["linear"]
        numbers = array("d")
        numbers.frombytes((folder / "record.bin").read_bytes())
        if sys.byteorder == "big":
            numbers.byteswap()
        rows: int = head["rows"]
        self.times = numbers[:rows]
        self.columns = [numbers[rows * k : rows * (k + 1)] for k in range(1, len(self.linear) + 1)]

    def at(self, time: float) -> list[float]:
        """Return the signals at a time in s: held, or linear between two rows; constant outside the record."""
        last = max(bisect_right(self.times, time + TOLERANCE) - 1, 0)
        row = [column[last] for column in self.columns]
        past = time - self.times[last]
        if past > TOLERANCE and last + 1 < len(self.times):
            share = past / (self.times[last + 1] - self.times[last])
            for k, (linear, column) in enumerate(zip(self.linear, self.columns, strict=True)):
                if linear:
                    row[k] += share * (column[last + 1] - column[last])
        return row


class ReplaySlave(Fmi2Slave):  # type: ignore[misc]
    """One instance; a subclass names its `record`."""

    record: Record

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.modelName = self.record.name
        self._time = 0.0
        self._row = self.record.at(0.0)
        self._warned = False
        if self.resources:
            guard_exit(self.resources, "linux64", self.record.name)

    def setup_experiment(self, start_time: float, *_: Any) -> None:
        """Take the start time in s."""
        self._go(start_time)

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Show the signals at the end of the step; times and step in s."""
        self._go(current_time + step_size)
        if self._time > self.record.times[-1] + TOLERANCE and not self._warned:
            self._warned = True
            self.log(f"the record ends at {self.record.times[-1]:g} s; its last values stay", Fmi2Status.warning)
        return True

    def _go(self, time: float) -> None:
        self._time, self._row = time, self.record.at(time)

    def get_real(self, vrs: Sequence[int]) -> list[float]:
        """Return Real values by value reference."""
        return [self._row[vr] for vr in vrs]

    def get_integer(self, vrs: Sequence[int]) -> list[int]:
        """Return Integer values by value reference."""
        return [int(self._row[vr]) for vr in vrs]

    def get_boolean(self, vrs: Sequence[int]) -> list[bool]:
        """Return Boolean values by value reference."""
        return [self._row[vr] != 0.0 for vr in vrs]

    def _get_fmu_state(self) -> dict[str, Any]:
        return {"time": self._time, "warned": self._warned}

    def _set_fmu_state(self, state: dict[str, Any]) -> None:
        self._go(state["time"])
        self._warned = state["warned"]
