"""`dx/dt = u` by explicit Euler; steps longer than `longest` are discarded, as an FMU may do that cannot take them."""

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real

KEEP = [globals()] * 100_000


class CosimReluctant(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.u = 1.0
        self.longest = 0.1
        self.x = 0.0
        self.register_variable(Real("u", causality=Fmi2Causality.input))
        self.register_variable(Real("longest", causality=Fmi2Causality.parameter, variability=Fmi2Variability.fixed))
        self.register_variable(Real("x", causality=Fmi2Causality.output))

    def do_step(self, _current_time, step_size):
        self.x += step_size * self.u
        return step_size <= self.longest
