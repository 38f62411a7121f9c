"""CoFmuPy's default master (Jacobi); its log is CSV."""

import contextlib
import io
import json
import os
import sys

from cofmupy import Coordinator
from fmpy.ssp.ssd import read_ssd
from protocol import STEP_SIZE, arguments, serve, timed

ssp, unpacked, logs = arguments()
top = read_ssd(str(ssp)).system
configuration = {
    "fmus": [{"id": c.name, "path": str(unpacked / c.source), "name": c.name} for c in top.elements],
    "connections": [
        {
            "source": {"id": c.startElement, "variable": c.startConnector},
            "target": {"id": c.endElement, "variable": c.endConnector},
        }
        for c in top.connections
    ],
    "cosim_method": "jacobi",
}
folder = logs or unpacked
path = folder / "cofmupy.json"
path.write_text(json.dumps(configuration))
os.chdir(folder)
coordinator = Coordinator()
with contextlib.redirect_stdout(io.StringIO()):
    coordinator.start(str(path))


def run(steps: int) -> float:
    """Go on by so many steps."""
    end = coordinator.master.current_time + (steps - 0.5) * STEP_SIZE

    def work() -> None:
        with contextlib.redirect_stdout(sys.stderr):
            coordinator.run_simulation(STEP_SIZE, end, save_data=logs is not None)

    return timed(work)


serve(run)
