"""The incremental encoder on the motor shaft."""

from math import floor, pi

from .kernel import kernel


@kernel
def encoder_count(angle: float, resolution: float) -> float:
    """Return the whole counts [1] at an angle [rad] with `resolution` counts per revolution, rounded down."""
    return float(floor(angle * resolution / (2.0 * pi)))
