"""What the steps of a run with variable steps were like."""

import math
from dataclasses import dataclass


@dataclass
class VariableSteps:
    """What the steps of a run were like."""

    smallest: float = math.inf
    """Smallest communication step in s; one that had to end at an event counts too."""
    largest: float = 0.0
    taken_back: int = 0
    """Steps that had to be repeated with a smaller size."""

    def __str__(self) -> str:
        return f"{self.smallest:.3g} s to {self.largest:.3g} s, {self.taken_back} taken back"
