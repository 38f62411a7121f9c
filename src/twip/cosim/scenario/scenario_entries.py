"""What the readers of a scenario file's entries share."""

from collections.abc import Mapping, Set

from ..model.system import System
from ..model.time_grid import TimeGrid
from ..reading.problems import Problems
from ..reading.toml import TomlFile, number, shown
from ..reading.wording import did_you_mean
from ..values.written import Value, parse_value


class Entries:
    """Checks entries against the system and, unless they are wrong themselves, the times of the run; what is wrong
    goes to `problems`.
    """

    def __init__(self, file: TomlFile, system: System, grid: TimeGrid | None, problems: Problems):
        self.file = file
        self.system = system
        self.grid = grid
        self.problems = problems
        self.warnings: list[str] = []
        self.names = system.columns

    def known(self, table: Mapping[str, object], known: Set[str], name: str = "", index: int = 0) -> None:
        """Report keys of a table that have no meaning."""
        for key in sorted(table.keys() - known):
            hint = did_you_mean(key, sorted(known), f": there are {', '.join(sorted(known))}")
            where = f"{name}[{index}].{key}" if name else key
            self.problems.add(f"unknown key {where}{hint}", self.file.place(name, index, key))

    def required(self, entry: Mapping[str, object], keys: tuple[str, ...], table: str, index: int) -> None:
        """Report missing keys."""
        for key in keys:
            if key not in entry:
                self.problems.add(f"{table}[{index}] has no {key}", self.file.place(table, index))

    def time(self, entry: Mapping[str, object], key: str, table: str, index: int) -> float | None:
        """Return the time in s that an entry has under `key`, None when it is none or before the start time."""
        time, place = number(entry[key]), self.file.place(table, index, key)
        if time is None:
            self.problems.add(f"{table}[{index}].{key} = {shown(entry[key])}", place, rule="must be a time in s")
        elif self.grid is not None and time < self.grid.start:
            self.problems.add(
                f"{table}[{index}].{key} = {time:g} s is before the start time, {self.grid.start:g} s", place
            )
            return None
        return time


def typed(value: object, type_: str, items: tuple[tuple[str, int], ...] = ()) -> Value | None:
    """Return a TOML value as a value of an FMI type, None when it is none."""
    if type_ in ("String", "Enumeration") and isinstance(value, str):
        return parse_value(value, type_, items)
    if isinstance(value, bool):
        return value if type_ == "Boolean" else None
    if number(value) is None or type_ == "String":
        return None
    return parse_value(repr(value), type_, items)
