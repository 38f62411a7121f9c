"""The height profile of the ground along the way."""

from math import floor, pi, sqrt

from .elementary import atan2, sin_cos
from .kernel import kernel


@kernel
def bump(distance: float, height: float, length: float, spacing: float, start: float) -> tuple[float, float, float]:
    """Return height [m], slope dz/ds [1] and its derivative [1/m] of raised-cosine bumps, all [m].

    z(s) = height/2 (1 - cos(2 pi s/length))  for 0 <= s <= length, s counted from the beginning of the bump, else 0

    One bump begins every `spacing` from `start` on. `distance` is the way of the axle along the ground, positive
    forward; heights are positive upward. The slope is continuous, its derivative jumps where a bump begins and ends.
    """
    along = distance - start
    if along < 0.0 or height == 0.0:
        return 0.0, 0.0, 0.0
    along -= spacing * floor(along / spacing)
    if along >= length:
        return 0.0, 0.0, 0.0
    wave_number = 2.0 * pi / length
    sine, cosine = sin_cos(wave_number * along)
    half = 0.5 * height
    return half * (1.0 - cosine), half * wave_number * sine, half * wave_number * wave_number * cosine


@kernel
def bump_slope(distance: float, height: float, length: float, spacing: float, start: float) -> tuple[float, float]:
    """Return the slope angle [rad] of the bumps, uphill positive, and its derivative along the way [rad/m].

    sin(alpha) = dz/ds    dalpha/ds = (d2z/ds2) / cos(alpha)

    The profile belongs to the path of the axle: a wheel that rolls without slip carries its axle R theta along it,
    whatever the curvature.
    """
    _, sine, derivative = bump(distance, height, length, spacing, start)
    cosine = sqrt(1.0 - sine * sine)
    return atan2(sine, cosine), derivative / cosine
