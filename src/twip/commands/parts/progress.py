"""The progress bar of long commands."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol

from rich.console import Console
from rich.progress import BarColumn, Progress, ProgressColumn, Task, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.text import Text


class Update(Protocol):
    """Tells a progress bar how far it is."""

    def __call__(self, done: float, total: float | None = None) -> None:
        """Show that so much is done, and with `total` of how much."""


class RateColumn(ProgressColumn):
    """How much is done per second; of simulated seconds, how many times faster than real time."""

    def __init__(self, unit: str) -> None:
        super().__init__()
        self._unit = unit

    def render(self, task: Task) -> Text:
        """Return the rate, nothing before it is known."""
        rate = task.finished_speed or task.speed
        if rate is None:
            return Text("")
        return Text(
            f"{rate:.1f}× real time" if self._unit == "s" else f"{rate:.1f} {self._unit}/s", "progress.data.speed"
        )


@contextmanager
def progress_bar(label: str, total: float | None, unit: str, digits: int = 1) -> Iterator[Update]:
    """Show a progress bar on standard error while the block runs; silent where that is not a terminal.

    Without `total` it appears when the first update tells one; what is done is shown with so many `digits`.
    """
    console = Console(stderr=True)
    text = TextColumn(f"{{task.completed:.{digits}f}}/{{task.total:g}} {unit}")
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        text,
        RateColumn(unit),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task(label, total=total or 0.0, visible=total is not None)

        def update(done: float, total: float | None = None) -> None:
            if total is None:
                bar.update(task, completed=done)
            else:
                bar.update(task, completed=done, total=total, visible=True)

        yield update
