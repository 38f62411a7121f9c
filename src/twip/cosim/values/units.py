"""Units and the conversion between them.

A unit is given by its SI base-unit exponents, a factor and an offset: `base = factor * value + offset` (FMI 2.0.4
section 2.2.2, SSP 1.0 section 4.4.2). The radian counts as a base unit of its own, as in both standards.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

BASE_UNITS = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")


@dataclass(frozen=True)
class Unit:
    """A unit by name; without `exponents` it is known by name only."""

    name: str
    exponents: tuple[int, ...] | None = None
    """Exponents of kg, m, s, A, K, mol, cd, rad."""
    factor: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True)
class Affine:
    """`y = factor * x + offset`; the default returns x itself, its sign of zero included, because x + (-0.0) is x."""

    factor: float = 1.0
    offset: float = -0.0

    def __call__(self, x: float) -> float:
        """Return y."""
        return self.factor * x + self.offset

    def then(self, after: "Affine") -> "Affine":
        """Return the conversion that applies this one first, `after` next."""
        return Affine(after.factor * self.factor, after.factor * self.offset + after.offset)

    def inverse(self, y: float) -> float:
        """Return the x that gives `y` (NaN when the factor is zero)."""
        return (y - self.offset) / self.factor if self.factor else float("nan")


IDENTITY = Affine()


class UnitMismatchError(Exception):
    """Two units measure different things, or one of them is not defined."""


def conversion(source: Unit | None, target: Unit | None, relative: bool = False) -> Affine:
    """Return the conversion of a value in `source` to the same quantity in `target`.

    Of a `relative` quantity, such as a difference of temperatures, the offsets do not count: base = factor * value
    (FMI 2.0.4 section 2.2.2, FMI 3.0.1 section 2.4.3). Without a unit on one side nothing is known and the value passes
    as it is. Raises `UnitMismatchError` when the exponents differ, when units of different names lack a definition, and
    when float64 cannot convert there and back.
    """
    if source is None or target is None:
        return IDENTITY
    if source.exponents is None or target.exponents is None:
        if source.name == target.name:
            return IDENTITY
        raise UnitMismatchError(f"unit {(source if source.exponents is None else target).name} has no definition")
    if source.exponents != target.exponents:
        raise UnitMismatchError("units differ")
    difference = 0.0 if relative else source.offset - target.offset
    if source.factor == target.factor and difference == 0.0:
        return IDENTITY
    ways = [(a.factor / b.factor, difference / b.factor) for a, b in ((source, target), (target, source))]
    if not all(factor and math.isfinite(factor) and math.isfinite(offset) for factor, offset in ways):
        raise UnitMismatchError("the conversion is beyond the range of float64")
    factor, offset = ways[0]
    return Affine(factor, offset or -0.0)


def lookup(name: str | None, *definitions: Mapping[str, Unit]) -> Unit | None:
    """Return the unit called `name` from the first of `definitions` that has it, else the bare name."""
    if not name:
        return None
    for known in definitions:
        if name in known:
            return known[name]
    return Unit(name)
