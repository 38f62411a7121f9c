"""Inputs that somebody sets while a system runs: a keyboard, a viewer.

A value counts from the next chunk of steps on (a run in real time has one every 10 ms), and holds until it is set
again. What was set stands in the log with the other inputs. A value must be one of the variable's type (a number,
`True` and `False` for a Boolean alone) within the bounds that it declares; on a side where a Real declares none, within
`MOST_NOMINALS` times its nominal value. What is refused leaves the input as it is, and the run goes on.
"""

import math
import sys
from collections.abc import Collection, Sequence
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from ...errors import TwipError, UnknownNameError
from ..model.system import System
from ..reading import arguments
from ..reading.wording import nearest
from ..values.types import family
from ..values.variable import Variable
from ..values.written import cannot_travel
from .inputs import InputSeries, find_target

MOST_NOMINALS = 1e12
"""Largest magnitude of a value without a declared bound, in nominal values: more is a slip and would overflow."""
MOST_REFUSALS = 20
"""Different refusals that are told at once, for each of them."""


class LiveInputs:
    """Values of open inputs of a system, by `component.variable` or system connector; any thread may set them."""

    def __init__(self, system: System, names: str | Sequence[str]) -> None:
        """Take over these inputs, at their start values; raises TwipError that names all that cannot be driven."""
        names = arguments.names("names", names)
        targets = {name: find_target(system, name) for name in names}
        problems = [target for target in targets.values() if isinstance(target, str)]
        found = {name: target for name, target in targets.items() if not isinstance(target, str)}
        problems += [f"{name} is a String and cannot be set live" for name, t in found.items() if t.type == "String"]
        if problems:
            raise TwipError(problems)
        self.names = names
        self._targets = found
        self._lock = Lock()
        self._values = np.array([start_value(system, name) for name in names])
        self._columns = np.array([found[name].column for name in names], np.int32)
        self._limits = {name: limits(system, found[name].column) for name in names}
        self._refused: dict[str, None] = {}

    def __getitem__(self, name: str) -> float:
        """Return the present value of an input."""
        with self._lock:
            return float(self._values[self.names.index(name)])

    def present(self) -> dict[str, float]:
        """Return the present values of all inputs."""
        with self._lock:
            return dict(zip(self.names, self._values.tolist(), strict=True))

    def __setitem__(self, name: str, value: object) -> None:
        """Set an input; raises TwipError for a name that is not among `names` and a value that it cannot take."""
        if name not in self.names:
            only = ", ".join(self.names) or "none"
            raise UnknownNameError(
                f"there is no input {name} to set, only {only}", name=name, near=nearest(name, self.names, 3)
            )
        number = self._checked(name, value)
        with self._lock:
            self._values[self.names.index(name)] = number

    def offer(self, name: str, value: object) -> bool:
        """Set an input if it can take the value; else leave it, keep why for `refusals`, and return False."""
        try:
            self[name] = value
        except TwipError as error:
            with self._lock:
                if len(self._refused) < MOST_REFUSALS:
                    self._refused[f"refused, and left as it was: {error}"] = None
            return False
        return True

    def refusals(self) -> list[str]:
        """Return why values were refused since the last call, a sentence each."""
        with self._lock:
            told = list(self._refused)
            self._refused.clear()
        return told

    def _checked(self, name: str, value: object) -> float:
        """Return a value as a number that the input may take; raises TwipError."""
        target = self._targets[name]
        if not isinstance(value, int | float) or (isinstance(value, bool) and target.type != "Boolean"):
            why = "which is no number"
        elif isinstance(value, int) and abs(value) > sys.float_info.max:
            why = "which is beyond the range of float64"
        elif target.type == "Enumeration" and value not in dict(target.items).values():
            why = "which is no item of the enumeration"
        elif not (why := cannot_travel(target.type, value)):
            low, high = self._limits[name]
            why = f"which is below {low:g}" if value < low else f"which is above {high:g}" if value > high else ""
            if not why:
                return float(value)
        raise TwipError(f"{name} cannot take {value!r}, {why}")

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


def limits(system: System, column: int) -> tuple[float, float]:
    """Return the smallest and the largest value that an open input (its column in the recorded table) may be set to.

    Those of a connector of the outermost system come from all inputs that it feeds, in the connector's unit.
    """
    own = _input(system, column)
    found = [] if own is None else [_bounds(own)]
    for copy in system.copies:
        fed = _input(system, copy.destination)
        if copy.source == column and copy.conversion.mapping is None and fed is not None:
            low, high = sorted(copy.conversion.inverse(bound) for bound in _bounds(fed))
            found.append((low, high))
    if not found:
        return -MOST_NOMINALS, MOST_NOMINALS
    return max(low for low, _ in found), min(high for _, high in found)


def _input(system: System, column: int) -> Variable | None:
    """Return the input of a component that a column of the recorded table holds, None where it holds something else."""
    for component in system.components:
        place = column - system.first_column[component.name]
        if 0 <= place < len(component.inputs):
            return component.inputs[place]
    return None


def _bounds(variable: Variable) -> tuple[float, float]:
    """Return the bounds that a variable declares; a Real without them has far ones."""
    far = MOST_NOMINALS * (abs(variable.nominal) or 1.0) if family(variable.recorded_type) == "Real" else math.inf
    low = -far if variable.minimum is None else variable.minimum
    high = far if variable.maximum is None else variable.maximum
    return low, high


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
