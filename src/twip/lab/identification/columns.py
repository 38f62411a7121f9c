"""The columns of a bench log: which signal holds what, in which unit."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import pi

from ...cosim import nearest
from ...errors import TwipError

UNITS: Mapping[str, Mapping[str, float]] = {
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9},
    "current": {"A": 1.0, "mA": 1e-3},
    "speed": {"rad/s": 1.0, "rpm": pi / 30.0, "deg/s": pi / 180.0, "Hz": 2.0 * pi},
    "count": {"1": 1.0},
}
"""Units of each quantity and their value in SI units; the first is the default."""
USUAL: Mapping[str, tuple[str, ...]] = {
    "time": ("time", "t"),
    "current": ("current", "sensor.current", "motor.current"),
    "speed": ("speed", "shaft_speed", "bench.shaft_speed"),
    "count": ("encoder_count", "count", "sensor.encoder_count", "motor.encoder_count"),
}
"""Names that are looked for where none is given."""


@dataclass(frozen=True)
class Column:
    """A signal by its name in the file, and the factor that makes it SI."""

    name: str
    factor: float


def parse_column(quantity: str, text: str) -> tuple[str, str | None]:
    """Return name and unit of `NAME` or `NAME:UNIT`; raises TwipError for a unit that does not fit the quantity."""
    name, colon, unit = text.rpartition(":")
    if not colon:
        return text, None
    if unit not in UNITS[quantity]:
        raise TwipError(f"--{quantity} {text}: unit {unit!r} must be one of {', '.join(UNITS[quantity])}")
    return name, unit


@dataclass(frozen=True)
class Columns:
    """What the user says about the columns: `NAME` or `NAME:UNIT` by quantity (`time`, `current`, `speed`, `count`)."""

    given: Mapping[str, str]

    def find(self, quantity: str, names: Iterable[str], place: str) -> Column | None:
        """Return the column of a quantity among a file's `names`, which may carry units: `current [mA]`.

        None if none was given and none has a usual name; raises TwipError if the given one is not there.
        """
        plain = {_split(name)[0]: name for name in names}
        if quantity in self.given:
            wanted, unit = parse_column(quantity, self.given[quantity])
            if wanted not in plain and wanted not in plain.values():
                near = nearest(wanted, plain)
                hint = f"did you mean {near[0]!r}?" if near else f"there are {', '.join(list(plain)[:8])}"
                raise TwipError(f"{place}: there is no column {wanted!r}, {hint} (--{quantity})")
            name = plain.get(wanted, wanted)
        else:
            unit = None
            found = next((usual for usual in USUAL[quantity] if usual in plain), None)
            if found is None:
                return None
            name = plain[found]
        unit = unit or _split(name)[1] or next(iter(UNITS[quantity]))
        if unit not in UNITS[quantity]:
            raise TwipError(f"{place}: unit {unit!r} of column {name!r} must be one of {', '.join(UNITS[quantity])}")
        return Column(name, UNITS[quantity][unit])


def _split(header: str) -> tuple[str, str | None]:
    """Return name and unit of a header `name [unit]`."""
    name, bracket, unit = header.strip().removesuffix("]").partition("[")
    return (name.strip(), unit.strip()) if bracket and header.strip().endswith("]") else (header.strip(), None)
