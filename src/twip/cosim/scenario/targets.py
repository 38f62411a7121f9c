"""What values from outside may be, such as time series and the constants of faults: of the type of the signal that they
stand for, and right for every input that takes them.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from ..model.system import System
from ..values.conversion import Conversion
from ..values.transformation import Items
from ..values.types import TYPES, family, misfit
from ..values.variable import Variable
from ..values.written import Value, out_of_range

RULES = {name: kind.rule for name, kind in TYPES.items()} | {
    "Real": "a finite number",
    "Boolean": "true, false, 1 or 0",
}
"""What a value of a type must be."""


@dataclass(frozen=True)
class End:
    """An input of a component that takes a value, and what becomes of the value on its way."""

    name: str
    """`component.variable`."""
    variable: Variable
    conversion: Conversion | None = None
    """None where the value is meant for the input itself."""


@dataclass(frozen=True)
class Target:
    """An open input that a time series may drive."""

    name: str
    column: int
    type: str
    items: Items
    """Names and values of an enumeration."""
    ends: tuple[End, ...]
    """The input itself, or those behind a connector."""

    @property
    def linear(self) -> bool:
        """Whether values are linear between rows; they are held where anything that takes them is discrete."""
        continuous = (end.variable.variability == "continuous" for end in self.ends)
        return family(self.type) == "Real" and all(continuous)


def signal_type(system: System, column: int) -> tuple[str, Items]:
    """Return the type of a column as its variable or connector declares it, and the items of an enumeration."""
    variable = system.variables.get(column)
    if variable is not None:
        return variable.type, variable.items
    return system.connector_types[column]


def ends_of(system: System, column: int) -> tuple[End, ...]:
    """Return the inputs of components that take the value of a column, which may be an input itself."""
    names, variables = system.columns, system.variables
    own = variables.get(column)
    if own is not None and own.causality == "input":
        return (End(names[column], own),)
    return tuple(
        End(names[c.destination], variables[c.destination], c.conversion)
        for c in system.copies
        if c.source == column and c.destination in variables
    )


def objections(name: str, value: Value, ends: Sequence[End]) -> list[str]:
    """Return why inputs cannot take `value`, which is called `name`: no value there, or out of bounds."""
    found: list[str] = []
    if isinstance(value, str):
        return found
    for end in ends:
        moved = value if end.conversion is None else end.conversion(value)
        if moved is None:
            found.append(f"{name} = {value} has no value for {end.name}: it is not mapped")
        elif end.conversion is None:
            found += out_of_range(end.variable, value, name)
        elif why := misfit(end.variable.recorded_type, moved):
            found.append(f"{name} = {value}: {end.name} cannot take {moved}, {why}")
        else:
            found += [f"{name} = {value}: {line}" for line in out_of_range(end.variable, moved, end.name)]
    return found
