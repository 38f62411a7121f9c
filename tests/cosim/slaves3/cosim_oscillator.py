"""An FMI 3.0 slave: x' = v, v' = gain u - spring x by semi-implicit Euler, with an Int64, a Boolean and a String."""

from pythonfmu3 import (
    Boolean,
    Float64,
    Fmi3Causality,
    Fmi3Slave,
    Fmi3StepResult,
    Fmi3Variability,
    Int64,
    String,
)


class CosimOscillator(Fmi3Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.time = 0.0
        self.u = 0.0
        self.x = 1.0
        self.v = 0.0
        self.steps = 0
        self.up = False
        self.said = "none"
        self.word = "none"
        self.spring = 1.0
        self.gain = 2.0
        continuous = {"variability": Fmi3Variability.continuous}
        discrete = {"variability": Fmi3Variability.discrete}
        given, found = Fmi3Causality.input, Fmi3Causality.output
        self.register_variable(Float64("time", causality=Fmi3Causality.independent, **continuous))
        self.register_variable(Float64("u", causality=given, **continuous))
        self.register_variable(Float64("x", causality=found, **continuous))
        self.register_variable(Float64("v", causality=found, **continuous))
        self.register_variable(Int64("steps", causality=found, **discrete))
        self.register_variable(Boolean("up", causality=found, **discrete))
        self.register_variable(String("word", causality=given, **discrete))
        self.register_variable(String("said", causality=found, **discrete))
        tunable = {"causality": Fmi3Causality.parameter, "variability": Fmi3Variability.tunable}
        self.register_variable(Float64("spring", **tunable))
        self.register_variable(Float64("gain", **tunable))

    def do_step(self, _current_time, step_size):
        self.v += step_size * (self.u * self.gain - self.x * self.spring)
        self.x += step_size * self.v
        self.steps += 1
        self.up = self.v > 0.0
        self.said = f"{self.word} at {self.steps}"
        return Fmi3StepResult()
