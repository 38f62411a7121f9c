"""`y = 2 u`, both of 2 x 3 elements under the names that FMI 3 gives to elements, and a parameter `k` of 2."""

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real

KEEP = [globals()] * 100_000


class CosimArray(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.values = {}
        for name in [f"u[{i},{j}]" for i in (1, 2) for j in (1, 2, 3)]:
            self.values[name] = 0.0
            self.register_variable(
                Real(name, causality=Fmi2Causality.input, getter=self.get(name), setter=self.set(name))
            )
            self.register_variable(
                Real(name.replace("u", "y"), causality=Fmi2Causality.output, getter=self.get(name, 2.0))
            )
        for name in ("k[1]", "k[2]"):
            self.values[name] = 1.0
            more = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.fixed}
            self.register_variable(Real(name, getter=self.get(name), setter=self.set(name), **more))

    def get(self, name, factor=1.0):
        return lambda: factor * self.values[name]

    def set(self, name):
        return lambda value: self.values.__setitem__(name, value)

    def do_step(self, _current_time, _step_size):
        return True
