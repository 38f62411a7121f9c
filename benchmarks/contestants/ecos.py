"""Ecos through ecospy; its log is CSV."""

from ecospy import EcosSimulation
from protocol import STEP_SIZE, arguments, serve, timed

ssp, _, logs = arguments()
simulation = EcosSimulation(ssp_path=str(ssp), step_size=STEP_SIZE)
if logs:
    simulation.add_csv_writer(str(logs / "ecos.csv"))
simulation.init(parameter_set="nominal")
serve(lambda steps: timed(lambda: simulation.step(steps)))
