"""Inputs that somebody sets while a system runs: a keyboard, a viewer.

A value counts from the next chunk of steps on (a run in real time has one every 10 ms), and holds until it is set
again. What was set stands in the log with the other inputs.
"""

from collections.abc import Collection, Sequence
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from ..errors import TwipError
from . import several
from .inputs import InputSeries, find_target
from .scalar_types import misfit
from .system import System


class LiveInputs:
    """Values of open inputs of a system, by `component.variable` or system connector; any thread may set them."""

    def __init__(self, system: System, names: str | Sequence[str]) -> None:
        """Take over these inputs, at their start values; raises TwipError that names all that cannot be driven."""
        names = several.names("names", names)
        targets = {name: find_target(system, name) for name in names}
        problems = [target for target in targets.values() if isinstance(target, str)]
        found = {name: target for name, target in targets.items() if not isinstance(target, str)}
        problems += [f"{name} is a String and cannot be set live" for name, t in found.items() if t.type == "String"]
        if problems:
            raise TwipError("\n".join(problems))
        self.names = names
        self._types = {name: target.type for name, target in found.items()}
        self._lock = Lock()
        self._values = np.array([start_value(system, name) for name in names])
        self._columns = np.array([found[name].column for name in names], np.int32)

    def __getitem__(self, name: str) -> float:
        """Return the present value of an input."""
        with self._lock:
            return float(self._values[self.names.index(name)])

    def __setitem__(self, name: str, value: float) -> None:
        """Set an input; raises TwipError for a name that is not among `names` and a value that it cannot take."""
        if name not in self.names:
            raise TwipError(f"there is no input {name} to set, only {', '.join(self.names) or 'none'}")
        if why := misfit(self._types[name], value):
            raise TwipError(f"{name} cannot take {value}, {why}")
        with self._lock:
            self._values[self.names.index(name)] = value

    def at(self, times: NDArray[np.float64], step_size: float) -> NDArray[np.float64]:  # noqa: ARG002
        """Return the present values (len(times), n), held; see `Series.at`."""
        with self._lock:
            return np.tile(self._values, (len(times), 1))

    def events(self) -> NDArray[np.float64]:
        """Return no times: nobody knows when a value will be set."""
        return np.zeros(0)

    def leave(self, columns: Collection[int]) -> None:
        """Leave inputs to somebody else, by their columns in the recorded table."""
        keep = np.array([column not in columns for column in self._columns.tolist()], np.bool_)
        with self._lock:
            self.names = tuple(name for name, kept in zip(self.names, keep.tolist(), strict=True) if kept)
            self._values, self._columns = self._values[keep], self._columns[keep]

    def series(self) -> InputSeries:
        """Return what a run takes."""
        return InputSeries(self._columns, (self,))


def open_inputs(system: System) -> list[str]:
    """Return the names of all Real inputs that nothing inside the system feeds."""
    targets = {name: find_target(system, name) for name in system.columns}
    return [name for name, found in targets.items() if not isinstance(found, str) and found.type in ("Real", "Float64")]


def start_value(system: System, name: str) -> float:
    """Return the value of an open input before anybody drives it, in the unit of the variable; 0 if none is given."""
    for connector in system.open_connectors:
        if system.columns[connector.column] == name:
            return connector.start or 0.0
    for component in system.components:
        variable = name.removeprefix(f"{component.name}.")
        texts = [start.value for start in component.start_values if start.variable.name == variable]
        texts += [v.start for v in component.inputs if v.name == variable and v.start is not None]
        if name != variable and texts:
            return float({"true": 1.0, "false": 0.0}.get(str(texts[0]), texts[0]))
    return 0.0
