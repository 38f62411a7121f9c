"""A block that yields no number when told to, within the kernel subset."""

from typing import Any

from twip.fmi.declare import Block, Variable, input, output
from twip.robot.kernel import kernel


@kernel
def initialize(v: Any, time: float) -> None:
    """Begin with the dividend."""
    v.result = v.dividend
    if v.overflow > 0.5:
        v.result = 1e308 * 10.0 * v.dividend


@kernel
def step(v: Any, time: float, step_size: float) -> None:
    """Multiply; infinity minus infinity when told to."""
    v.result = v.dividend * v.factor
    if v.overflow > 0.5:
        v.result = 1e308 * 10.0 * v.dividend - 1e308 * 10.0 * v.dividend


def check(v: Any) -> list[str]:
    """The lower limit must stay below the upper one."""
    if v.lower >= v.upper:
        return [f"lower = {v.lower:g} must be below upper = {v.upper:g} by 100 %"]
    return []


BLOCK = Block(
    name="fragile",
    description="A product that can fail",
    variables=(
        input("dividend", None, "numerator", start=1.0),
        input("factor", None, "factor", start=2.0),
        output("result", None, "product", depends=("dividend", "factor")),
        Variable("overflow", "parameter", "tunable", type="Boolean", start=False, description="give no number"),
        Variable("lower", "parameter", "tunable", minimum=0.0, maximum=9.0, start=1.0, description="lower limit"),
        Variable("upper", "parameter", "fixed", minimum=0.0, maximum=9.0, start=2.0, description="upper limit"),
    ),
    check=check,
    initialize=initialize,
    step=step,
)  # fmt: skip
