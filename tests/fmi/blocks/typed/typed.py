"""A block with parameters of every type, and with an output of each."""

from twip.fmi.declare import Block, Variable, output
from twip.robot.kernel import kernel


@kernel
def initialize(v, time):
    """Compute what the parameters say."""
    step(v, time, 0.0)


@kernel
def step(v, time, step_size):
    """Multiply, add one, and negate."""
    v.product = v.count * v.factor
    v.next_count = v.count + 1.0
    v.opposite = 1.0 - v.flag


BLOCK = Block(
    name="typed",
    description="Parameters and outputs of every type",
    variables=(
        Variable("count", "parameter", "fixed", "Integer", minimum=-5, maximum=1000, start=3, description="an integer"),
        Variable("flag", "parameter", "tunable", "Boolean", start=True, description="a truth"),
        Variable("factor", "parameter", "fixed", unit="rad", display_unit="deg", start=0.5, description="an angle"),
        output("product", "rad", "integer times angle", display_unit="deg", nominal=1.0),
        Variable("next_count", "output", "discrete", "Integer", description="the next integer"),
        Variable("opposite", "output", "discrete", "Boolean", description="the opposite truth"),
    ),
    initialize=initialize,
    step=step,
)  # fmt: skip
