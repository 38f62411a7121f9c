"""The results of a sweep as one Parquet file: a row per run, sorted by its number.

The same sweep gives the same bytes, however and where its runs were done: there are no times and no machine names in
the file. The schema's metadata, under `twip`, say as JSON what was run: plan, FMU fingerprints, versions.
"""

import itertools
import json
import platform
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...cosim import Value
from ...errors import AbsentFileError, TwipError
from ...extras import optional
from ...outputs import replacing
from .plan import Plan, Point
from .worker import Row

KEY = b"twip"
"""Of the schema's metadata."""
ENDINGS = (".parquet",)
NOT_NUMBERS = ("run", "parameters", "verdict", "error", "start_values")
"""Columns that are no numbers to ask about."""
_ENGINES = ("twip", "numpy", "scipy", "fmpy", "pyarrow")


def arrow(name: str) -> Any:
    """Return a module of pyarrow. Raises `TwipError` when it is not installed."""
    return optional(name, "a sweep")


def write(
    path: Path, plan: Plan, points: Sequence[Point], rows: Mapping[int, Row], description: Mapping[str, Any]
) -> None:
    """Write the runs of `points` that have a row. Raises `TwipError` when the file cannot be written."""
    pa, parquet = arrow("pyarrow"), arrow("pyarrow.parquet")
    done = [point for point in points if point.number in rows]
    ordered = [rows[point.number] for point in done]
    names = list(dict.fromkeys(name for row in ordered for name in row.metrics))
    fields: dict[str, Any] = {"run": pa.array([p.number for p in done], pa.int64())}
    if plan.parameter_sets:
        fields["parameters"] = pa.array([p.parameter_set for p in done], pa.string())
    for i, axis in enumerate(plan.axes):
        fields[axis.label] = _column(pa, [p.values[i] for p in done])
    fields["seed"] = pa.array([p.seed for p in done], pa.int64())
    fields["verdict"] = pa.array([r.verdict for r in ordered], pa.string())
    fields["error"] = pa.array([r.error for r in ordered], pa.string())
    for name in names:
        fields[_free(name, fields)] = pa.array([r.metrics.get(name) for r in ordered], pa.float64())
    fields["start_values"] = pa.array(
        [" ".join(f"{n} {str(v).lower() if isinstance(v, bool) else v}" for n, v in p.start_values.items())
         for p in done], pa.string(),
    )  # fmt: skip
    versions = {"python": platform.python_version(), **{name: version(name) for name in _ENGINES}}
    told = {"sweep": description, "versions": versions, "runs": len(points)}
    table = pa.table(fields).replace_schema_metadata({KEY: json.dumps(told).encode()})
    with replacing(path) as stream:
        parquet.write_table(table, stream, compression="zstd")


def _column(pa: Any, values: Sequence[Value]) -> Any:
    """Return the values of an axis as one Arrow type: Boolean, Integer, Real, or text for what is mixed."""
    if all(isinstance(v, bool) for v in values):
        return pa.array(values, pa.bool_())
    if all(isinstance(v, int) and not isinstance(v, bool) for v in values):
        return pa.array(values, pa.int64())
    if all(isinstance(v, int | float) and not isinstance(v, bool) for v in values):
        return pa.array([float(v) for v in values], pa.float64())
    return pa.array([str(v) for v in values], pa.string())


def _free(name: str, taken: Mapping[str, object]) -> str:
    """Return the column of a metric, another one than those of the inputs."""
    while name in taken:
        name += "_"
    return name


@dataclass(frozen=True)
class Results:
    """A Parquet file of a sweep in memory."""

    columns: dict[str, list[Any]]
    description: dict[str, Any]
    """The plan's description; see `Plan.describe`."""
    runs: int
    """Runs of the whole sweep; the file holds fewer if it was interrupted."""
    versions: dict[str, str] = field(default_factory=dict)
    """Of Python and of the packages that made it."""

    @classmethod
    def read(cls, path: Path) -> "Results":
        """Read a file. Raises `TwipError` when it is none of a sweep."""
        pa, parquet = arrow("pyarrow"), arrow("pyarrow.parquet")
        try:
            table = parquet.read_table(path)
            told = json.loads(table.schema.metadata[KEY])
            result = cls(table.to_pydict(), dict(told["sweep"]), int(told["runs"]), dict(told.get("versions", {})))
            if not {"run", "verdict", *result.axes} <= result.columns.keys():
                raise ValueError
            if not {"design", "samples"} <= result.description.keys():
                raise ValueError
            if any(not {"label", "distribution", "factor"} <= axis.keys() for axis in result.description["axes"]):
                raise ValueError
        except FileNotFoundError:
            raise AbsentFileError(f"{path}: no such file", path=path) from None
        except (OSError, pa.ArrowException, ValueError, KeyError, TypeError, AttributeError):
            raise TwipError(f"{path} is not the Parquet file of a sweep") from None
        return result

    @property
    def axes(self) -> list[str]:
        """Labels of what varied, `parameters` first if there were parameter sets."""
        sets = ["parameters"] if "parameters" in self.columns else []
        return sets + [str(axis["label"]) for axis in self.description["axes"]]

    def titled(self, name: str) -> str:
        """Return what to call a column, or an axis, with its unit where it is known."""
        axis = next((a for a in self.description["axes"] if a["label"] == name), None)
        if axis is not None and axis["factor"]:
            return f"{name}, multiples of its value"
        unit = self.description.get("units", {}).get(name)
        return f"{name} [{unit}]" if unit else name

    def only(self, parameter_set: str) -> "Results":
        """Return the runs with one of the parameter sets."""
        kept = [label == parameter_set for label in self.columns["parameters"]]
        columns = {n: list(itertools.compress(column, kept)) for n, column in self.columns.items()}
        return replace(self, columns=columns)

    @property
    def judged(self) -> bool:
        """Whether runs pass or fail; otherwise there were no conditions."""
        return any(v in ("pass", "fail") for v in self.columns["verdict"])

    def numbers(self, name: str) -> NDArray[np.float64]:
        """Return a column as numbers, (rows,), nan where there is none. Raises `TwipError` for another column."""
        if name == "success":
            return np.array([float(v == "pass") for v in self.columns["verdict"]])
        if name not in self.columns:
            known = ", ".join(n for n in self.columns if n not in NOT_NUMBERS)
            raise TwipError(f"the sweep has no column {name}; there are {known}, success")
        try:
            return np.array([np.nan if v is None else float(v) for v in self.columns[name]])
        except (TypeError, ValueError):
            raise TwipError(f"column {name} is not made of numbers") from None
