"""Runs of the whole robot: in the master, and as plans for other hosts.

As a script, `python native_robot.py SYSTEM SCENARIO OUTPUTS ROWS`, it writes the bytes of a run without numba.
"""

import json
import sys
from pathlib import Path

import numpy as np
from native_hosts import write_plan

from twip.cosim import Inputs, Runtime, Table, load, simulate

PUSH = Path(__file__).parents[3] / "ssp" / "inputs" / "push.csv"
PUSHED = "plant.push_force"
SCENARIOS = {
    "noise and friction": ({"plant.pitch_start": 0.3, "imu.seed": 7.0}, None),
    "a fall": ({"plant.pitch_start": 1.4, "imu.seed": 7.0}, None),
    "a push": ({"plant.pitch_start": 0.0}, PUSH),
}
"""Parameters and a file of inputs by what happens."""
DURATION, STEP = 10.0, 1e-3
"""In s."""


def simulated(ssp, scenario, loop, duration=DURATION):
    """Run a system in the master and return its table."""
    values, inputs = SCENARIOS[scenario]
    with load(ssp, start_values=values) as system:
        table = Table(system.channels)
        simulate(
            system,
            stop_time=duration,
            step_size=STEP,
            inputs=Inputs(file=inputs),
            runtime=Runtime(loop=loop),
            sinks=[table],
        )
    return table


def bits(table, outputs):
    """Return the bytes of a table's columns, row for row."""
    return np.ascontiguousarray(np.array([table[name] for name in outputs]).T).tobytes()


def robot_plan(path, unpacked, scenario, table, outputs):
    """Write the plan of a run: a row of the table holds the inputs of the step that ends there."""
    return write_plan(path, unpacked, STEP, {PUSHED: table[PUSHED][1:]}, SCENARIOS[scenario][0], outputs)


if __name__ == "__main__":
    sys.modules["numba"] = None
    ssp, scenario, names, rows = sys.argv[1:]
    Path(rows).write_bytes(bits(simulated(ssp, scenario, "python"), json.loads(names)))
    assert not any(name.startswith("numba.") for name in sys.modules)
