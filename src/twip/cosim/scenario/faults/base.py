"""What all kinds of faults share: the keys of their entries in scenario files, and what they make of a value."""

import random
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar, NamedTuple

from ...reading.problems import Place
from ...values.conversion import Conversion
from ...values.types import family
from ..targets import RULES


@dataclass(frozen=True)
class Key:
    """A key of a fault's entry, which gives a number or a value of the signal, such as `value = 0.02`."""

    name: str
    required: bool = True
    default: float | None = None
    """Number that stands for a missing key which is not required; None leaves it out of `Fault.amounts`."""
    unit: str | None = None
    """Unit of the number; None for that of the signal."""
    above: float | None = None
    """The number must be greater."""
    most: float | None = None
    """The number must not be greater."""
    rule: str = RULES["Real"]
    """What it must be, in words."""
    of_signal: bool = False
    """Whether it is a value of the signal: of its type, and right for every input that takes it."""
    steps: bool = False
    """Whether it is a time in s that must be a whole number of steps."""


@dataclass(frozen=True)
class Amount:
    """What an entry gives under a key."""

    number: float
    """A value of the signal as the vector of a run holds it, otherwise the number itself."""
    text: str
    """In words, with its unit."""
    steps: int = 0
    """A time as a number of steps, where the key asks for one."""

    def __str__(self) -> str:
        return self.text


class Moment(NamedTuple):
    """What a fault may go by when it acts on an input in a step."""

    step: int
    """Number of the step, counted from the start time."""
    held: float
    """The last value that left the fault, in the unit of the input."""
    convert: Conversion
    """From a value of the signal to one of the input."""

    def difference(self, amount: Amount) -> float:
        """Return a difference of two values of the signal in the unit of the input."""
        return self.convert.affine.factor * amount.number


class Effect(NamedTuple):
    """What an input takes: factor · what arrived + offset, in the unit of the input."""

    factor: float = 1.0
    offset: float = -0.0
    """Minus zero changes no value, zero would change minus zero."""
    delayed: bool = False
    """Whether what arrived `Fault.history` steps ago counts, instead of what arrives now."""


@dataclass(frozen=True)
class Fault(ABC):
    """A fault of one or more connections in the steps `first` to `last` (exclusive).

    It acts on the value that the input would take without it, after unit conversion and transformation.
    """

    kind: ClassVar[str]
    """Its name in scenario files."""
    keys: ClassVar[tuple[Key, ...]] = ()
    """Keys of its entry besides `signal`, `kind`, `start`, `stop` and `seed`."""
    seeded: ClassVar[bool] = False
    """Whether it is random, with a key `seed`."""
    real: ClassVar[bool] = True
    """Whether only Real signals can have it."""
    rank: ClassVar[int] = 100
    """Place among the kinds where they are listed; equal ones are in the order of their names."""

    name: str
    """Its place in the scenario file, such as `faults[2]`."""
    signal: str
    """The output whose connections fail, or the input whose connection fails."""
    targets: tuple[tuple[int, Conversion], ...]
    """For each failing connection the column it leads to, and the conversion of a value of `signal` to that of the
    column.
    """
    times: tuple[float | None, float | None]
    """Where it begins and ends, in s; None for the run's beginning and end."""
    first: int
    last: int
    amounts: Mapping[str, Amount] = field(default_factory=dict)
    """By key."""
    seed: int = 0
    place: Place | None = None
    """Where it is asked for."""

    @abstractmethod
    def __str__(self) -> str:
        """The signal and what happens to it, in words."""

    @abstractmethod
    def act(self, now: Moment, /) -> Effect:
        """Return what an input takes in one of the steps from `first` on, before `last`."""

    @property
    def every_step(self) -> bool:
        """Whether its effect differs from step to step; otherwise `act` need not be called for each."""
        return False

    @property
    def history(self) -> int:
        """For how many steps it remembers what arrived; 0 where nothing is delayed."""
        return 0

    @classmethod
    def objection(cls, type_: str) -> str:
        """Return why signals of a type cannot have this fault; empty where they can."""
        return f"{cls.kind} needs a Real signal, not {type_}" if cls.real and family(type_) != "Real" else ""

    def chance(self, step: int) -> random.Random:
        """Return the random numbers of a step; they depend on seed, signal, place in the file and step alone."""
        return random.Random(f"{self.seed} {self.signal} {self.name} {step}")
