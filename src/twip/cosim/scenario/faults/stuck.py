"""`stuck`: the input takes a constant."""

from .base import Effect, Fault, Key, Moment


class Stuck(Fault):
    """The given value, or the last one before the fault."""

    kind = "stuck"
    keys = (Key("value", required=False, of_signal=True),)
    real = False
    rank = 1

    def __str__(self) -> str:
        return f"{self.signal} is stuck at {self.amounts.get('value', 'its last value')}"

    def act(self, now: Moment, /) -> Effect:
        """Return a constant."""
        given = self.amounts.get("value")
        value = None if given is None else now.convert(given.number)
        return Effect(0.0, now.held if value is None else value)
