"""A block that puts out every elementary function of its inputs."""

from twip.fmi.declare import Block, input, output
from twip.robot.elementary import atan2, cos, exp, log, sin, sin_cos, tan
from twip.robot.kernel import kernel


@kernel
def initialize(v, time):
    """Compute all."""
    step(v, time, 0.0)


@kernel
def step(v, time, step_size):
    """Compute all."""
    v.sine = sin(v.a)
    v.cosine = cos(v.a)
    v.tangent = tan(v.a)
    v.arctangent = atan2(v.a, v.b)
    v.exponential = exp(v.a)
    v.logarithm = log(v.a)
    v.both_sine, v.both_cosine = sin_cos(v.a)


NAMES = ("sine", "cosine", "tangent", "arctangent", "exponential", "logarithm", "both_sine", "both_cosine")
BLOCK = Block(
    name="elementary",
    description="Every elementary function",
    variables=(
        input("a", None, "first argument"),
        input("b", None, "second argument"),
        *(output(name, None, name) for name in NAMES),
    ),
    initialize=initialize,
    step=step,
)
