"""`delay`: values arrive later."""

from .base import Effect, Fault, Key, Moment


class Delay(Fault):
    """What would have arrived some steps ago; before the first step, what the input was initialized with."""

    kind = "delay"
    keys = (Key("delay", unit="s", above=0.0, rule="a positive number", steps=True),)
    real = False
    rank = 5

    def __str__(self) -> str:
        return f"{self.signal} is delayed by {self.amounts['delay']}"

    @property
    def history(self) -> int:
        """The delay."""
        return self.amounts["delay"].steps

    @classmethod
    def objection(cls, type_: str) -> str:
        """A checkpoint cannot keep texts that are on their way."""
        return "a String cannot be delayed" if type_ == "String" else ""

    def act(self, _: Moment, /) -> Effect:
        """Return what arrived earlier."""
        return Effect(delayed=True)
