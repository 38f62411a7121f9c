"""What is checked between a loaded system and its run: times, coupling and scenario, all problems told together."""

from dataclasses import dataclass, field

from ..coupling.algorithm_problems import find_problems
from ..coupling.coupling import Coupling
from ..coupling.rollback import repeatable
from ..model.algorithm import Algorithm
from ..model.system import System, cannot_share_a_process
from ..model.time_grid import TimeGrid, time_grid
from ..reading.problems import Problems
from ..scenario.fault_entries import check_own_steps
from ..scenario.plan import Scenario
from ..scenario.scenario_file import read_scenario
from .options import Inputs


@dataclass(frozen=True)
class Request:
    """What somebody wants of a run; None where the system's description decides. Times in s."""

    start_time: float | None = None
    stop_time: float | None = None
    step_size: float | None = None
    algorithm: Algorithm = field(default_factory=Algorithm)
    inputs: Inputs = field(default_factory=Inputs)
    isolate: bool = False


@dataclass(frozen=True)
class Preparation:
    """What a run of a system will be."""

    grid: TimeGrid
    coupling: Coupling
    scenario: Scenario


def prepare(system: System, request: Request) -> Preparation:
    """Return what a run will be. Raises `TwipError` with one line per problem."""
    problems = Problems()
    if not request.isolate:
        problems.take(cannot_share_a_process(system))
    grid = None
    with problems.catch():
        grid = grid_of(system, request)
    coupling = _coupling(system, grid, request.algorithm.over(system.experiment.algorithm), problems)
    scenario = read_scenario(request.inputs.scenario, request.inputs.file, system, grid, problems)
    if coupling is not None and coupling.control is not None and scenario.faults:
        problems.add("faults of the scenario need equal steps, but with a tolerance they vary")
    if coupling is not None:
        check_own_steps(system, coupling, scenario, problems)
    problems.raise_any()
    if grid is None or coupling is None:
        raise RuntimeError("a run without times or coupling has problems")
    return Preparation(grid, coupling, scenario)


def grid_of(system: System, request: Request) -> TimeGrid:
    """Return the times of the run alone. Raises `TwipError`."""
    return time_grid(system, request.start_time, request.stop_time, request.step_size, request.algorithm.tolerance)


def _coupling(system: System, grid: TimeGrid | None, chosen: Algorithm, problems: Problems) -> Coupling | None:
    if grid is None:
        problems.take(line for line, _ in find_problems(chosen, system.components, system.copies, system.columns))
        return None
    coupling = None
    with problems.catch():
        coupling = Coupling.of(system, grid, chosen)
        repeatable(system, coupling)
    return coupling
