"""One thing that varies: a variable, or several together, over given values or a distribution.

As text, an axis is its label and one of

    1,2.5,4             these values; words for Boolean, Enumeration and String variables
    1:4:7               7 values from 1 to 4, equally spaced
    1:100:5:log         5 values from 1 to 100, equal ratios between them
    normal(2, 0.1)      a distribution of scipy.stats with its arguments, in its order or by name
    x0.5:2:4            (x before any of these) multiples of the value that the variable would start with
"""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from ...cosim import Value, as_names, did_you_mean
from ...errors import Problem, TwipError

MOST_VALUES = 1_000_000
"""Largest number of values on one axis."""
_CALL = re.compile(r"([A-Za-z_][A-Za-z_0-9]*)\((.*)\)")
_FACTOR = re.compile(r"x(?=[0-9.+-]|[a-z_0-9]+\()")


@dataclass(frozen=True)
class Distribution:
    """A distribution of scipy.stats, as its `text` says."""

    text: str

    def __post_init__(self) -> None:
        self._frozen()

    def quantiles(self, probabilities: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the values below which a variable lies with these probabilities, same shape."""
        return np.asarray(self._frozen().ppf(probabilities), np.float64)

    def _frozen(self) -> Any:
        """Return the distribution. Raises `TwipError` that names what is wrong."""
        match = _CALL.fullmatch(self.text.strip())
        if match is None:
            raise TwipError(f"{self.text!r} is no distribution such as normal(2, 0.1)")
        name = {"normal": "norm"}.get(match[1], match[1])
        found = getattr(stats, name, None)
        if not isinstance(found, stats.rv_continuous | stats.rv_discrete):
            known = [n for n, d in vars(stats).items() if isinstance(d, stats.rv_continuous | stats.rv_discrete)]
            hint = did_you_mean(name, known)
            raise TwipError(f"{self.text}: scipy.stats has no distribution {match[1]}{hint}")
        positional: list[float] = []
        named: dict[str, float] = {}
        for part in filter(None, (p.strip() for p in match[2].split(","))):
            key, equals, number = part.rpartition("=")
            value = _number(number.strip())
            if value is None or (named and not equals):
                raise TwipError(f"{self.text}: {part!r} must be a number, or a name, = and a number, those last")
            if equals:
                named[key.strip()] = value
            else:
                positional.append(value)
        try:
            frozen = found(*positional, **named)
            usable = bool(np.isfinite(frozen.ppf(0.5)))
        except (TypeError, ValueError) as error:
            raise TwipError(f"{self.text}: {' '.join(str(error).split())}") from None
        if not usable:
            raise TwipError(f"{self.text}: these arguments give no distribution")
        return frozen


@dataclass(frozen=True)
class Axis:
    """What varies: all variables `names` (`component.variable`) take the same value, or the same multiple of theirs."""

    label: str
    """Name of the column that tells the value."""
    names: tuple[str, ...]
    values: tuple[Value, ...] = ()
    """Values of a list or a grid; empty for a distribution."""
    distribution: Distribution | None = None
    factor: bool = False
    """Whether the values are multiples of what the variables would start with."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "names", as_names("names", self.names))
        if not self.label or not all(self.names) or not self.names:
            raise TwipError(f"axis {self.label!r} must name at least one variable")
        if self.distribution is None and not self.values:
            raise TwipError(Problem("there are no values", subject=self.label))
        wrong = [v for v in self.values if (isinstance(v, float) and not math.isfinite(v)) or self._multiplies_no(v)]
        if wrong:
            raise TwipError(Problem(str(wrong[0]), rule="must be a finite number", subject=self.label))
        if len(set(map(repr, self.values))) < len(self.values):
            raise TwipError(Problem("a value is there twice", subject=self.label))

    def _multiplies_no(self, value: Value) -> bool:
        return self.factor and isinstance(value, str | bool)

    @classmethod
    def parse(cls, label: str, text: str, names: Sequence[str] = ()) -> "Axis":
        """Return the axis that `text` describes (see the module); without `names` the label is the variable's."""
        own = tuple(names) or (label,)
        factor = _FACTOR.match(text) is not None
        body = text[1:] if factor else text
        try:
            if _CALL.fullmatch(body.strip()):
                return cls(label, own, (), Distribution(body.strip()), factor)
            return cls(label, own, _values(body), None, factor)
        except TwipError as error:
            raise error.about(label) from None


def _values(text: str) -> tuple[Value, ...]:
    first, *rest = text.split(":")
    if not rest:
        words = [word.strip() for word in text.split(",")]
        if not all(words):
            raise TwipError("there are no values" if not text.strip() else f"{text!r} has an empty value")
        return tuple(_value(word) for word in words)
    low, high, count = _number(first), _number(rest[0]), _number(rest[1]) if len(rest) > 1 else None
    if low is None or high is None or count is None or len(rest) > 3 or (len(rest) == 3 and rest[2] != "log"):
        raise TwipError(f"{text!r} must be FROM:TO:COUNT or FROM:TO:COUNT:log")
    if count != int(count) or not 1 <= count <= MOST_VALUES:
        raise TwipError(f"{text!r}: the grid must have at least one and at most {MOST_VALUES} values")
    if len(rest) == 2:
        return tuple(np.linspace(low, high, int(count)).tolist())
    if low <= 0.0 or high <= 0.0:
        raise TwipError(f"{text!r}: the ends of a logarithmic grid must be positive")
    return tuple(np.geomspace(low, high, int(count)).tolist())


def _value(word: str) -> Value:
    try:
        return int(word)
    except ValueError:
        number = _number(word)
        return word if number is None else number


def _number(text: str) -> float | None:
    try:
        number = float(text) if "_" not in text else math.nan
    except ValueError:
        return None
    return number if math.isfinite(number) else None
