"""`dx/dt = u` by explicit Euler: over a step of constant input that is exact."""

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real

KEEP = [globals()] * 100_000


class CosimIntegrator(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.u = 0.0
        self.x_start = 0.0
        self.x = 0.0
        self.register_variable(Real("u", causality=Fmi2Causality.input))
        self.register_variable(Real("x_start", causality=Fmi2Causality.parameter, variability=Fmi2Variability.fixed))
        self.register_variable(Real("x", causality=Fmi2Causality.output))

    def enter_initialization_mode(self):
        self.x = self.x_start

    def do_step(self, _current_time, step_size):
        self.x += step_size * self.u
        return True
