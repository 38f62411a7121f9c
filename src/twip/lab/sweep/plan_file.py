"""Reads a plan from a TOML file; docs/sweep.md has an example with every key. Paths count from the file's folder."""

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ...cosim import Value
from ...errors import Problem, TwipError
from .axis import Axis, Distribution
from .plan import ParameterSet, Plan

MAXIMUM_BYTES = 10_000_000
_COUNTS = ("samples", "repeat", "seed")
_TIMES = ("start_time", "stop_time", "step_size")
_WORDS = ("design", "coupling")
_LISTS = ("parameters", "metrics", "success", "seed_names")
_TABLES = ("start_values", "vary", "parameter_sets")


def read_plan(path: Path) -> Plan:
    """Return the plan in a TOML file. Raises `TwipError` with a line per problem."""
    try:
        if path.stat().st_size > MAXIMUM_BYTES:
            raise TwipError(f"{path}: is larger than {MAXIMUM_BYTES} bytes")
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise TwipError(f"{path}: cannot be read ({error.strerror})") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise TwipError(f"{path}: is no TOML file: {error}") from None
    return _Reader(path, content).plan()


class _Reader:
    def __init__(self, path: Path, content: Mapping[str, Any]):
        self.path = path
        self.content = content
        self.problems: list[str | Problem] = []

    def plan(self) -> Plan:
        known = ("system", "input_file", *_COUNTS, *_TIMES, *_WORDS, *_LISTS, *_TABLES)
        self.problems += [
            f"unknown key {key}; there are {', '.join(known)}" for key in self.content if key not in known
        ]
        given: dict[str, Any] = {}
        for names, fits, what in (
            (("system", "input_file", *_WORDS), lambda v: isinstance(v, str), "a text"),
            (_COUNTS, _whole, "a whole number"),
            (_TIMES, _real, "a number of seconds"),
            (_LISTS, lambda v: isinstance(v, list) and all(isinstance(e, str) for e in v), "a list of texts"),
            (_TABLES, lambda v: isinstance(v, dict), "a table"),
        ):  # type: tuple[tuple[str, ...], Callable[[Any], bool], str]
            for name in names:
                if name in self.content:
                    if fits(self.content[name]):
                        given[name] = self.content[name]
                    else:
                        self.problems.append(f"{name} must be {what}")
        if "system" not in self.content:
            self.problems.append("there is no system")
        plan = dict(given)
        plan["system"] = self._file(given.get("system", ""))
        if "input_file" in given:
            plan["input_file"] = self._file(given["input_file"])
        for name in _LISTS:
            if name in given:
                plan[name] = tuple(given[name])
        plan["parameters"] = tuple(self._file(f) for f in given.get("parameters", ()))
        plan["metrics"] = tuple(str(self._file(m)) if ".py:" in m else m for m in given.get("metrics", ()))
        plan["start_values"] = {
            n: v for n, v in given.get("start_values", {}).items() if self._is_value(f"start_values.{n}", v)
        }
        plan["axes"] = tuple(
            axis for label, table in given.get("vary", {}).items() for axis in self._axis(label, table)
        )
        plan["parameter_sets"] = tuple(self._sets(given.get("parameter_sets", {})))
        plan.pop("vary", None)
        if self.problems:
            raise TwipError(f"{self.path}: {problem}" for problem in self.problems)
        return Plan(**plan)

    def _file(self, name: str) -> Path:
        return self.path.parent / name

    def _is_value(self, name: str, value: object) -> bool:
        if isinstance(value, str | int | float):
            return True
        self.problems.append(f"{name} must be a number, true, false or a text")
        return False

    def _sets(self, table: Mapping[str, Any]) -> list[ParameterSet]:
        result = []
        for label, files in table.items():
            if isinstance(files, list) and all(isinstance(f, str) for f in files):
                result.append(ParameterSet(label, tuple(self._file(f) for f in files)))
            else:
                self.problems.append(f"parameter_sets.{label} must be a list of files")
        return result

    def _axis(self, label: str, table: object) -> list[Axis]:
        """Return the axis, or nothing where there is a problem."""
        where = f"vary.{label}"
        try:
            if not isinstance(table, dict):
                raise TwipError("must be a table")
            if unknown := [k for k in table if k not in ("names", "values", "grid", "distribution", "factor")]:
                raise TwipError(f"unknown key {unknown[0]}; there are names, values, grid, distribution, factor")
            kinds = [k for k in ("values", "grid", "distribution") if k in table]
            if len(kinds) != 1:
                raise TwipError("needs one of values, grid, distribution")
            names, factor = table.get("names", [label]), table.get("factor", False)
            if not (isinstance(names, list) and all(isinstance(n, str) for n in names)):
                raise TwipError("names must be a list of texts")
            if not isinstance(factor, bool):
                raise TwipError("factor must be true or false")
            content = table[kinds[0]]
            if kinds[0] == "values":
                if not isinstance(content, list) or not all(self._is_value(f"{where}.values", v) for v in content):
                    raise TwipError("values must be a list")
                values: tuple[Value, ...] = tuple(content)
                return [Axis(label, tuple(names), values, None, factor)]
            if not isinstance(content, str):
                raise TwipError(f"{kinds[0]} must be a text")
            if kinds[0] == "distribution":
                return [Axis(label, tuple(names), (), Distribution(content), factor)]
            if ":" not in content:
                raise TwipError("grid must be FROM:TO:COUNT or FROM:TO:COUNT:log")
            return [Axis.parse(label, f"{'x' if factor else ''}{content}", names)]
        except TwipError as error:
            self.problems += error.about(where).problems
            return []


def _whole(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _real(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
