"""The whole system as one container FMU under fmpy's simulate_fmu; with a log it records all outputs."""

import sys

from fmpy import extract, read_model_description, simulate_fmu
from protocol import STEP_SIZE, arguments, serve, slope, timed

_, _, logs = arguments()
folder = extract(sys.argv[4])
description = read_model_description(folder)
outputs = [v.name for v in description.modelVariables if v.causality == "output"]


def whole(steps: int) -> float:
    """Run from the start."""
    options = {"stop_time": steps * STEP_SIZE, "step_size": STEP_SIZE, "output_interval": STEP_SIZE}
    recorded = {"output": outputs if logs else outputs[:1]}
    return timed(lambda: simulate_fmu(folder, model_description=description, **options, **recorded))


serve(slope(whole))
