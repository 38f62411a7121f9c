"""A claim as numbers: what the paper says, what was expected, what was measured, and whether both hold."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from statistics import fmean


@dataclass(frozen=True)
class Check:
    """One quantity of a figure, measured once per seed.

    The expectation is met when every value lies between `low` and `high`. Whether the paper's claim holds is another
    question: a figure may show, as expected, that it does not.
    """

    figure: str
    claim: str
    """The paper's claim, or what this row adds to it."""
    quantity: str
    measured: Sequence[float]
    low: float
    high: float
    unit: str
    source: str
    """Where the expected range comes from."""
    holds: bool | None = None
    """Whether the paper's claim holds; None where the row stands for no claim of the paper."""
    only: str = ""
    """The condition under which it holds."""
    note: str = ""
    each: str = "seeds"
    """What the measured values belong to."""

    @property
    def met(self) -> bool:
        """Every measured value is in the expected range."""
        return bool(self.measured) and all(self.low <= value <= self.high for value in self.measured)

    @property
    def expected_text(self) -> str:
        """The expected range in words."""
        return interval(self.low, self.high, self.unit)

    @property
    def measured_text(self) -> str:
        """Mean and extremes of what was measured."""
        mean, count = number(fmean(self.measured)), len(self.measured)
        if count == 1:
            return with_unit(mean, self.unit)
        low, high = number(min(self.measured)), number(max(self.measured))
        return f"{with_unit(mean, self.unit)} ({low} … {high}, {count} {self.each})"

    @property
    def holds_text(self) -> str:
        """Whether the paper's claim holds, in words."""
        if self.holds is None:
            return "–"
        if not self.holds:
            return f"no: {self.only}" if self.only else "no"
        return f"only {self.only}" if self.only else "yes"


@dataclass(frozen=True)
class Result:
    """What the module of a figure returns."""

    name: str
    """Name of the module and of the picture: `fig07`."""
    title: str
    checks: Sequence[Check]
    commands: Sequence[str] = field(default=())
    """Commands that repeat the runs in the picture."""


def number(value: float) -> str:
    """Write a number with three significant digits, never in powers of ten for what these experiments measure."""
    if value != value or value in (float("inf"), float("-inf")):
        return str(value)
    if value == 0.0 or 1e-3 <= abs(value) < 1e5:
        digits = 0 if abs(value) >= 100 else 1 if abs(value) >= 10 else 2 if abs(value) >= 0.1 else 3
        text = f"{value:.{digits}f}"
        return text.rstrip("0").rstrip(".") if "." in text else text
    return f"{value:.3g}"


def with_unit(text: str, unit: str) -> str:
    """Put the unit behind a number; none behind a bare count, no space before the degree sign."""
    return text if unit in ("", "1") else f"{text}{unit}" if unit.startswith("°") else f"{text} {unit}"


def interval(low: float, high: float, unit: str) -> str:
    """Write a range; one without a lower or an upper end as an inequality."""
    if low == high:
        return with_unit(number(low), unit)
    if high == float("inf"):
        return f"≥ {with_unit(number(low), unit)}"
    if low == float("-inf"):
        return f"≤ {with_unit(number(high), unit)}"
    return f"{number(low)} … {with_unit(number(high), unit)}"
