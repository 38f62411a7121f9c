"""An identified number with its interval, or the reason why the data cannot tell it."""

from collections.abc import Sequence
from dataclasses import dataclass

CONFIDENCE = 0.95
"""Probability that an interval is to cover the true value."""
WIDEST = 0.5
"""Half-width of an interval, relative to the value, beyond which a parameter counts as not identifiable."""


@dataclass(frozen=True)
class Estimate:
    """A parameter's value and 95 % interval in `unit`; value None, with the `reason`, if the data cannot tell it."""

    name: str
    unit: str
    value: float | None
    low: float | None = None
    high: float | None = None
    reason: str = ""

    @property
    def identifiable(self) -> bool:
        """The data tell the parameter."""
        return self.value is not None

    def covers(self, truth: float) -> bool:
        """Tell whether the interval holds `truth`; False for a parameter that is not identifiable."""
        return self.low is not None and self.high is not None and self.low <= truth <= self.high

    def found(self) -> float:
        """Return the value; raises ValueError where there is none."""
        if self.value is None:
            raise ValueError(f"{self.name} is not identifiable: {self.reason}")
        return self.value


def judged(name: str, unit: str, value: float, low: float, high: float, advice: str) -> Estimate:
    """Return the estimate if its interval is narrow enough to mean something, else say so and give the `advice`."""
    half = 0.5 * (high - low)
    if half <= WIDEST * abs(value):
        return Estimate(name, unit, float(value), float(low), float(high))
    share = half / abs(value) if value else float("inf")
    return Estimate(name, unit, None, reason=f"interval of ±{100.0 * share:.3g} % of the value; {advice}")


def weighted_mean(estimates: Sequence[Estimate]) -> float:
    """Return the mean of identifiable estimates of one quantity, weighted by the squares of their intervals."""
    known = [e for e in estimates if e.value is not None and e.low is not None and e.high is not None]
    weights = [1.0 / max((float(e.high or 0.0) - float(e.low or 0.0)) ** 2, 1e-300) for e in known]
    return sum(w * e.found() for w, e in zip(weights, known, strict=True)) / sum(weights)
