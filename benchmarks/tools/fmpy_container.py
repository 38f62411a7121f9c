"""Runs a container FMU by `fmpy simulate` and saves the outputs after every step, row 0 after initialization.

python fmpy_container.py CONTAINER.fmu ROWS.npy '{"names": ["plant.pitch"], "steps": 1000, "step_size": 0.001}'
"""

import csv
import json
import pathlib
import subprocess
import sys

import numpy as np

file, target, plan = sys.argv[1], pathlib.Path(sys.argv[2]), json.loads(sys.argv[3])
output = target.with_suffix(".csv")
command = [sys.executable, "-m", "fmpy", "simulate", file, "--output-file", output, "--step-size", plan["step_size"],
           "--output-interval", plan["step_size"], "--stop-time", plan["steps"] * plan["step_size"]]  # fmt: skip
subprocess.run(list(map(str, command)), check=True)
with output.open(encoding="utf-8", newline="") as table:
    header, *rows = csv.reader(table)
columns = [header.index(name) for name in plan["names"]]
np.save(target, [[float(row[c]) for c in columns] for row in rows])
