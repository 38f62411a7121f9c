"""Integer, Boolean and Real ports; `seen` is `held` and `clock` the time at the beginning of the last step."""

from pythonfmu import Boolean, Fmi2Causality, Fmi2Slave, Fmi2Variability, Integer, Real, String

KEEP = [globals()] * 100_000


class CosimMixed(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.n = 3
        self.on = False
        self.held = 0.25
        self.smooth = 1.0
        self.label = "none"
        self.total = 0
        self.inverted = True
        self.seen = 0.0
        self.clock = 0.0
        self.sets = 0.0
        inputs = {"causality": Fmi2Causality.input}
        outputs = {"causality": Fmi2Causality.output}
        discrete = {"variability": Fmi2Variability.discrete}
        self.register_variable(Real("smooth", **inputs))
        self.register_variable(Integer("n", **inputs))
        self.register_variable(Boolean("on", **inputs))
        self.register_variable(Real("held", **inputs, **discrete))
        self.register_variable(Integer("total", **outputs))
        self.register_variable(Boolean("inverted", **outputs))
        self.register_variable(Real("seen", **outputs))
        self.register_variable(Real("clock", **outputs))
        self.register_variable(Real("sets", **outputs))
        tuned = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.tunable}
        self.register_variable(String("label", **tuned))

    def set_real(self, vrs, values):
        super().set_real(vrs, values)
        self.sets += len(vrs)

    def do_step(self, current_time, _step_size):
        self.total += self.n
        self.inverted = not self.on
        self.seen = self.held
        self.clock = current_time
        return True
