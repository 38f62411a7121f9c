"""`y = k * u` and `z = -u`, in the same instant."""

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real

KEEP = [globals()] * 100_000  # pythonfmu drops one reference to a slave module's globals with each instance


class CosimGain(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.u = 0.5
        self.k = 2.0
        self.register_variable(Real("u", causality=Fmi2Causality.input))
        self.register_variable(Real("k", causality=Fmi2Causality.parameter, variability=Fmi2Variability.fixed))
        self.register_variable(Real("y", causality=Fmi2Causality.output, getter=lambda: self.k * self.u))
        self.register_variable(Real("z", causality=Fmi2Causality.output, getter=lambda: -self.u))

    def do_step(self, _current_time, _step_size):
        return True
