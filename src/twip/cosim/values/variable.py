"""What the master knows of a variable of an FMU, whatever the version of FMI."""

from dataclasses import dataclass

from .types import RECORDED_TYPES
from .units import Unit


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
