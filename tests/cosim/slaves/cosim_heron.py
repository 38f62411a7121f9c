"""`z = 1 / u`, which fails at 0, and Heron's step `y = (u + 4 / u) / 2` towards 2 or -2."""

from pythonfmu import Fmi2Causality, Fmi2Slave, Real

KEEP = [globals()] * 100_000


class CosimHeron(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.u = 0.0
        self.register_variable(Real("u", causality=Fmi2Causality.input))
        self.register_variable(Real("z", causality=Fmi2Causality.output, getter=lambda: 1.0 / self.u))
        self.register_variable(Real("y", causality=Fmi2Causality.output, getter=lambda: 0.5 * (self.u + 4.0 / self.u)))

    def do_step(self, _current_time, _step_size):
        return True
