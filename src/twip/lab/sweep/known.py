"""What can be asked of a sweep: told by its plan before the first run, by its Parquet file afterwards."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from ...cosim import Value, did_you_mean
from ...errors import TwipError
from .measures import Judge
from .parquet import NOT_NUMBERS, Results
from .plan import Plan, Point
from .statistics import least_runs, several_numbers

SUCCESS = "success"
"""Stands for the share of runs that pass, beside the metrics."""


@dataclass(frozen=True)
class Known:
    """Names that questions about a sweep may hold; every question is checked here, whenever it is asked."""

    axes: tuple[str, ...]
    """Labels of what varies, `parameters` first if there are parameter sets."""
    ranked: tuple[str, ...]
    """Those of them that take several numbers."""
    metrics: tuple[str, ...]
    complete: bool
    """Whether there are no further metrics; a user's function tells the names of its own when it is called first."""
    judged: bool
    """Whether runs pass or fail."""
    runs: int
    design: str | None

    @classmethod
    def of_plan(cls, plan: Plan, points: Sequence[Point], judge: Judge) -> "Known":
        """Return what is known before the first run of a plan."""
        sets = ("parameters",) if plan.parameter_sets else ()
        labels = tuple(axis.label for axis in plan.axes)
        values: dict[str, list[Value]] = {label: [p.values[i] for p in points] for i, label in enumerate(labels)}
        return cls(
            axes=(*sets, *labels),
            ranked=tuple(label for label in labels if several_numbers(values[label])),
            metrics=judge.names or (),
            complete=judge.names is not None,
            judged=bool(judge.conditions),
            runs=len(points),
            design=plan.design if plan.samples else None,
        )

    @classmethod
    def of_results(cls, results: Results) -> "Known":
        """Return what is known of finished runs."""
        columns: dict[str, list[Any]] = results.columns
        return cls(
            axes=tuple(results.axes),
            ranked=tuple(label for label in results.axes if several_numbers(columns[label])),
            metrics=tuple(name for name in columns if name not in (*NOT_NUMBERS, "seed", *results.axes)),
            complete=True,
            judged=results.judged,
            runs=len(columns["run"]),
            design=results.description["design"],
        )

    def with_metrics(self, names: Iterable[str]) -> "Known":
        """Return what is known once a run has told all metrics."""
        return replace(self, metrics=tuple(names), complete=True)

    def axis_problems(self, names: Sequence[str]) -> list[str]:
        """Return what is wrong with axes that are asked for."""
        problems = [
            f"{name} does not vary; there are {', '.join(self.axes)}" for name in names if name not in self.axes
        ]
        if len(set(names)) < len(names):
            problems.append(f"{', '.join(names)}: an axis is named twice")
        return problems

    def metric_problems(self, name: str) -> list[str]:
        """Return what is wrong with a metric, or `success`, that is asked for."""
        if name == SUCCESS:
            return [] if self.judged else ["the sweep has no conditions, so no run passes or fails"]
        if name in (*self.metrics, *self.axes, "seed") or not self.complete:
            return []
        hint = did_you_mean(name, self.metrics, f"; there are {', '.join((*self.metrics, SUCCESS))}")
        return [f"the sweep has no metric {name}{hint}"]

    def ranking_problems(self, metric: str) -> list[str]:
        """Return why the axes cannot be ranked by what they do to a metric, as far as it is known."""
        problems = self.metric_problems(metric)
        if self.design != "indices":
            if not self.ranked:
                problems.append("there is no axis with several numbers, so nothing can be ranked")
            elif self.runs < least_runs(len(self.ranked)):
                problems.append(f"ranking needs {least_runs(len(self.ranked))} runs, and there are {self.runs}")
        return problems


def refuse(problems: Sequence[str]) -> None:
    """Raise `TwipError` with a line per problem, if there are any."""
    if problems:
        raise TwipError(problems)
