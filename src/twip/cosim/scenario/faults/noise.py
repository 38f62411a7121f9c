"""`noise`: the value plus a normally distributed number, a new one in each step."""

import math
import random

from .base import Effect, Fault, Key, Moment


class Noise(Fault):
    """A random error."""

    kind = "noise"
    keys = (Key("deviation", above=0.0, rule="a positive number"),)
    seeded = True
    rank = 3

    def __str__(self) -> str:
        return f"{self.signal} has noise of standard deviation {self.amounts['deviation']}, seed {self.seed}"

    @property
    def every_step(self) -> bool:
        """Each step has a number of its own."""
        return True

    def act(self, now: Moment, /) -> Effect:
        """Return an offset."""
        return Effect(offset=now.difference(self.amounts["deviation"]) * _normal(self.chance(now.step)))


def _normal(generator: random.Random) -> float:
    """Return a normally distributed number (Box and Muller 1958)."""
    radius = math.sqrt(-2.0 * math.log(1.0 - generator.random()))
    return radius * math.cos(2.0 * math.pi * generator.random())
