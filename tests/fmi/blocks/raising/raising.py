"""A block that fails on demand, in each of the ways a block can fail."""

from twip.fmi.declare import Block, Variable, input, output
from twip.robot.kernel import kernel


@kernel
def initialize(v, time):
    """Divide by the divisor."""
    v.result = v.dividend / v.divisor
    v.half_done = time * 0.0


@kernel
def step(v, time, step_size):
    """Divide by the divisor; infinity minus infinity when told to."""
    v.half_done = v.half_done + 1.0
    remainder = time % step_size  # the message of a failure shows this line: % must not upset a C logger
    v.result = v.dividend / v.divisor + remainder * 0.0
    if v.overflow > 0.5:
        v.result = 1e308 * 10.0 - 1e308 * 10.0


def check(v):
    """The lower limit must stay below the upper one."""
    if v.lower >= v.upper:
        return [f"lower = {v.lower:g} must be below upper = {v.upper:g}"]
    return []


BLOCK = Block(
    name="raising",
    description="A division that can fail",
    variables=(
        input("dividend", None, "numerator", start=1.0),
        input("divisor", None, "denominator", start=2.0),
        output("result", None, "quotient", depends=("dividend", "divisor")),
        output("half_done", None, "steps begun"),
        Variable("overflow", "parameter", "tunable", type="Boolean", start=False, description="give no number"),
        Variable("lower", "parameter", "tunable", minimum=0.0, maximum=9.0, start=1.0, description="lower limit"),
        Variable("upper", "parameter", "fixed", minimum=0.0, maximum=9.0, start=2.0, description="upper limit"),
    ),
    check=check,
    initialize=initialize,
    step=step,
)  # fmt: skip
