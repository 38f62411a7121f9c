"""What the master knows of an FMU, whatever the version of FMI."""

import pathlib
from dataclasses import dataclass
from functools import cached_property

from ..values.shapes import Shape, shapes_of
from ..values.types import RECORDED_TYPES
from ..values.units import Unit
from ..values.variable import Variable


@dataclass(frozen=True)
class Fmu:
    """An FMI 2.0 or 3.0 co-simulation FMU."""

    path: pathlib.Path
    """The archive, or the folder of an unpacked FMU."""
    name: str
    """How messages call it."""
    guid: str
    """The instantiation token in FMI 3."""
    model_identifier: str
    generation_tool: str
    sha256: str
    variables: dict[str, Variable]
    feedthrough: dict[str, frozenset[str]]
    """For each output, the inputs it depends on within the same instant; all of them where the FMU does not say."""
    units: dict[str, Unit]
    only_once: bool
    """Whether a process may hold one instance only."""
    step_size: float | None
    """Step of the default experiment in s."""
    serializes_state: bool
    """Whether the state of an instance can be saved as bytes and restored."""
    saves_state: bool
    """Whether an instance can go back to a state that it had."""
    varies_step: bool
    """Whether the size of its steps may change."""
    fmi_version: str = "2.0"
    """As the model description states it."""
    native_reference: int | None = None
    """Value reference of the String that says where an instance's native functions are; see `native`."""

    @cached_property
    def shapes(self) -> dict[tuple[str, int], Shape]:
        """Sizes of the arrays by name and number of dimensions, as the names of their elements show them."""
        return shapes_of(self.variables)

    def meant(self, variable: Variable) -> Variable:
        """Return the variable that `variable` is another name of, else itself."""
        if variable.alias_of is None:
            return variable
        index = "" if variable.array is None else variable.name[len(variable.array) :]
        return self.variables[variable.alias_of + index]

    def ports(self, causality: str) -> tuple[Variable, ...]:
        """The recorded inputs or outputs, by type in the order of `RECORDED_TYPES`, those of a type in the order of the
        model description.
        """
        found = [
            v
            for v in self.variables.values()
            if v.causality == causality and v.alias_of is None and v.recorded_type in RECORDED_TYPES
        ]
        return tuple(sorted(found, key=lambda v: RECORDED_TYPES.index(v.recorded_type)))
