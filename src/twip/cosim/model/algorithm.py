"""How a run is to be stepped, as a file proposes it (in the annotation `org.twip.cosim`) or a caller asks for it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any

from ..reading.arguments import by_name, names
from ..reading.problems import Place

_SCHEME = ("coupling", "mid_step", "order", "options")
"""What belongs to a coupling, and is set aside when the caller names another."""
_LIMITS = ("minimum_step", "maximum_step")


@dataclass(frozen=True)
class Algorithm:
    """How a run is to be stepped; None where nothing is said. `Coupling.of` checks it."""

    coupling: str | None = None
    """`jacobi`, `gauss-seidel` or `iterated`; one that a caller names sets aside the proposed inputs at mid-step, order
    and options."""
    mid_step: Sequence[str] | None = None
    """Inputs (`component.variable`) that are taken at the middle of each step, on the line through their source's last
    two values."""
    order: Sequence[str] | None = None
    """All components in the order in which Gauss–Seidel is to run them, instead of that of their feed-through."""
    own_steps: Mapping[str, float] | None = None
    """Own steps in s by component, whole multiples of the communication step."""
    options: Mapping[str, float] = field(default_factory=dict)
    """Of the coupling alone, by name, such as `iteration_tolerance` and `maximum_iterations` of iterated coupling."""
    tolerance: float | None = None
    """Largest local error of a variable step, relative to magnitude or nominal value; 0 stands for equal steps. Jumps
    of time series, parameter changes and the stop time are hit exactly."""
    minimum_step: float | None = None
    """Smallest variable step in s; default: a millionth of the first."""
    maximum_step: float | None = None
    """Largest variable step in s."""
    places: Mapping[tuple[str, str], Place] = field(default_factory=dict, compare=False)
    """Where a file names what: by the field's name, and the name in it (empty for a field without names)."""

    def __post_init__(self) -> None:
        """Take one name where several may be given. Raises `TwipError` for what is no name or no mapping."""
        for name in ("mid_step", "order"):
            if (given := getattr(self, name)) is not None:
                object.__setattr__(self, name, names(name, given))
        if self.own_steps is not None:
            by_name("own_steps", self.own_steps)
        by_name("options", self.options)

    def over(self, proposed: "Algorithm") -> "Algorithm":
        """Return this completed by what is `proposed`; a coupling sets aside what belongs to the proposed one, equal
        steps set aside the limits of variable ones.
        """
        dropped = (_SCHEME if self.coupling is not None else ()) + (_LIMITS if self.tolerance == 0.0 else ())
        taken = {
            f.name: getattr(proposed, f.name)
            for f in fields(self)
            if f.name not in ("places", *dropped) and getattr(self, f.name) is None
        }
        if "options" not in dropped:
            taken["options"] = {**proposed.options, **self.options}
        return self.having(taken)

    def having(self, values: Mapping[str, Any]) -> "Algorithm":
        """Return this with other values of the fields that are named."""
        return replace(self, **values)
