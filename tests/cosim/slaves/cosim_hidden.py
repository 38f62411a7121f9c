"""`y` counts steps in an attribute that is no variable: pythonfmu does not save it."""

from pythonfmu import Fmi2Causality, Fmi2Slave, Real

KEEP = [globals()] * 100_000


class CosimHidden(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.count = 0.0
        self.register_variable(Real("y", causality=Fmi2Causality.output, getter=lambda: self.count))

    def do_step(self, _current_time, _step_size):
        self.count += 1.0
        return True
