"""Says how the names and units of an FMU differ from those of the one whose place it takes: a small TOML file.

ignore = ["yaw"]            # inputs that it does without: their connections are removed
allow_loop = true           # its feed-through may close an algebraic loop
[names]                     # the system's name = the FMU's name
pitch = "theta"
[units]                     # units that its model description does not state, by the FMU's names
theta = "deg"
"""

import pathlib
from collections.abc import Mapping
from dataclasses import dataclass, field

from ..reading.problems import Problems
from ..reading.toml import TomlFile, shown

_KEYS = ("allow_loop", "ignore", "names", "units")


@dataclass(frozen=True)
class SwapMap:
    """How an FMU is fitted to a component that was made for another one."""

    names: Mapping[str, str] = field(default_factory=dict)
    """From the system's name of a variable to the FMU's."""
    units: Mapping[str, str] = field(default_factory=dict)
    """By the FMU's name."""
    ignore: tuple[str, ...] = ()
    allow_loop: bool = False


def read_swap_map(path: pathlib.Path, problems: Problems) -> SwapMap:
    """Read the file at `path`; not to be used when there are problems."""
    file = TomlFile(path, problems)
    content = file.content or {}
    for key in sorted(content.keys() - set(_KEYS)):
        problems.add(f"unknown key {key}: there are {', '.join(_KEYS)}", file.place("", 0, key))
    tables: dict[str, dict[str, str]] = {"names": {}, "units": {}}
    for name, entries in tables.items():
        table = content.get(name, {})
        if not isinstance(table, dict):
            problems.add(name, file.place("", 0, name), rule=f"must be a table, headed [{name}]")
            continue
        for key, value in table.items():
            if isinstance(value, str) and value:
                entries[key] = value
            else:
                problems.add(
                    f"{name}.{key} = {shown(value)}", file.place(name, 0, key), rule="must be a name in quotes"
                )
    twice = sorted({value for value in tables["names"].values() if list(tables["names"].values()).count(value) > 1})
    for value in twice:
        problems.add(f"names: {value} has two names in the system", file.place("names"))
    ignore, allow = content.get("ignore", []), content.get("allow_loop", False)
    if not isinstance(ignore, list) or not all(isinstance(name, str) for name in ignore):
        problems.add("ignore", file.place("", 0, "ignore"), rule="must be a list of names")
        ignore = []
    if not isinstance(allow, bool):
        problems.add(f"allow_loop = {shown(allow)}", file.place("", 0, "allow_loop"), rule="must be true or false")
    return SwapMap(tables["names"], tables["units"], tuple(ignore), allow is True)
