"""Faults of components with steps of their own: such a component takes its inputs in every m-th communication step."""

from ..coupling.coupling import Coupling
from ..model.system import System
from ..reading.problems import Problems
from .plan import Scenario


def check_own_steps(system: System, coupling: Coupling, scenario: Scenario, problems: Problems) -> None:
    """Add a problem for each fault that cannot do what it says because of the steps of the components it leads to."""
    multiples = dict(coupling.own_steps)
    owner = {
        column: component.name
        for component in system.components
        for column, _ in enumerate(component.inputs, system.first_column[component.name])
    }
    for fault in scenario.faults:
        for component in dict.fromkeys(owner[column] for column, _ in fault.targets if column in owner):
            multiple = multiples.get(component, 1)
            first = -(-(fault.first + 1) // multiple) * multiple - 1
            if fault.first < fault.last <= first:
                text = f"{fault.name} begins and ends between two steps of {component}, it would do nothing there"
                problems.add(text, fault.place)
            if fault.delay % multiple:
                text = f"{fault.name}.delay = {fault.text} must be a whole multiple of the step of {component}"
                problems.add(f"{text}, {multiple} communication steps", fault.place)
