"""What a sweep runs: the system, what varies, and how each run is judged; and the runs that follow from it."""

import itertools
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ...cosim import System, Value, as_names, as_paths, file_fingerprint, load, parameters_of
from ...errors import Problem, TwipError
from ..metrics import METRICS
from .axis import Axis
from .design import run_seed, unit_points

MOST_RUNS = 10_000_000
"""Largest number of runs of a sweep."""
_SHOWN = 5
"""Most problems with values that are told one by one."""


@dataclass(frozen=True)
class ParameterSet:
    """Parameter files that go together under a label; none of them is the system as it stands."""

    label: str
    files: tuple[Path, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "files", tuple(Path(file) for file in as_paths(self.files)))


@dataclass(frozen=True)
class Point:
    """One run: the values of the axes in their order, and the start values that follow."""

    number: int
    parameter_set: str
    values: tuple[Value, ...]
    seed: int
    start_values: dict[str, Value]


@dataclass(frozen=True)
class Plan:
    """A sweep. Lists and grids are crossed with each other, with the parameter sets, the samples and the repetitions:
    the repetitions change fastest, then the samples, then the last grid. Times in s.
    """

    system: Path
    axes: tuple[Axis, ...] = ()
    parameter_sets: tuple[ParameterSet, ...] = ()
    parameters: tuple[Path, ...] = ()
    """Parameter files that every run begins with."""
    start_values: Mapping[str, Value] = field(default_factory=dict)
    """Start values of every run."""
    design: str = "random"
    samples: int = 0
    """Samples of the distributions; 0 where there are none."""
    repeat: int = 1
    """Runs of each point, with different seeds."""
    seed: int = 1
    seed_names: tuple[str, ...] | None = None
    """Variables that get each run's seed; None: every Integer parameter called `seed` that is not given otherwise."""
    metrics: tuple[str, ...] = ()
    success: tuple[str, ...] = ()
    """Conditions such as `fallen == 0`, all of which a run must meet."""
    input_file: Path | None = None
    start_time: float | None = None
    stop_time: float | None = None
    step_size: float | None = None
    coupling: str | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "parameters", tuple(Path(file) for file in as_paths(self.parameters)))
        for name in ("metrics", "success", *(("seed_names",) if self.seed_names is not None else ())):
            object.__setattr__(self, name, as_names(name, getattr(self, name)))

    def sets(self) -> tuple[ParameterSet, ...]:
        """The parameter sets, one without files if the plan has none."""
        return self.parameter_sets or (ParameterSet(""),)

    def systems(self) -> dict[str, System]:
        """Load the system with each parameter set and the start values of every run. Raises `TwipError`."""
        systems: dict[str, System] = {}
        problems: list[Problem] = []
        for chosen in self.sets():
            try:
                files = (*self.parameters, *chosen.files)
                systems[chosen.label] = load(self.system, parameters=files, start_values=self.start_values)
            except TwipError as error:
                problems += error.problems
        if problems:
            raise TwipError(problems)
        return systems

    def describe(self, systems: Mapping[str, System]) -> dict[str, Any]:
        """Return what determines every number that comes out, as JSON can hold it; two plans with the same description
        give the same results. `systems` are the loaded ones by parameter set.
        """
        return {
            "system": self.system.name,
            "axes": [
                {
                    "label": a.label,
                    "names": list(a.names),
                    "values": list(a.values),
                    "distribution": None if a.distribution is None else a.distribution.text,
                    "factor": a.factor,
                }
                for a in self.axes
            ],
            "parameter_sets": {s.label: [f.name for f in s.files] for s in self.sets()},
            "design": self.design if self.samples else None,
            **{name: getattr(self, name) for name in ("samples", "repeat", "seed", "start_time", "stop_time")},
            **{name: getattr(self, name) for name in ("step_size", "coupling")},
            "seed_names": None if self.seed_names is None else list(self.seed_names),
            "metrics": [Path(name).name for name in self.metrics],
            "success": list(self.success),
            "units": self.units(next(iter(systems.values()))),
            "files": {path.name: file_fingerprint(path) for path in self._read() if path.is_file()},
            "provenance": {label: _without_folders(system) for label, system in systems.items()},
        }

    def units(self, system: System) -> dict[str, str]:
        """Return the units of axes, by label, and of metrics, by name, as far as the system tells them."""
        variables = [(c.name, v) for c in system.components for v in c.fmu.variables.values()]
        known = {f"{component}.{v.name}": v.unit.name for component, v in variables if v.unit}
        signals = [signal for channel in system.channels for signal in channel.signals]
        recorded = {name: signal.unit for name, signal in zip(system.columns, signals, strict=True) if signal.unit}
        found: dict[str, str] = {}
        for axis in self.axes:
            units = {known.get(name, "") for name in axis.names}
            if len(units) == 1 and not axis.factor:
                found[axis.label] = units.pop()
        found |= {name: recorded.get(name.partition(":")[2], "") for name in self.metrics}
        found |= {name: metric.unit for name, metric in METRICS.items()}
        return {name: unit for name, unit in found.items() if unit not in ("", "1")}

    def _read(self) -> list[Path]:
        """Return the files that runs and their judgement read, beside those that the provenance tells."""
        functions = [Path(name.rpartition(":")[0]) for name in self.metrics if ".py:" in name]
        return functions if self.input_file is None else [*functions, self.input_file]

    def points(self, systems: Mapping[str, System]) -> list[Point]:
        """Return all runs in their order, checked against the loaded systems by parameter set.

        Raises `TwipError` with a line per problem.
        """
        _check_names(self, systems)
        if not self.axes and len(self.sets()) == 1 and self.repeat == 1:
            raise TwipError("nothing varies: a sweep needs an axis, parameter sets or repetitions")
        grids = [a for a in self.axes if a.distribution is None]
        sampled = [a for a in self.axes if a.distribution is not None]
        if bool(sampled) != bool(self.samples):
            raise TwipError(
                f"{sampled[0].label} has a distribution: how many samples?"
                if sampled
                else "samples of what? There is no distribution"
            )
        if self.repeat < 1:
            raise TwipError(f"repeat = {self.repeat} must be at least 1")
        if self.design == "indices" and (grids or self.repeat > 1 or len(self.sets()) > 1):
            raise TwipError("design indices takes distributions only: no lists, grids, parameter sets or repetitions")
        if not 0 <= self.seed < 2**63:
            raise TwipError(f"seed = {self.seed} must be at least 0 and below 2^63")
        unit = unit_points(self.design, self.samples, len(sampled), self.seed) if sampled else None
        columns = [] if unit is None else [
            a.distribution.quantiles(unit[:, i]).tolist() for i, a in enumerate(sampled) if a.distribution
        ]  # fmt: skip
        count = len(self.sets()) * self.repeat * (1 if unit is None else len(unit))
        for axis in grids:
            count *= len(axis.values)
        if count > MOST_RUNS:
            raise TwipError(f"these are {count} runs; at most {MOST_RUNS} are possible")
        samples: list[tuple[Value, ...]] = list(zip(*columns, strict=True)) if columns else [()]
        result: list[Point] = []
        starts = {label: self._starts(system) for label, system in systems.items()}
        seeded = {label: self._seeded(system) for label, system in systems.items()}
        combinations = itertools.product(self.sets(), itertools.product(*(a.values for a in grids)), samples)
        for chosen, grid, sample in combinations:
            given = dict(zip((a.label for a in (*grids, *sampled)), (*grid, *sample), strict=True))
            values = tuple(given[a.label] for a in self.axes)
            for _ in range(self.repeat):
                number = len(result)
                seed = run_seed(self.seed, number)
                start = self._start_values(values, starts[chosen.label])
                start |= dict.fromkeys(seeded[chosen.label], seed)
                result.append(Point(number, chosen.label, values, seed, start))
        _check_values(result, systems, seeded)
        return result

    def _starts(self, system: System) -> dict[str, Value]:
        """Return what the variables of the factors would start with."""
        if not any(a.factor for a in self.axes):
            return {}
        return {entry.name: entry.value for entry in parameters_of(system)}

    def _start_values(self, values: Sequence[Value], starts: Mapping[str, Value]) -> dict[str, Value]:
        result: dict[str, Value] = {}
        for axis, value in zip(self.axes, values, strict=True):
            for name in axis.names:
                result[name] = float(value) * float(starts[name]) if axis.factor else value
        return result

    def _seeded(self, system: System) -> tuple[str, ...]:
        if self.seed_names is not None:
            return self.seed_names
        taken = {*self.start_values, *(name for a in self.axes for name in a.names)}
        seeds = [
            f"{c.name}.{v.name}"
            for c in system.components
            for v in c.fmu.variables.values()
            if v.name == "seed" and v.type == "Integer" and v.causality == "parameter" and v.settable
        ]
        return tuple(name for name in seeds if name not in taken)


def _without_folders(system: System) -> dict[str, dict[str, str]]:
    """Return a system's provenance with the names of files instead of their paths."""
    return {
        name: {key: os.path.basename(text) if key in ("file", "fmu") else text for key, text in entries.items()}
        for name, entries in system.provenance().items()
    }


def _check_names(plan: Plan, systems: Mapping[str, System]) -> None:
    """Check that nothing is given twice, and that factors have something to multiply."""
    problems = []
    labels = [a.label for a in plan.axes]
    names = [*(n for a in plan.axes for n in a.names), *(plan.seed_names or ())]
    sets = [s.label for s in plan.parameter_sets]
    for what, given in (("axis", labels), ("variable", names), ("parameter set", sets)):
        problems += [f"{what} {name} is there twice" for name in dict.fromkeys(given) if given.count(name) > 1]
    problems += [f"{n} is given a start value and varies too" for n in names if n in plan.start_values]
    for axis in plan.axes:
        for label, system in systems.items() if axis.factor else ():
            known = {entry.name: entry for entry in parameters_of(system)}
            for name in axis.names:
                if name not in known:
                    system.with_start_values({name: 1.0})  # tells why, unless it is an input
                    problems.append(f"{name} has no value of its own that could be multiplied")
                elif known[name].type not in ("Real", "Integer"):
                    problems.append(f"{name} is {known[name].type} and cannot be multiplied")
            if label and problems:
                break
    if problems:
        raise TwipError(problems)


def _check_values(
    points: Sequence[Point], systems: Mapping[str, System], seeded: Mapping[str, tuple[str, ...]]
) -> None:
    """Check every distinct value of every variable by the rules of `load`, and the ends of the seeds' range."""
    problems: list[Problem] = []
    checked: set[tuple[str, str, str]] = set()
    for label, names in seeded.items():
        for seed in (0, 2**31 - 1):
            systems[label].with_start_values(dict.fromkeys(names, seed))
    for point in points:
        varied = point.start_values.items() - dict.fromkeys(seeded[point.parameter_set], point.seed).items()
        new = {n: v for n, v in sorted(varied) if (point.parameter_set, n, repr(v)) not in checked}
        if not new:
            continue
        checked.update((point.parameter_set, name, repr(value)) for name, value in new.items())
        try:
            systems[point.parameter_set].with_start_values(new)
        except TwipError as error:
            problems += error.problems
    if problems:
        found = TwipError(problems).problems
        more = [f"… and {len(found) - _SHOWN} more values"] if len(found) > _SHOWN else []
        raise TwipError([*found[:_SHOWN], *more])
