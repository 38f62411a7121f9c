"""Full logs of chosen runs: they are done again, which gives the same bits."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf
from pathlib import Path

from ...errors import TwipError
from .measures import ERROR, FAIL, PASS
from .run import Outcome
from .worker import Row, Task, record

_DEFAULT = "steady_state_error"
_BADNESS = {ERROR: 0, FAIL: 1}


@dataclass(frozen=True)
class Keep:
    """Which runs: by number, or so many of the worst."""

    numbers: tuple[int, ...] = ()
    worst: int = 0
    metric: str | None = None
    """By which the worst is told among runs with the same verdict; None: `steady_state_error`, else the first one.
    A run without the number, such as that of a robot that fell, is worse than any with it, unless it passed."""

    @classmethod
    def parse(cls, text: str) -> "Keep":
        """Return the choice that `worst:COUNT`, `worst:COUNT:METRIC` or `runs:NUMBER,NUMBER` states."""
        kind, _, rest = text.partition(":")
        count, _, metric = rest.partition(":")
        try:
            if kind == "runs" and all(int(n) >= 0 for n in rest.split(",")):
                return cls(numbers=tuple(dict.fromkeys(int(n) for n in rest.split(","))))
            if kind == "worst" and int(count) > 0:
                return cls(worst=int(count), metric=metric or None)
        except ValueError:
            pass
        raise TwipError(f"{text!r} must be worst:COUNT, worst:COUNT:METRIC or runs:NUMBER,NUMBER,…")

    def problems(self, runs: int, known: Sequence[str] | None) -> list[str]:
        """Return what is wrong with the choice of a sweep with so many runs, and the `known` metrics if all are."""
        found = [f"there is no run {n}: the runs are 0 to {runs - 1}" for n in self.numbers if n >= runs]
        if self.metric is not None and known is not None and self.metric not in known:
            found.append(f"there is no metric {self.metric} to tell the worst runs by; there are {', '.join(known)}")
        return found

    def chosen(self, rows: Sequence[Row]) -> list[int]:
        """Return the numbers of the runs, the worst first. Raises `TwipError` for a run or metric that is not there."""
        if self.numbers:
            known = {row.number for row in rows}
            if missing := [n for n in self.numbers if n not in known]:
                raise TwipError(f"there is no run {missing[0]}")
            return list(self.numbers)
        metric = self.metric
        names = list(dict.fromkeys(name for row in rows for name in row.metrics))
        if metric is None and names:
            metric = _DEFAULT if _DEFAULT in names else names[0]
        elif metric is not None and metric not in names:
            raise TwipError(f"there is no metric {metric} to tell the worst runs by; there are {', '.join(names)}")

        def badness(row: Row) -> tuple[int, float, int]:
            value = row.metrics.get(metric or "")
            missing = inf if row.verdict == PASS else -inf
            return _BADNESS.get(row.verdict, 2), missing if value is None else -value, row.number

        return [row.number for row in sorted(rows, key=badness)[: self.worst]]


def record_runs(outcome: Outcome, keep: Keep, folder: Path) -> list[Path]:
    """Do the chosen runs of a sweep again, in this process, and write their logs `run-NUMBER.mcap` to `folder`.

    Returns those that there are: a run that failed before its first row has none. Raises `TwipError` like `record`.
    """
    digits = len(str(outcome.runs - 1))
    paths = []
    for number in keep.chosen(list(outcome.rows.values())):
        point, row = outcome.points[number], outcome.rows[number]
        path = folder / f"run-{number:0{digits}}.mcap"
        metrics = {name: repr(value) for name, value in row.metrics.items()}
        told = {"sweep": {"run": str(number), "parameters": point.parameter_set, "verdict": row.verdict, **metrics}}
        record(outcome.job, Task(number, point.parameter_set, point.start_values), path, told, row.error)
        if path.exists():
            paths.append(path)
    return paths
