"""Reads scenario files (TOML; docs/scenarios.md), every entry checked against the system and the times of the run."""

import dataclasses
import os
import pathlib
from collections.abc import Mapping

from ..model.system import System
from ..model.time_grid import TimeGrid
from ..reading.files import is_special
from ..reading.problems import Problems
from ..reading.toml import TomlFile, number, shown
from ..reading.wording import did_you_mean
from ..values.types import TYPES
from ..values.written import StartValue, cannot_travel, in_vector, out_of_range
from .fault_entries import FaultEntries
from .inputs import InputSeries, find_target, held_connectors, read_inputs, series_of
from .plan import ParameterChange, Scenario, point_of
from .scenario_entries import Entries, typed
from .targets import RULES, objections


def read_scenario(
    path: str | os.PathLike[str] | None,
    input_file: str | os.PathLike[str] | None,
    system: System,
    grid: TimeGrid | None,
    problems: Problems,
) -> Scenario:
    """Read the scenario at `path` and the CSV file of the caller; without both, nothing is done to the system.

    `grid` is None where the times of the run are wrong. Not to be used when there are problems.
    """
    scenario = Scenario() if input_file is None else Scenario(read_inputs(input_file, system, problems))
    file = None if path is None else TomlFile(pathlib.Path(path), problems)
    if path is not None and file is not None and file.content is not None:
        reader = _Reader(file, system, grid, problems)
        scenario = reader.read(file.content, pathlib.Path(path).parent, scenario.inputs)
    return dataclasses.replace(scenario, warnings=(*scenario.warnings, *held_connectors(system, scenario.inputs)))


def files_of(path: str | os.PathLike[str]) -> list[pathlib.Path]:
    """Return the scenario file and the CSV file that it names, as far as they exist."""
    file = pathlib.Path(path)
    content = TomlFile(file, Problems()).content or {}
    source = content.get("input_file")
    return [f for f in (file, *([file.parent / source] if isinstance(source, str) else ())) if f.is_file()]


class _Reader(Entries):
    """Reads one file."""

    def read(self, content: Mapping[str, object], folder: pathlib.Path, given: InputSeries) -> Scenario:
        """Return what the `content` of a file in `folder` asks for; `given` are the caller's time series."""
        self.known(content, {"description", "input_file", "inputs", "parameters", "faults"})
        inputs = self._inputs(content, folder, given)
        changes = [c for i, entry in self._entries(content, "parameters") if (c := self._change(i, entry)) is not None]
        twice: set[tuple[float, str]] = set()
        for change in changes:
            at = change.time if self.grid is not None and self.grid.varies else change.step
            if (at, change.name) in twice:
                self.problems.add(f"{change} follows another value at the same point", change.value.place)
            twice.add((at, change.name))
        driven, reader = set(inputs.columns.tolist()), FaultEntries(self.file, self.system, self.grid, self.problems)
        entries = self._entries(content, "faults")
        faults = [fault for i, entry in entries if (fault := reader.read(i, entry, driven)) is not None]
        warnings = (*self.warnings, *reader.warnings)
        return Scenario(inputs, tuple(sorted(changes, key=lambda c: c.time)), tuple(faults), warnings)

    def _entries(self, content: Mapping[str, object], name: str) -> list[tuple[int, Mapping[str, object]]]:
        entries = content.get(name, [])
        if not isinstance(entries, list) or not all(isinstance(entry, dict) for entry in entries):
            self.problems.add(name, self.file.place("", 0, name), rule=f"must be tables, each headed [[{name}]]")
            return []
        return list(enumerate(entries))

    def _inputs(self, content: Mapping[str, object], folder: pathlib.Path, given: InputSeries) -> InputSeries:
        inputs, source = given, content.get("input_file")
        if source is not None and not isinstance(source, str):
            place = self.file.place("", 0, "input_file")
            self.problems.add(f"input_file = {shown(source)}", place, rule="must be the path of a CSV file")
        elif source is not None and is_special(folder / source):
            place = self.file.place("", 0, "input_file")
            self.problems.add(f"input_file = {shown(source)} is a device or the like, not a file", place)
        elif source is not None:
            inputs = self._joined(inputs, read_inputs(folder / source, self.system, self.problems), "input_file")
        table = content.get("inputs", {})
        if not isinstance(table, dict):
            self.problems.add("inputs", self.file.place("", 0, "inputs"), rule="must be a table, headed [inputs]")
            return inputs
        for name, rows in table.items():
            series = self._series(name, rows)
            if series is not None:
                inputs = self._joined(inputs, series, name)
        return inputs

    def _joined(self, inputs: InputSeries, more: InputSeries, name: str) -> InputSeries:
        for column in set(inputs.columns.tolist()) & set(more.columns.tolist()):
            place = self.file.place("", 0, name) if name == "input_file" else self.file.place("inputs", 0, name)
            self.problems.add(f"{self.names[column]} has two time series", place)
        return inputs + more

    def _series(self, name: str, rows: object) -> InputSeries | None:
        """Return the time series `name = [[time, value], …]`."""
        place, checking = self.file.place("inputs", 0, name), self.problems.checking()
        target = find_target(self.system, name)
        if isinstance(target, str):
            self.problems.add(target, place)
            return None
        if not isinstance(rows, list) or not rows or any(not isinstance(r, list) or len(r) != 2 for r in rows):
            self.problems.add(f"inputs.{name}", place, rule="must be a list of pairs [time in s, value]")
            return None
        table: list[tuple[float, float]] = []
        for i, (time, value) in enumerate(rows):
            at, read = number(time), typed(value, target.type, target.items)
            if at is None:
                self.problems.add(f"inputs.{name}[{i}]: time {shown(time)} must be a finite number", place)
            elif table and at < table[-1][0]:
                self.problems.add(
                    f"inputs.{name}[{i}]: time {at!r} follows {table[-1][0]!r}: time must increase", place
                )
            if read is None:
                self.problems.add(f"inputs.{name}[{i}] = {shown(value)}", place, rule=f"must be {RULES[target.type]}")
            elif why := cannot_travel(target.type, read):
                self.problems.add(f"inputs.{name}[{i}] cannot take {shown(value)}, {why}", place)
            else:
                self.problems.take(objections(f"inputs.{name}[{i}]", read, target.ends), place)
            if at is not None and read is not None:
                table.append((at, in_vector(read)))
        return series_of([target], table) if not checking.failed else None

    def _change(self, index: int, entry: Mapping[str, object]) -> ParameterChange | None:
        checking = self.problems.checking()
        self.known(entry, {"time", "name", "value"}, "parameters", index)
        self.required(entry, ("time", "name", "value"), "parameters", index)
        if checking.failed:
            return None
        name, time = entry["name"], self.time(entry, "time", "parameters", index)
        place = self.file.place("parameters", index, "name")
        known = {
            f"{c.name}.{v.name}": (i, v) for i, c in enumerate(self.system.components) for v in c.fmu.variables.values()
        }
        if not isinstance(name, str) or name not in known:
            tunable = [n for n, (_, v) in known.items() if v.causality == "parameter" and v.variability == "tunable"]
            self.problems.add(f"parameters[{index}]: unknown parameter {name}{did_you_mean(str(name), tunable)}", place)
            return None
        component, variable = known[name]
        if variable.type not in RULES:
            self.problems.add(f"parameters[{index}]: {name} cannot be set: {variable.obstacle}", place)
            return None
        if (variable.causality, variable.variability) != ("parameter", "tunable"):
            self.problems.add(
                f"parameters[{index}]: {name} cannot change during a run: it is a {variable.variability}"
                f" {variable.causality}, no tunable one",
                place,
            )
            return None
        place = self.file.place("parameters", index, "value")
        value = typed(entry["value"], variable.type, variable.items)
        if value is None:
            said = f"parameters[{index}]: {name} = {shown(entry['value'])} must be {TYPES[variable.type].rule}"
            self.problems.add(said, place)
            return None
        for problem in out_of_range(variable, value):
            self.problems.add(f"parameters[{index}]: {problem}", place)
        if time is None or self.grid is None or checking.failed:
            return None
        if time >= self.grid.stop:
            self.warnings.append(f"parameters[{index}]: {time:g} s is not before the stop time, {name} does not change")
        return ParameterChange(time, point_of(time, self.grid), component, name, StartValue(variable, value, place))
