"""How a run is to be stepped, as a file proposes it (in the annotation `org.twip.cosim`) or a caller asks for it."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any

from ..reading.problems import Place

_SCHEME = ("coupling", "mid_step", "order", "options")
"""What belongs to a coupling, and is set aside when the caller names another."""
_LIMITS = ("minimum_step", "maximum_step")


@dataclass(frozen=True)
class Algorithm:
    """What somebody says about the steps of a run; None where nothing is said. `Coupling.of` checks it."""

    step_size: float | None = None
    """Communication step in s; the first one if steps are variable."""
    coupling: str | None = None
    mid_step: tuple[str, ...] | None = None
    """Inputs (`component.variable`) that are taken at the middle of a step."""
    order: tuple[str, ...] | None = None
    """All components in the order of execution."""
    own_steps: Mapping[str, float] | None = None
    """Own steps in s, by component."""
    options: Mapping[str, float] = field(default_factory=dict)
    """Of the coupling alone, by name, such as `iteration_tolerance` and `maximum_iterations` of iterated coupling."""
    tolerance: float | None = None
    """Local error per step, relative to magnitude or nominal value; 0 stands for equal steps."""
    minimum_step: float | None = None
    maximum_step: float | None = None
    places: Mapping[tuple[str, str], Place] = field(default_factory=dict, compare=False)
    """Where a file names what: by the field's name, and the name in it (empty for a field without names)."""

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
