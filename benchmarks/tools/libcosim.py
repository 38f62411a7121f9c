"""Runs an .ssp in libcosim and saves the outputs after every step; libcosim shows none at the start time.

python libcosim.py SYSTEM.ssp ROWS.npy '{"names": ["plant.pitch"], "references": [16], "steps": 1000, …}'
"""

import json
import pathlib
import shutil
import sys

import numpy as np
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimObserver import CosimObserver

file, target, plan = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), json.loads(sys.argv[3])
folder = target.with_suffix(".unpacked")
shutil.unpack_archive(file, folder, "zip")
execution = CosimExecution.from_ssp_file(ssp_path=str(folder), step_size=round(plan["step_size"] * 1e9))
observer = CosimObserver.create_last_value()
execution.add_observer(observer)
index = {s.name.decode(): s.index for s in execution.slave_infos()}
columns: dict[str, list[int]] = {}
for name, reference in zip(plan["names"], plan["references"], strict=True):
    columns.setdefault(name.split(".")[0], []).append(reference)
rows = []
for _ in range(plan["steps"]):
    if not execution.step(step_count=1):
        sys.exit("libcosim refuses a step")
    values = (observer.last_real_values(slave_index=index[c], variable_references=r) for c, r in columns.items())
    rows.append([x for part in values for x in part])
np.save(target, rows)
