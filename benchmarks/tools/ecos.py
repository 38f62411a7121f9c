"""Runs an .ssp in Ecos and saves the outputs after every step, row 0 after initialization.

python ecos.py SYSTEM.ssp ROWS.npy '{"names": ["plant.pitch"], "steps": 1000, "step_size": 0.001}'
"""

import json
import sys

import numpy as np
from ecospy import EcosSimulation

file, target, plan = sys.argv[1], sys.argv[2], json.loads(sys.argv[3])
names = [name.replace(".", "::", 1) for name in plan["names"]]
simulation = EcosSimulation(ssp_path=file, step_size=plan["step_size"])
simulation.init(parameter_set="nominal")  # Ecos applies parameter sets by name
rows = [[simulation.get_real(name) for name in names]]
for _ in range(plan["steps"]):
    simulation.step(1)
    rows.append([simulation.get_real(name) for name in names])
simulation.terminate()
np.save(target, rows)
