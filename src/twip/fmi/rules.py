"""What a declaration must keep to become a valid FMU; checked before anything is built."""

import keyword
import re

from .declare import Block, Variable
from .table import exposed, unit_of
from .units import UNITS

NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*(\.[A-Za-z_][A-Za-z0-9_]*)*")
"""Structured variable names of FMI 2.0 without arrays and quoted parts."""

VARIABILITIES = {
    "parameter": ("fixed", "tunable"),
    "input": ("continuous", "discrete"),
    "output": ("continuous", "discrete"),
    "local": ("continuous", "discrete"),
}
"""What FMI 2.0 allows and the slave can do, by causality."""


def broken_declarations(block: Block) -> list[str]:
    """Return one sentence per rule that the declaration breaks: `block plant: pitch [grad]: …`."""
    problems = []
    if not NAME.fullmatch(block.name) or "." in block.name:
        problems.append(f"block {block.name}: the name must be an identifier")
    if not block.description:
        problems.append(f"block {block.name}: the description is missing")
    if not (block.step_size > 0.0 and block.stop_time > 0.0):
        problems.append(f"block {block.name}: step size and stop time of the default experiment must be positive")
    if not any(v.causality == "output" for v in block.variables):
        problems.append(f"block {block.name}: there is no output")
    for variable in exposed(block):
        where = f"block {block.name}: {variable.name}"
        if variable.unit:
            where += f" [{variable.unit}]"
        problems += [f"{where}: {rule}" for rule in _broken(variable)]
    return problems


def _broken(v: Variable) -> list[str]:
    rules = []
    if not NAME.fullmatch(v.name) or any(keyword.iskeyword(part) for part in (v.attribute, *v.name.split("."))):
        rules.append("the name must be made of identifiers, joined by dots")
    if v.causality not in VARIABILITIES:
        rules.append(f"unknown causality {v.causality!r}")
    elif v.variability not in VARIABILITIES[v.causality]:
        rules.append(f"a variable of causality {v.causality} must be {' or '.join(VARIABILITIES[v.causality])}")
    if v.type not in ("Real", "Integer", "Boolean"):
        rules.append(f"unknown type {v.type!r}")
    elif v.type != "Real" and v.variability == "continuous":
        rules.append(f"a variable of type {v.type} must be discrete")
    unit = unit_of(v)
    if unit is not None and unit not in UNITS:
        rules.append("the unit is not in the table of units (src/twip/fmi/units.py)")
    elif v.display_unit is not None and (unit is None or v.display_unit not in UNITS[unit].display):
        rules.append(f"{v.display_unit!r} is not a display unit of it (src/twip/fmi/units.py)")
    if v.type != "Real" and (unit or v.display_unit or v.nominal is not None):
        rules.append(f"a variable of type {v.type} has neither unit nor nominal value")
    if not v.description:
        rules.append("the description is missing")
    return rules + _broken_numbers(v)


def _broken_numbers(v: Variable) -> list[str]:
    rules = []
    if v.minimum is not None and v.maximum is not None and v.minimum >= v.maximum:
        rules.append("the minimum must be below the maximum")
    elif v.causality in ("input", "parameter"):
        if v.start is None:
            rules.append("the start value is missing")
        elif (v.minimum is not None and v.start < v.minimum) or (v.maximum is not None and v.start > v.maximum):
            rules.append(f"the start value {v.start} is out of bounds")
    elif v.start is not None:
        rules.append("the start value is calculated by the block and must not be declared")
    if v.nominal is not None and not v.nominal > 0.0:
        rules.append("the nominal value must be positive")
    if (v.depends or v.initially) and v.causality != "output":
        rules.append("only outputs declare dependencies")
    return rules
