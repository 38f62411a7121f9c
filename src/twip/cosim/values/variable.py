"""What the master knows of an FMU and of its variables, whatever the version of FMI."""

import pathlib
from dataclasses import dataclass
from functools import cached_property

from .shapes import Shape, shapes_of
from .types import TYPES
from .units import Unit

RECORDED_TYPES = tuple(TYPES)


@dataclass(frozen=True)
class Variable:
    """One scalar variable of an FMU, or one element of an array variable."""

    name: str
    """An element of an array has its indices behind the name: `x[1]`, `x[2,1]`."""
    reference: int
    """Value reference; the elements of an array share one."""
    type: str
    """One of `RECORDED_TYPES`, or `Enumeration`, `Binary` or `Clock`."""
    recorded_type: str
    """The type as it is transferred and recorded: an enumeration travels as Integer (FMI 2) or Int64 (FMI 3)."""
    causality: str
    variability: str
    initial: str | None
    unit: Unit | None
    minimum: float | None
    maximum: float | None
    nominal: float
    items: tuple[tuple[str, int], ...]
    """Names and values of an enumeration."""
    start: str | None
    """As the model description writes it."""
    description: str
    array: str | None = None
    """Name of the array variable that this is an element of; its elements follow each other, the last index fastest."""
    alias_of: str | None = None
    """The variable that this is another name of (FMI 3): a connector may have such a name, but it is not
    set."""
    relative: bool = False
    """Whether it is a difference (`relativeQuantity`): the offset of its unit does not count."""

    @property
    def kinds(self) -> tuple[str, ...]:
        """Kinds that a connector of the variable may have (SSP 2.0 has `constant`), the most telling one last."""
        return (self.causality, "constant") if self.variability == "constant" else (self.causality,)

    @property
    def settable(self) -> bool:
        """Whether a start value may be set before initialization (FMI 2.0.4 section 4.2.4, FMI 3.0.1 section 2.4.7)."""
        return not self.obstacle

    @property
    def obstacle(self) -> str:
        """Why no start value may be set, or nothing."""
        if self.alias_of is not None:
            return f"it is another name of {self.alias_of}"
        if self.causality == "structuralParameter":
            return "it is a structural parameter, and arrays are not resized"
        if self.recorded_type not in RECORDED_TYPES:
            return f"values of type {self.type} are not supported"
        if self.variability != "constant" and (self.initial in ("exact", "approx") or self.causality == "input"):
            return ""
        return f"it is a {self.variability} {self.causality}"


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
