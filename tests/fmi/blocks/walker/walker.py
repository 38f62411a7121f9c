"""A random walk that is pulled by an input: everything it remembers is a variable, its generator too."""

from math import floor

from twip.fmi.declare import Block, Variable, input, local, output, start_value, state
from twip.robot.kernel import kernel


@kernel
def initialize(v, time):
    """Begin at the start position, with the generator at its seed."""
    v.position = v.position_start
    v.pulled = v.position_start + v.pull
    v.seed = v.first_seed
    v.steps = 0.0
    v.begun = time


@kernel
def step(v, time, step_size):
    """Walk by a random length of at most the step's duration, and by the pull."""
    product = 16807.0 * v.seed
    v.seed = product - 2147483647.0 * floor(product / 2147483647.0)
    v.steps = v.steps + 1.0
    v.position = v.position + step_size * (v.seed / 2147483647.0 - 0.5) + step_size * v.gain * v.pull
    v.pulled = v.position + v.pull


BLOCK = Block(
    name="walker",
    description="A random walk with a pull",
    variables=(
        input("pull", "m", "distance that pulls", start=0.25),
        output("position", "m", "where the walk is"),
        output("pulled", "m", "where the walk would be if it followed the pull at once", depends=("pull",)),
        start_value("position_start", "m", "where the walk begins"),
        Variable("first_seed", "parameter", "fixed", minimum=1.0, maximum=2147483646.0, start=1.0, description="seed"),
        Variable("gain", "parameter", "tunable", unit="1/s", minimum=0.0, maximum=10.0, start=1.0,
                 description="strength of the pull"),
        Variable("sample_time", "parameter", "fixed", unit="s", minimum=1e-6, start=0.01,
                 description="not used, only warned of"),
        local("steps", None, "steps so far"),
        local("begun", "s", "start time"),
        state("seed"),
    ),
    initialize=initialize,
    step=step,
    step_size=0.01,
    stop_time=1.0,
)  # fmt: skip
