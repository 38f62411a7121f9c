"""fmpy's simulate_ssp, which always records; see docs/performance.md for what it does to the results."""

from fmpy.ssp.simulation import simulate_ssp
from protocol import STEP_SIZE, arguments, serve, slope, timed

ssp, _, _ = arguments()
serve(slope(lambda steps: timed(lambda: simulate_ssp(str(ssp), stop_time=steps * STEP_SIZE, step_size=STEP_SIZE))))
