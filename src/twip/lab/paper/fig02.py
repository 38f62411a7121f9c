"""Fig 2 with tables 1 and 2: friction of the left drive mechanism."""

from .checks import Result
from .friction_figure import friction_figure
from .laboratory import Laboratory


def run(laboratory: Laboratory) -> Result:
    """Identify the left motor on the bench."""
    return friction_figure(laboratory, "left", 2, (1, 2))
