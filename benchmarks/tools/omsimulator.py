"""Runs an .ssp in OMSimulator and saves the outputs after every step, row 0 after initialization.

    python omsimulator.py SYSTEM.ssp ROWS.npy '{"names": ["plant.pitch"], "steps": 1000, "step_size": 0.001}'

Written after OMSimulator's documentation; not tried, for want of a package that installs here.
"""

import json
import sys

import numpy as np
from OMSimulator import OMSimulator

file, target, plan = sys.argv[1], sys.argv[2], json.loads(sys.argv[3])
oms = OMSimulator()
model, status = oms.importFile(file)
if status:
    sys.exit("OMSimulator cannot import the file")
oms.setFixedStepSize(f"{model}.root", plan["step_size"])
oms.setStopTime(model, plan["steps"] * plan["step_size"])
oms.instantiate(model)
oms.initialize(model)
rows = []
for k in range(plan["steps"] + 1):
    if k:
        oms.stepUntil(model, k * plan["step_size"])
    rows.append([oms.getReal(f"{model}.root.{name}")[0] for name in plan["names"]])
oms.terminate(model)
oms.delete(model)
np.save(target, rows)
