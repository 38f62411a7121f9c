"""`x(t) = x_start exp(-rate t)`, and what can go wrong with one run of many."""

import os
import signal
import time
from math import exp

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Integer, Real, String

KEEP = [globals()] * 100_000  # pythonfmu drops one reference to a slave module's globals with each instance


class SweepDecay(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.rate = 1.0
        self.x_start = 1.0
        self.seed = 0
        self.fault = "none"
        self.begun = 0
        self.x = 0.0
        self.drawn = 0.0
        fixed = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.fixed}
        self.register_variable(Real("rate", **fixed))
        self.register_variable(Real("x_start", **fixed))
        self.register_variable(Integer("seed", **fixed))
        self.register_variable(String("fault", **fixed))
        self.register_variable(Real("x", causality=Fmi2Causality.output))
        self.register_variable(Real("drawn", causality=Fmi2Causality.output))

    def exit_initialization_mode(self):
        self.x = self.x_start
        self.drawn = self.seed / 2.0**31
        self.begun += 1
        if self.fault == "remember":
            self.x *= self.begun

    def do_step(self, _current_time, step_size):
        if self.fault == "raise":
            raise ValueError("the spring broke")
        if self.fault == "die at 2" and self.x_start == 2.0:
            os.kill(os.getpid(), signal.SIGKILL)
        if self.fault == "slow":
            time.sleep(0.02)
        self.x *= exp(-self.rate * step_size)
        return True
