"""`dropout`: values are lost, the input keeps the last one that came through."""

from .base import Effect, Fault, Key, Moment


class Dropout(Fault):
    """A step loses its value, always or with a probability."""

    kind = "dropout"
    keys = (
        Key(
            "probability",
            required=False,
            default=1.0,
            unit="",
            above=0.0,
            most=1.0,
            rule="a probability above 0, at most 1",
        ),
    )
    seeded = True
    real = False
    rank = 4

    def __str__(self) -> str:
        text = f"{self.signal} drops out"
        return f"{text} with probability {self.amounts['probability']}, seed {self.seed}" if self.every_step else text

    @property
    def every_step(self) -> bool:
        """Whether chance decides."""
        return self.amounts["probability"].number != 1.0

    def act(self, now: Moment, /) -> Effect:
        """Return the last value, or let the new one through."""
        probability = self.amounts["probability"].number
        lost = probability == 1.0 or self.chance(now.step).random() < probability
        return Effect(0.0, now.held) if lost else Effect()
