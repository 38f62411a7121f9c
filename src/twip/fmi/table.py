"""How the values of a block are stored and found by FMI's value references."""

from collections.abc import Callable
from functools import cache
from operator import attrgetter
from typing import Any

from ..robot.kernel import entry_point
from .declare import Block, Variable

NATIVE_REFERENCE = 2**31 - 1
"""Value reference of a String that is no variable: it says where the values and the native step of an instance are (see
`model_description`).
"""


def exposed(block: Block) -> tuple[Variable, ...]:
    """Return the variables of the model description; the value reference of a variable is its index here."""
    return tuple(v for v in block.variables if v.causality != "state")


def unit_of(variable: Variable) -> str | None:
    """Return the unit of a variable, None for a pure number."""
    return None if variable.unit == "1" else variable.unit


def shown(variable: Variable, value: float) -> str:
    """Return `value` with the variable's unit, as messages show it."""
    unit = unit_of(variable)
    return f"{value:.10g} {unit}" if unit else f"{value:.10g}"


def out_of_bounds(variable: Variable, value: float) -> str:
    """Return what is wrong with `value` by the variable's bounds, or nothing."""
    if variable.minimum is not None and value < variable.minimum:
        return f"{variable.name} = {shown(variable, value)} must be at least {shown(variable, variable.minimum)}"
    if variable.maximum is not None and value > variable.maximum:
        return f"{variable.name} = {shown(variable, value)} must be at most {shown(variable, variable.maximum)}"
    return ""


class Table:
    """The attributes of a block's values, and its variables by value reference and type.

    `attributes` has the exposed variables first, in the order of their value references, outputs side by side, then the
    states. `names[type]` maps value references to attributes for `Real`, `Integer` and `Boolean`; `inputs` holds the
    value references of the Real inputs.
    """

    def __init__(self, block: Block) -> None:
        self.block = block
        self.variables = dict(enumerate(exposed(block)))
        states = (v for v in block.variables if v.causality == "state")
        self.attributes = tuple(v.attribute for v in (*self.variables.values(), *states))
        self.slots: Callable[[], Any] = type("Values", (), {"__slots__": self.attributes})
        self.names = {
            kind: {r: v.attribute for r, v in self.variables.items() if v.type == kind}
            for kind in ("Real", "Integer", "Boolean")
        }
        self.inputs = frozenset(r for r, v in self.variables.items() if v.causality == "input" and v.type == "Real")
        self.parameters = tuple(v for v in block.variables if v.causality == "parameter")
        self.calculated = tuple(v.attribute for v in block.variables if v.causality not in ("parameter", "input"))
        self.outputs = tuple(v for v in block.variables if v.causality == "output")
        self.all_values = getter(self.attributes)
        self.why_plain = ""
        """Why the block is not compiled although it should be."""

    @cache  # noqa: B019 (a block has one table, which lives as long as the process)
    def compiled_step(self) -> int:
        """Return the address of the block's step compiled, on values in the order of `attributes`."""
        outputs = self.attributes.index(self.outputs[0].attribute), len(self.outputs)
        return entry_point(self.block.step, self.attributes, outputs)

    def start_values(self, values: Any) -> Any:
        """Set parameters and inputs to their start, all others to zero, and return `values`."""
        for variable in self.block.variables:
            setattr(values, variable.attribute, float(variable.start or 0.0))
        return values

    def clear(self, values: Any) -> None:
        """Set what initialization calculates to zero, so that its result depends on parameters and inputs alone."""
        for attribute in self.calculated:
            setattr(values, attribute, 0.0)

    def broken_rules(self, values: Any) -> list[str]:
        """Return one sentence per rule that the parameters break: their bounds, then the rules between them."""
        told = (out_of_bounds(p, getattr(values, p.attribute)) for p in self.parameters)
        return [problem for problem in told if problem] or list(self.block.check(values))


def getter(attributes: tuple[str, ...]) -> Callable[[Any], tuple[float, ...]]:
    """Return a function that reads the attributes of an object as a tuple."""
    if len(attributes) > 1:
        return attrgetter(*attributes)
    return lambda values: tuple(getattr(values, a) for a in attributes)
