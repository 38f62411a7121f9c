"""What a connection does: the value of its source becomes that of its destination."""

from .execution import Vector
from .schedule import Schedule


def copy_value(schedule: Schedule, copy: int, values: Vector) -> bool:
    """Do a copy of the schedule; False, with nothing done, when its table does not have the value."""
    value = schedule.factor[copy] * values[schedule.source[copy]] + schedule.offset[copy]
    if copy in schedule.mappings:
        mapped = schedule.mappings[copy](int(value))
        if mapped is None:
            return False
        value = float(mapped)
    values[schedule.destination[copy]] = value
    return True
