"""What a connection does: the value of its source becomes that of its destination."""

import math

from ..model.schedule import Schedule
from ..model.vector import Vector


def copy_value(schedule: Schedule, copy: int, values: Vector) -> float | None:
    """Do a copy of the schedule; return a value that its table does not have or that is not finite, with nothing
    done.
    """
    value: float = float(schedule.factor[copy]) * values[schedule.source[copy]] + float(schedule.offset[copy])
    if not math.isfinite(value):
        return value
    if copy in schedule.mappings:
        mapped = schedule.mappings[copy](int(value))
        if mapped is None:
            return value
        value = float(mapped)
    values[schedule.destination[copy]] = value
    return None
