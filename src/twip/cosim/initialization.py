"""Brings all instances to the start time with connected values that agree."""

from .component import Instance
from .ports import Ports, Vector
from .schedule import Schedule
from .system import System

MAXIMUM_PASSES = 100
_TOLERANCE = 1e-12
"""Relative to a variable's magnitude or nominal value: a few dozen roundings of a double."""


def copy_stage(schedule: Schedule, stage: int, values: Vector) -> None:
    """Do the copies of one stage."""
    for i in range(schedule.stage_copies[stage], schedule.stage_copies[stage + 1]):
        values[schedule.destination[i]] = schedule.factor[i] * values[schedule.source[i]] + schedule.offset[i]


def initialize(
    system: System,
    schedule: Schedule,
    instances: list[Instance],
    ports: list[Ports],
    values: Vector,
    driven: dict[int, float],
    times: tuple[float, float],
) -> list[str]:
    """Set start values, propagate outputs to inputs until nothing changes, leave initialization mode; the vector then
    holds row 0.

    `schedule` must be the Gauss–Seidel one: without an algebraic loop one pass settles everything. `driven` holds the
    values at the start time of the columns that the caller's inputs write. Returns warnings: the signals of a loop that
    does not settle.
    """
    for instance in instances:
        instance.setup(*times)
    for port in ports:
        port.read_inputs()
    for connector in system.open_connectors:
        if connector.start is not None:
            values[connector.column] = connector.start
        elif connector.mirrored is not None:
            values[connector.column] = connector.mirrored.conversion.inverse(values[connector.mirrored.destination])
    for column, value in driven.items():
        values[column] = value
    stages = len(schedule.stage_order) - 1
    nominal = [v.nominal for c in system.components for v in c.inputs + c.outputs]
    changing: list[int] = []
    for _ in range(MAXIMUM_PASSES):
        before = list(values)
        for stage in range(stages):
            copy_stage(schedule, stage, values)
            for i in schedule.order[schedule.stage_order[stage] : schedule.stage_order[stage + 1]]:
                ports[i].set_inputs()
                ports[i].get_outputs()
        changing = [
            i for i, scale in enumerate(nominal) if abs(values[i] - before[i]) > _TOLERANCE * max(abs(values[i]), scale)
        ]
        if not changing:
            break
    for instance in instances:
        instance.finish_initialization()
    for port in ports:
        port.get_outputs()
    copy_stage(schedule, stages - 1, values)
    if not changing:
        return []
    names = system.columns
    return [f"initial values do not settle within {MAXIMUM_PASSES} passes: {', '.join(names[i] for i in changing)}"]
