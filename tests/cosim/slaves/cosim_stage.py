"""A resistor and a capacitor behind it, exact for a held voltage `u` and load current `load`: x' = ((u - x) / R - load)
/ C; `x` is the capacitor's voltage, `i` = (u - x) / R the current into the stage, in the same instant.
"""

import math

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real

KEEP = [globals()] * 100_000


class CosimStage(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.u = 0.0
        self.load = 0.0
        self.resistance = 1.0
        self.capacity = 1.0
        self.x_start = 0.0
        self.x = 0.0
        fixed = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.fixed}
        for name in ("resistance", "capacity", "x_start"):
            self.register_variable(Real(name, **fixed))
        for name in ("u", "load"):
            self.register_variable(Real(name, causality=Fmi2Causality.input))
        self.register_variable(Real("x", causality=Fmi2Causality.output))
        self.register_variable(
            Real("i", causality=Fmi2Causality.output, getter=lambda: (self.u - self.x) / self.resistance)
        )

    def enter_initialization_mode(self):
        self.x = self.x_start

    def do_step(self, _current_time, step_size):
        end = self.u - self.resistance * self.load
        self.x = end + (self.x - end) * math.exp(-step_size / (self.resistance * self.capacity))
        return True
