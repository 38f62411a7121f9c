"""Brings all instances to the start time with connected values that agree."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from ...errors import TwipError
from ..fmus.component import ComponentError
from ..fmus.protocols import AnyInstance, AnyPorts
from ..model.schedule import Schedule
from ..model.system import ParameterLink, System
from ..model.vector import Vector
from ..reading.problems import Place
from ..values.strings import text_of
from ..values.types import family
from ..values.written import StartValue, Value
from .copies import Copies
from .first_values import read_in_order
from .fixed_point import Acceleration

MAXIMUM_PASSES = 100
_TOLERANCE = 1e-12
"""Relative to a variable's magnitude or nominal value: a few dozen roundings of a double."""


def copy_stage(schedule: Schedule, stage: int, copies: Copies, refused: dict[int, float]) -> None:
    """Do the copies of one stage; those that are not done are added to `refused`, with their value."""
    for copy in range(schedule.stage_copies[stage], schedule.stage_copies[stage + 1]):
        value = copies.do(copy)
        if value is not None:
            refused[copy] = value


def pass_parameters(
    links: Sequence[ParameterLink], instances: Mapping[str, AnyInstance], values: Vector
) -> list[tuple[str, str]]:
    """Set the parameters that other components calculate; return the links whose value they cannot take, and why."""
    unfit = []
    for link in links:
        value = link.conversion(values[link.source])
        if value is None or not math.isfinite(value):
            why = "the value is no item of the enumeration" if value is None else f"gave {value:g}, which is not finite"
            unfit.append((link.label, why))
            continue
        typed: Value = value if family(link.variable.type) == "Real" else int(value)
        if link.variable.type in ("Boolean", "String"):
            typed = bool(value) if link.variable.type == "Boolean" else text_of(value)
        instances[link.component].set_value(StartValue(link.variable, typed, Place(link.label)))
    return unfit


def _refuse(schedule: Schedule, refused: Mapping[int, float], time: float) -> None:
    for copy, value in refused.items():
        raise schedule.refusal(copy, value, time)


def initialize(
    system: System,
    schedule: Schedule,
    instances: Sequence[AnyInstance],
    ports: Sequence[AnyPorts],
    values: Vector,
    driven: dict[int, float],
    times: tuple[float, float],
) -> list[str]:
    """Set start values, propagate outputs to inputs until nothing changes, leave initialization mode; the vector then
    holds row 0.

    `schedule` must be the Gauss–Seidel one: its order has what feeds a component before it. `driven` holds the
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
            shown = connector.mirrored.conversion.inverse(values[connector.mirrored.destination])
            values[connector.column] = shown if math.isfinite(shown) else 0.0
    for column, value in driven.items():
        values[column] = value
    read_in_order(system, schedule, ports, values)
    stages, copies = len(schedule.stage_order) - 1, Copies(schedule, values)
    nominal = [v.nominal for c in system.components for v in c.inputs + c.outputs]
    changing: list[int] = []
    refused: dict[int, float] = {}
    unfit: list[tuple[str, str]] = []
    by_name = {instance.name: instance for instance in instances}
    start, row = list(values), np.ctypeslib.as_array(values)
    outputs = np.flatnonzero([v.causality != "input" for c in system.components for v in c.inputs + c.outputs])
    # handing values around settles loops that contract; from the start again and accelerated, others settle too
    for acceleration in (None, Acceleration(schedule.nominal[outputs] > 0.0)):
        values[:] = start
        try:
            for number in range(MAXIMUM_PASSES):
                before = list(values)
                guess = row[outputs].copy()
                refused.clear()
                if number > 0:  # what they come from has been read
                    unfit = pass_parameters(system.parameter_links, by_name, values)
                for stage in range(stages):
                    copy_stage(schedule, stage, copies, refused)
                    for i in schedule.order[schedule.stage_order[stage] : schedule.stage_order[stage + 1]]:
                        ports[i].set_inputs()
                        ports[i].get_outputs()
                found = row[outputs]
                changing = [
                    i
                    for i, scale in enumerate(nominal)
                    if abs(values[i] - before[i]) > _TOLERANCE * max(abs(values[i]), scale)
                ]
                if not changing and (number > 0 or not system.parameter_links):
                    break
                if acceleration is not None:
                    scale = np.maximum(np.abs(found), schedule.nominal[outputs])
                    row[outputs] = acceleration.propose(guess, found, scale)
        except ComponentError as failure:
            if acceleration is not None or not schedule.loops or not failure.repeatable:
                raise
            continue
        if not changing and not refused:
            break
    _refuse(schedule, refused, times[0])
    for label, why in unfit:
        raise TwipError(f"{label} failed at t = {times[0]:.12g} s: {why}")
    for instance in instances:
        instance.finish_initialization()
    for port in ports:
        port.get_outputs()
    copy_stage(schedule, stages - 1, copies, refused)
    _refuse(schedule, refused, times[0])
    if not changing:
        return []
    names = system.columns
    return [f"initial values do not settle within {MAXIMUM_PASSES} passes: {', '.join(names[i] for i in changing)}"]
