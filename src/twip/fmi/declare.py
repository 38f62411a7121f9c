"""The declaration of a block: its variables, once, and its step."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

from ..robot.parameters import PARAMETERS


@dataclass(frozen=True)
class Variable:
    """One variable of a block as FMI 2.0 knows it (FMI 2.0.4, section 2.2.7).

    `name` may be structured by dots; the step reads and writes it as an attribute with the dots as underscores
    (`left.voltage` is `v.left_voltage`). `depends` names the inputs an output depends on directly, at the same instant;
    `initially` names further inputs that count only when the block is initialized.
    A variable of causality `state` is remembered (saved, restored, serialised) but not shown to the outside.
    """

    name: str
    causality: str
    variability: str
    type: str = "Real"
    unit: str | None = None
    display_unit: str | None = None
    minimum: float | None = None
    maximum: float | None = None
    nominal: float | None = None
    start: float | int | bool | None = None
    description: str = ""
    depends: tuple[str, ...] = ()
    initially: tuple[str, ...] = ()
    relative: bool = False
    """Whether it is a difference: the offset of its unit does not count."""

    @property
    def attribute(self) -> str:
        """Name of the attribute that holds the value in the block's step."""
        return self.name.replace(".", "_")


def parameter(name: str, source: str | None = None) -> Variable:
    """Return a parameter with value, unit, bounds and meaning of the robot parameter `source` (default: `name`)."""
    p = PARAMETERS[source or name]
    return Variable(
        name,
        "parameter",
        "tunable" if p.tunable else "fixed",
        p.type,
        None if p.unit == "1" else p.unit,
        p.display_unit,
        p.minimum,
        p.maximum,
        start=p.value,
        description=f"{p.description} ({p.source})",
    )


def start_value(
    name: str,
    unit: str,
    description: str,
    start: float = 0.0,
    display_unit: str | None = None,
    minimum: float | None = None,
    maximum: float | None = None,
) -> Variable:
    """Return a fixed parameter that holds an initial state, named after its output: `pitch_start`."""
    return Variable(name, "parameter", "fixed", "Real", unit, display_unit, minimum, maximum, None, start, description)


def input(  # noqa: A001 (FMI's word)
    name: str,
    unit: str | None,
    description: str,
    start: float = 0.0,
    display_unit: str | None = None,
    minimum: float | None = None,
    maximum: float | None = None,
    nominal: float | None = None,
    variability: str = "continuous",
) -> Variable:
    """Return a Real input with its start value."""
    return Variable(
        name, "input", variability, "Real", unit, display_unit, minimum, maximum, nominal, start, description
    )


def output(
    name: str,
    unit: str | None,
    description: str,
    depends: tuple[str, ...] = (),
    display_unit: str | None = None,
    minimum: float | None = None,
    maximum: float | None = None,
    nominal: float | None = None,
    variability: str = "continuous",
    initially: tuple[str, ...] = (),
) -> Variable:
    """Return a Real output; its value at the start is calculated by the block's `initialize`."""
    return Variable(
        name,
        "output",
        variability,
        "Real",
        unit,
        display_unit,
        minimum,
        maximum,
        nominal,
        description=description,
        depends=depends,
        initially=initially,
    )


def local(
    name: str, unit: str | None, description: str, display_unit: str | None = None, variability: str = "continuous"
) -> Variable:
    """Return a Real internal variable that can be read, not connected."""
    return Variable(name, "local", variability, "Real", unit, display_unit, None, None, None, None, description)


def state(name: str) -> Variable:
    """Return a hidden Real memory of the block: saved, restored and serialised, not part of the model description."""
    return Variable(name, "state", "continuous")


def sided(side: str, variables: tuple[Variable, ...]) -> tuple[Variable, ...]:
    """Return the variables with the prefix `left.` or `right.`, their dependencies too."""
    return tuple(
        replace(
            v,
            name=f"{side}.{v.name}",
            depends=tuple(f"{side}.{d}" for d in v.depends),
            initially=tuple(f"{side}.{d}" for d in v.initially),
        )
        for v in variables
    )


@dataclass(frozen=True)
class Block:
    """A block that becomes an FMU.

    `initialize(v, time)` sets outputs, locals and states from parameters and inputs; it is a function of those alone
    and may be called again. `step(v, time, step_size)` advances from `time` to `time + step_size` (s) in place. Both
    get one argument `v` with every variable as a float attribute. `check(v)` returns the rules that the parameters
    break together, one sentence each.
    """

    name: str
    description: str
    variables: tuple[Variable, ...]
    initialize: Callable[[Any, float], None]
    step: Callable[[Any, float, float], None]
    check: Callable[[Any], list[str]] = field(default=lambda _: [])
    step_size: float = 1e-3
    stop_time: float = 10.0

    def __post_init__(self) -> None:
        attributes = [v.attribute for v in self.variables]
        twice = sorted({a for a in attributes if attributes.count(a) > 1})
        if twice:
            raise ValueError(f"block {self.name}: two variables share the attribute {', '.join(twice)}")
        inputs = {v.name for v in self.variables if v.causality == "input"}
        for v in self.variables:
            unknown = [d for d in (*v.depends, *v.initially) if d not in inputs]
            if unknown:
                raise ValueError(f"block {self.name}: {v.name} depends on {', '.join(unknown)}, which is not an input")
