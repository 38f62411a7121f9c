"""`bias`: the value plus a constant."""

from .base import Effect, Fault, Key, Moment


class Bias(Fault):
    """A constant error."""

    kind = "bias"
    keys = (Key("value"),)
    rank = 2

    def __str__(self) -> str:
        return f"{self.signal} is biased by {self.amounts['value']}"

    def act(self, now: Moment, /) -> Effect:
        """Return an offset."""
        return Effect(offset=now.difference(self.amounts["value"]))
