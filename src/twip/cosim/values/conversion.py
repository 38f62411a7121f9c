"""What becomes of a value on its way along connections."""

from dataclasses import dataclass

from .transformation import Mapping
from .units import IDENTITY, Affine


@dataclass(frozen=True)
class Conversion:
    """What becomes of a value on its way: `affine` of a Real, `mapping` (None for none) of a Boolean, Integer or
    Enumeration.
    """

    affine: Affine = IDENTITY
    mapping: Mapping | None = None

    def __call__(self, value: float) -> float | None:
        """Return the converted value, None for one that must not occur; a whole number stays one."""
        if self.mapping is None:
            return value if self.affine == IDENTITY else self.affine(value)
        return self.mapping(int(value))

    def inverse(self, value: float) -> float:
        """Return what becomes `value`."""
        if self.mapping is None:
            return value if self.affine == IDENTITY else self.affine.inverse(value)
        return self.mapping.inverse(value)
