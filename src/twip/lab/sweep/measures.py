"""How a run is judged: numbers by name or by a user's function, and the conditions that make it a success."""

import importlib.util
import math
import operator
import re
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...cosim import Table, did_you_mean
from ...errors import Problem, TwipError
from ..metrics import METRICS, is_robot, measure
from ..numbers import rms

ROBOT = "robot"
"""Stands for all metrics of the robot; the default where the system has its signals."""
REDUCTIONS: dict[str, Callable[[NDArray[np.float64]], float]] = {
    "final": lambda signal: float(signal[-1]),
    "min": lambda signal: float(np.min(signal)),
    "max": lambda signal: float(np.max(signal)),
    "peak": lambda signal: float(np.max(np.abs(signal))),
    "mean": lambda signal: float(np.mean(signal)),
    "rms": rms,
}
"""What can be asked of any recorded signal; `peak` is the largest magnitude."""
_COMPARISONS: dict[str, Callable[[float, float], bool]] = {
    "<=": operator.le, ">=": operator.ge, "==": operator.eq, "!=": operator.ne, "<": operator.lt, ">": operator.gt,
}  # fmt: skip
_CONDITION = re.compile(r"\s*(.+?)\s*(<=|>=|==|!=|<|>)\s*(\S+)\s*")
PASS, FAIL, DONE, ERROR = "pass", "fail", "done", "error"
"""Verdicts: all conditions met, or not; no conditions; the run or its judgement failed."""


class MetricError(TwipError):
    """A metric could not be computed."""


@dataclass(frozen=True)
class Condition:
    """`metric comparison limit`, such as `fallen == 0`."""

    metric: str
    comparison: str
    limit: float

    @classmethod
    def parse(cls, text: str) -> "Condition":
        """Return the condition that a text states. Raises `TwipError`."""
        match = _CONDITION.fullmatch(text)
        try:
            if match is None:
                raise ValueError
            return cls(match[1], match[2], float(match[3]))
        except ValueError:
            raise TwipError(f"condition {text!r} must be METRIC, one of < <= > >= == !=, and a number") from None

    def met(self, metrics: Mapping[str, float | None]) -> bool:
        """Tell whether the metrics of a run meet it; a missing number meets nothing."""
        value = metrics.get(self.metric)
        return value is not None and _COMPARISONS[self.comparison](value, self.limit)


class Judge:
    """Judges runs by the metrics and conditions of a plan. Raises `TwipError` for those that cannot be."""

    def __init__(self, metrics: Sequence[str], success: Sequence[str], columns: Sequence[str]):
        """Check everything against the recorded `columns` and load the user's functions."""
        robot = is_robot(list(columns))
        given = tuple(metrics) or ((ROBOT,) if robot else ())
        problems: list[str | Problem] = []
        self._measures: list[tuple[str, Callable[[Table], object]]] = []
        for name in dict.fromkeys(given):
            try:
                self._measures.append((name, _measure(name, columns, robot)))
            except TwipError as error:
                problems += error.problems
        conditions = tuple(success) or (("fallen == 0",) if ROBOT in given else ())
        self.conditions = []
        for text in conditions:
            try:
                self.conditions.append(Condition.parse(text))
            except TwipError as error:
                problems += error.problems
        if not problems and not self._measures:
            problems.append("no metrics: name some, such as max:COMPONENT.VARIABLE or FILE.py:FUNCTION")
        if not problems and self.names is not None:
            problems += self._unknown(self.names)
        if problems:
            raise TwipError(problems)

    @property
    def names(self) -> tuple[str, ...] | None:
        """Names of the metrics, None where a user's function tells its own."""
        if any(".py:" in name for name, _ in self._measures):
            return None
        return tuple(n for name, _ in self._measures for n in (("fallen", *METRICS) if name == ROBOT else (name,)))

    def metrics(self, table: Table) -> dict[str, float | None]:
        """Return the metrics of a run by name; None stands for not a number. Raises `MetricError`."""
        result: dict[str, float | None] = {}
        for name, of in self._measures:
            try:
                found = of(table)
            except Exception as error:  # a user's function may raise anything
                raise MetricError(
                    f"metric {_told(name)} raises {type(error).__name__}: {' '.join(str(error).split())}"
                ) from None
            values = found if isinstance(found, Mapping) else {_short(name): found}
            for key, value in values.items():
                if key in result:
                    raise MetricError(f"metric {_told(name)} gives {key}, which another one gives too")
                result[str(key)] = _number(name, value)
        return result

    def verdict(self, metrics: Mapping[str, float | None]) -> str:
        """Return the verdict on a run with these metrics. Raises `MetricError` when a condition names none of them."""
        if unknown := self._unknown(tuple(metrics)):
            raise MetricError(unknown[0])
        if not self.conditions:
            return DONE
        return PASS if all(c.met(metrics) for c in self.conditions) else FAIL

    def _unknown(self, metrics: Sequence[str]) -> list[str]:
        """Return what is wrong with conditions that name none of the metrics."""
        problems = []
        for name in dict.fromkeys(c.metric for c in self.conditions if c.metric not in metrics):
            hint = did_you_mean(name, metrics, f"; there are {', '.join(metrics)}")
            problems.append(f"condition on {name}: there is no such metric{hint}")
        return problems


def _told(name: str) -> str:
    """Return a metric's name as rows tell it: a user's file without its folder, which differs between machines."""
    return Path(name).name if ".py:" in name else name


def _short(name: str) -> str:
    """Return the column of a metric that is one number: a user's function by its own name."""
    return name.rpartition(":")[2] if ".py:" in name else name


def _number(name: str, value: Any) -> float | None:
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise MetricError(f"metric {_told(name)} gives {value!r}, which is no number") from None
    return None if math.isnan(number) else number


def _robot(table: Table) -> dict[str, float]:
    found = measure(table)
    return {"fallen": float(found["fallen_at"] < math.inf), **found}


def _measure(name: str, columns: Sequence[str], robot: bool) -> Callable[[Table], object]:
    """Return the function behind a metric's name. Raises `TwipError`."""
    if ".py:" in name:
        return _users_function(name)
    if name == ROBOT or name == "fallen" or name in METRICS:
        if not robot:
            raise TwipError(f"metric {name}: the system has not the robot's signals")
        if name == ROBOT:
            return _robot
        if name in METRICS and (missing := [s for s in METRICS[name].needs if s not in columns]):
            raise TwipError(f"metric {name}: the system has no signal {', '.join(missing)}")
        return (lambda table: _robot(table)["fallen"]) if name == "fallen" else METRICS[name].value
    kind, colon, signal = name.partition(":")
    if colon and kind in REDUCTIONS:
        if signal not in columns:
            raise TwipError(f"metric {name}: there is no signal {signal}{did_you_mean(signal, columns)}")
        reduce = REDUCTIONS[kind]
        return lambda table: reduce(table[signal])
    known = [*METRICS, "fallen", ROBOT] if robot else []
    hint = did_you_mean(name, known, f": one of {', '.join(REDUCTIONS)}, a colon and a signal")
    raise TwipError(f"unknown metric {name}{hint}")


def _users_function(name: str) -> Callable[[Table], object]:
    file, _, function = name.rpartition(":")
    path = Path(file)
    if not path.is_file():
        raise TwipError(f"metric {name}: {file} is no file")
    module_name = f"twip_metric_{path.stem}"
    spec = importlib.util.spec_from_file_location(module_name, path)
    if spec is None or spec.loader is None:
        raise TwipError(f"metric {name}: {file} is no Python file")
    module = importlib.util.module_from_spec(spec)
    sys.modules[module_name] = module
    try:
        spec.loader.exec_module(module)
    except Exception as error:  # the user's file may raise anything
        raise TwipError(f"metric {name}: {file} cannot be run: {type(error).__name__}: {error}") from None
    found = getattr(module, function, None)
    if not callable(found):
        raise TwipError(f"metric {name}: {file} has no function {function}")
    result: Callable[[Table], object] = found
    return result
