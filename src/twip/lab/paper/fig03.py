"""Fig 3 with tables 3 and 4: friction of the right drive mechanism."""

from .checks import Result
from .friction_figure import friction_figure
from .laboratory import Laboratory


def run(laboratory: Laboratory) -> Result:
    """Identify the right motor on the bench."""
    return friction_figure(laboratory, "right", 3, (3, 4))
