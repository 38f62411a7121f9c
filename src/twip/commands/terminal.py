"""What the commands share: progress and notices on standard error, rows of results on standard output."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

INTERRUPTED = 130
"""Exit status after Ctrl-C: 128 + SIGINT."""


@contextmanager
def progress_bar(label: str, total: float, unit: str) -> Iterator[Callable[[float], None]]:
    """Show a progress bar on standard error while the block runs; silent where that is not a terminal."""
    console = Console(stderr=True)
    text = TextColumn("{task.completed:.1f}/{task.total:g} " + unit)
    columns = (TextColumn("{task.description}"), BarColumn(), text, TimeElapsedColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task(label, total=total)
        yield lambda done: bar.update(task, completed=done)


def notice(text: str) -> None:
    """Tell the user about something that takes a while."""
    print(f"twip: {text} …", file=sys.stderr, flush=True)


def print_rows(*rows: tuple[str, object]) -> None:
    """Print labels and what there is to say about them; rows with nothing are left out."""
    for label, content in rows:
        if content is not None:
            print(f"{label:<19} {content}")
