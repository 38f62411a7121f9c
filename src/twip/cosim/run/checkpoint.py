"""The whole state of a run in one file: written every now and then and on Ctrl-C, read to go on from there.

The file is a zip archive: `checkpoint.json` (the format, what the run is, finished steps), `values`, `samples` and
`delayed` (float64, little endian), and `states/<i>`, the serialized state of the i-th component. The same state gives
the same bytes.
"""

import hashlib
import json
import math
import os
import pathlib
import zipfile
import zlib
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ...errors import TwipError
from ...outputs import replacing
from ..coupling.coupling import Coupling
from ..model.signals import columns
from ..model.system import System
from ..model.time_grid import TimeGrid
from ..scenario.inputs import InputSeries
from ..scenario.plan import Scenario
from ..values.strings import number_of, text_of

FORMAT = "twip.checkpoint 2"
_ROUNDING = 1e-6
"""Share of a step by which a time may be missed and count as reached."""
_BLOCK = 10_000

Identity = dict[str, object]
"""What must be the same in a run that goes on, by a name for messages; values are those of JSON."""


@dataclass(frozen=True)
class Checkpoint:
    """The state of a run between two steps."""

    identity: Identity
    steps: int
    """Finished steps since the start time."""
    inputs: str
    """SHA-256 of the driven values that these steps used."""
    values: NDArray[np.float64]
    """The row of the last finished step, hidden columns included (columns,)."""
    samples: NDArray[np.float64]
    """What copies to the middle of a step remember (4, copies); see `Execution`."""
    delayed: NDArray[np.float64]
    """What faults of the scenario hold back, the histories of all delays one after the other."""
    states: tuple[bytes, ...]
    """Serialized states of the components, in the order of the file."""
    texts: dict[int, str] = field(default_factory=dict)
    """The values of String variables by column; `values` has zeros there."""

    @property
    def row(self) -> NDArray[np.float64]:
        """The row of the last finished step as the vector holds it (columns,)."""
        row = self.values.copy()
        for column, text in self.texts.items():
            row[column] = number_of(text)
        return row

    def write(self, path: pathlib.Path) -> None:
        """Replace the file at `path` in one go: a reader finds the old or the new one. Raises `TwipError`."""
        header = {
            "format": FORMAT,
            "identity": self.identity,
            "steps": self.steps,
            "inputs": self.inputs,
            "sizes": self._sizes(),
        } | ({"texts": {str(column): text for column, text in self.texts.items()}} if self.texts else {})
        members = {
            "checkpoint.json": json.dumps(header, indent=1, sort_keys=True).encode(),
            "values": self.values.astype("<f8").tobytes(),
            "samples": self.samples.astype("<f8").tobytes(),
            "delayed": self.delayed.astype("<f8").tobytes(),
            **{f"states/{i}": state for i, state in enumerate(self.states)},
        }
        with replacing(path) as stream, zipfile.ZipFile(stream, "w") as archive:
            for name, data in members.items():
                archive.writestr(zipfile.ZipInfo(name), data)

    def _sizes(self) -> list[int]:
        return [len(self.values), self.samples.shape[1], len(self.delayed), len(self.states)]

    @classmethod
    def read(cls, path: pathlib.Path) -> "Checkpoint":
        """Read a checkpoint. Raises `TwipError` for a file that is none, or of another format."""
        try:
            with zipfile.ZipFile(path) as archive:
                members = archive.infolist()
                if sum(m.file_size for m in members) > path.stat().st_size or any(m.compress_type for m in members):
                    raise ValueError("its members are compressed or overlap")
                header = json.loads(archive.read("checkpoint.json"))
                if header["format"] != FORMAT:
                    raise TwipError(f"checkpoint {path} has the format {header['format']!r}, not {FORMAT!r}")
                states = sum(name.startswith("states/") for name in archive.namelist())
                found = cls(
                    dict(header["identity"]),
                    int(header["steps"]),
                    str(header["inputs"]),
                    np.frombuffer(archive.read("values"), "<f8").astype(np.float64),
                    np.frombuffer(archive.read("samples"), "<f8").astype(np.float64).reshape(4, -1),
                    np.frombuffer(archive.read("delayed"), "<f8").astype(np.float64),
                    tuple(archive.read(f"states/{i}") for i in range(states)),
                    {int(column): str(text) for column, text in header.get("texts", {}).items()},
                )
            if not all(0 <= column < len(found.values) for column in found.texts):
                raise ValueError("a text is out of place")
            if found._sizes() != header["sizes"]:
                raise ValueError("something is missing")
            return found
        except OSError as error:
            raise TwipError(f"checkpoint {path} cannot be read ({error.strerror or error})") from None
        except (zipfile.BadZipFile, KeyError, ValueError, TypeError, NotImplementedError, RuntimeError) as error:
            raise TwipError(f"{path} is not a readable checkpoint ({error})") from None

    def check(self, path: pathlib.Path, identity: Identity, grid: TimeGrid, inputs: InputSeries) -> None:
        """Raise `TwipError` with a line for everything in which the run that is to go on differs from this one."""
        problems = [f"{path}: {line}" for line in _differences(identity, self.identity)]
        if not problems and self.steps >= grid.steps:
            reached = float(grid.times(self.steps, 0)[0])
            problems.append(f"{path}: the run is at {reached:.12g} s, the stop time must be later than that")
        if not problems and InputDigest(inputs, grid).until(self.steps) != self.inputs:
            problems.append(f"{path}: the inputs up to the checkpoint have other values than in the run it belongs to")
        if problems:
            raise TwipError(problems)


def _differences(here: Identity, there: Identity) -> list[str]:
    lines = []
    for name in sorted({*here, *there}):
        own, other = (_shown(side[name]) if name in side else "not given" for side in (here, there))
        if own != other:
            lines.append(f"{name} differs: {own} here, {other} in the checkpoint")
    return lines


def _shown(value: object) -> str:
    return (", ".join(map(str, value)) or "none") if isinstance(value, list) else str(value)


def identify(system: System, grid: TimeGrid, coupling: Coupling, scenario: Scenario) -> Identity:
    """Return what makes a run this run and no other."""
    names = system.columns
    components = [component.name for component in system.components]
    signals = [signal for channel in system.channels for signal in channel.signals]
    result: Identity = {
        "system": system.name,
        "start time [s]": grid.start,
        "step size [s]": grid.step_size,
        **coupling.identity(),
        "list of inputs with time series": sorted(names[column] for column in scenario.inputs.columns),
        **scenario.described(),
        "order of the components": components,
        "list of system connectors": columns([c for c in system.channels if c.component not in components]),
    }
    for component in system.components:
        result[f"FMU of {component.name}"] = component.fmu.sha256
        for start in component.start_values:
            result[f"start value {component.name}.{start.variable.name}"] = start.value
    for connector in system.open_connectors:
        if connector.start is not None:
            is_text = signals[connector.column].type == "String"
            result[f"start value {names[connector.column]}"] = text_of(connector.start) if is_text else connector.start
    for copy in system.copies:
        affine, mapping = copy.conversion.affine, copy.conversion.mapping
        mapped = "" if mapping is None else f" by {sorted(mapping.table.items())}, {mapping.keeps}"
        result[f"connection to {names[copy.destination]}"] = (
            f"{names[copy.source]} * {affine.factor!r} + {affine.offset!r}{mapped}"
        )
    for link in system.parameter_links:
        result[f"connection to {link.component}.{link.variable.name}"] = f"{names[link.source]} {link.conversion!r}"
    return result


class InputDigest:
    """Fingerprint of the driven values from the start time on; each step is looked at once."""

    def __init__(self, inputs: InputSeries, grid: TimeGrid):
        self._inputs = inputs
        self._grid = grid
        self._steps = 0
        self._hash = hashlib.sha256()

    def until(self, steps: int) -> str:
        """Return the fingerprint of what the first `steps` steps used; `steps` must not decrease from call to call."""
        while self._steps < steps:
            count = min(_BLOCK, steps - self._steps)
            times = self._grid.times(self._steps, count)[:-1]
            values = self._inputs.at(times, self._grid.step_size).astype("<f8")
            for column in self._inputs.texts:
                values[:, column] = [
                    zlib.crc32(text_of(number).encode("utf-8", "replace")) for number in values[:, column]
                ]
            self._hash.update(values.tobytes())
            self._steps += count
        return self._hash.hexdigest()


@dataclass(frozen=True)
class Saving:
    """Where a run is saved, and how often."""

    path: pathlib.Path
    every: float | None
    """Steps between two checkpoints, at least 1; None for the end of the run only."""

    @classmethod
    def of(cls, system: System, path: str | os.PathLike[str], every: float | None, step_size: float) -> "Saving":
        """Check whether the run can be saved at `path` every `every` s. Raises `TwipError` with a line per problem."""
        file = pathlib.Path(path)
        problems = cannot_be_saved(system)
        if every is not None and not (math.isfinite(every) and every > 0.0):
            problems.append(f"checkpoint interval {every!r} s must be a positive number")
        if file.is_dir():
            problems.append(f"checkpoint {file} cannot be written: it is a folder")
        try:
            file.parent.mkdir(parents=True, exist_ok=True)
            if not os.access(file.parent, os.W_OK):
                problems.append(f"checkpoint {file} cannot be written: its folder is read-only")
        except FileExistsError:
            problems.append(f"checkpoint {file} cannot be written: its folder is a file")
        except OSError as error:
            problems.append(f"checkpoint {file} cannot be written ({error.strerror or error})")
        if problems:
            raise TwipError(problems)
        return cls(file, None if every is None else max(every / step_size, 1.0))

    def next(self, steps: int, last: int) -> int:
        """Return after how many steps, more than `steps` and at most `last`, the run is to be saved next."""
        if self.every is None:
            return last
        multiple = int(steps / self.every)
        while (due := math.ceil(multiple * self.every - _ROUNDING)) <= steps:
            multiple += 1
        return min(due, last)


def cannot_be_saved(system: System) -> list[str]:
    """Return a line for each component whose FMU cannot give away its state."""
    return [
        f"{c.name}: FMU {c.fmu.name} cannot serialize its state (canSerializeFMUstate), which a checkpoint needs"
        for c in system.components
        if not c.fmu.serializes_state
    ]
