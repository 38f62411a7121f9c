"""Counts its steps in `y` and misbehaves as told from the step that begins at `fault_time` on."""

import time

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real, String
from pythonfmu.enums import Fmi2Status

KEEP = [globals()] * 100_000


class CosimFaulty(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.fault = "none"
        self.fault_time = 0.0
        self.u = 0.0
        self.y = 0.0
        fixed = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.fixed}
        self.register_variable(String("fault", **fixed))
        self.register_variable(Real("fault_time", **fixed))
        self.register_variable(Real("u", causality=Fmi2Causality.input))
        self.register_variable(Real("y", causality=Fmi2Causality.output))

    def exit_initialization_mode(self):
        if self.fault == "initialization":
            raise ValueError("no start")

    def do_step(self, current_time, _step_size):
        self.y += 1.0
        if current_time < self.fault_time - 1e-9:
            return True
        if self.fault == "raise":
            raise ValueError("the belt broke")
        if self.fault == "discard":
            self.log("the belt slipped\nby 3 mm", Fmi2Status.error)
            return False
        if self.fault == "nan":
            self.y = float("nan")
        if self.fault == "chatter":
            self.log("all is well")
            self.log("a bit warm: 90 % of the limit", Fmi2Status.warning)
        if self.fault == "slow":
            time.sleep(0.01)
        return True
