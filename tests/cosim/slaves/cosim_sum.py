"""`y = k * u + m * v`, in the same instant; says so in every step where `talks`."""

from pythonfmu import Boolean, Fmi2Causality, Fmi2Slave, Fmi2Variability, Real

KEEP = [globals()] * 100_000


class CosimSum(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.u = 0.0
        self.v = 0.0
        self.k = 1.0
        self.m = 1.0
        self.talks = False
        fixed = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.fixed}
        self.register_variable(Real("u", causality=Fmi2Causality.input))
        self.register_variable(Real("v", causality=Fmi2Causality.input))
        self.register_variable(Real("k", **fixed))
        self.register_variable(Real("m", **fixed))
        self.register_variable(Boolean("talks", **fixed))
        self.register_variable(
            Real("y", causality=Fmi2Causality.output, getter=lambda: self.k * self.u + self.m * self.v)
        )

    def do_step(self, _current_time, _step_size):
        if self.talks:
            self.log(f"u is {self.u}")
        return True
