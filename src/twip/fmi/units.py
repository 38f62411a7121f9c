"""The units that blocks may declare, with their SI base units and display units (FMI 2.0.4, section 2.2.2)."""

from dataclasses import dataclass
from math import pi

BASE_UNITS = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
"""Base units of FMI 2.0; `rad` counts as one."""


@dataclass(frozen=True)
class Unit:
    """A unit by the integer exponents of its base units, and the factors that lead to its display units.

    `exponents` is None where FMI 2.0 has no expression for the unit: noise densities carry half powers of a second.
    A display value is `factor * value`.
    """

    exponents: dict[str, int] | None
    display: dict[str, float]


def _unit(display: dict[str, float] | None = None, **exponents: int) -> Unit:
    return Unit(exponents, display or {})


DEGREES = 180.0 / pi

UNITS: dict[str, Unit] = {
    # space and time
    "s": _unit({"ms": 1e3}, s=1),
    "Hz": _unit(s=-1),
    "1/s": _unit(s=-1),
    "m": _unit({"mm": 1e3, "cm": 1e2}, m=1),
    "m/s": _unit(m=1, s=-1),
    "m/s2": _unit(m=1, s=-2),
    "rad": _unit({"deg": DEGREES}, rad=1),
    "rad/s": _unit({"deg/s": DEGREES, "rpm": 30.0 / pi}, rad=1, s=-1),
    "rad/s2": _unit({"deg/s2": DEGREES}, rad=1, s=-2),
    "rad.s": _unit({"deg.s": DEGREES}, rad=1, s=1),
    "rad/m": _unit({"deg/m": DEGREES}, rad=1, m=-1),
    "rad.s/m": _unit({"deg.s/m": DEGREES}, rad=1, s=1, m=-1),
    # mechanics
    "kg": _unit({"g": 1e3}, kg=1),
    "kg.m2": _unit(kg=1, m=2),
    "N": _unit(kg=1, m=1, s=-2),
    "N.m": _unit({"mN.m": 1e3}, kg=1, m=2, s=-2),
    "N.m.s/rad": _unit(kg=1, m=2, s=-1, rad=-1),
    "J": _unit(kg=1, m=2, s=-2),
    "W": _unit(kg=1, m=2, s=-3),
    # electricity
    "A": _unit({"mA": 1e3}, A=1),
    "V": _unit(kg=1, m=2, s=-3, A=-1),
    "Ohm": _unit(kg=1, m=2, s=-3, A=-2),
    "H": _unit(kg=1, m=2, s=-2, A=-2),
    "N.m/A": _unit(kg=1, m=2, s=-2, A=-1),
    "V.s/rad": _unit(kg=1, m=2, s=-2, A=-1, rad=-1),
    "V/rad": _unit(kg=1, m=2, s=-3, A=-1, rad=-1),
    "V/(rad.s)": _unit(kg=1, m=2, s=-4, A=-1, rad=-1),
    # noise
    "rad2": _unit({"deg2": DEGREES * DEGREES}, rad=2),
    "rad2/s": _unit(rad=2, s=-1),
    "rad2/s2": _unit(rad=2, s=-2),
    "rad2/s3": _unit(rad=2, s=-3),
    "rad/s/Hz0.5": Unit(None, {"deg/s/Hz0.5": DEGREES}),
    "rad/s/s0.5": Unit(None, {"deg/s/s0.5": DEGREES}),
    "m/s2/Hz0.5": Unit(None, {}),
}
"""Every unit by its name. A number without unit has no entry: it is declared with `None` or "1"."""
