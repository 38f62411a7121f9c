"""Runs an .ssp by fmpy's `simulate_ssp` and saves what it stamps with the start times of the steps.

python fmpy_ssp.py SYSTEM.ssp ROWS.npy '{"names": ["plant.pitch"], "steps": 1000, "step_size": 0.001}'
"""

import json
import os
import sys

import numpy as np
from fmpy.ssp.simulation import simulate_ssp

file, target, plan = sys.argv[1], sys.argv[2], json.loads(sys.argv[3])
rows = simulate_ssp(file, stop_time=plan["steps"] * plan["step_size"], step_size=plan["step_size"])
np.save(target, np.array([rows[name] for name in plan["names"]]).T)
os._exit(0)  # nothing is freed there
