"""What is out of the ordinary about a log, in words: it is cut off, it continues another run, an error ended it."""

from collections.abc import Iterator

from ..cosim import Playback
from ..errors import clear


def cut_off(log: Playback) -> str | None:
    """Return that the file of a log ends early and at what time its rows end; None of a complete one."""
    if log.complete:
        return None
    if not len(log.times):
        return "the log is cut off before its first row: its file ends early"
    return f"the log is cut off at {log.times[-1]:.6g} s: its file ends early, later rows are missing"


def remarks(log: Playback) -> Iterator[str]:
    """Yield what whoever judges a log should know first, a sentence each."""
    if text := cut_off(log):
        yield text
    if log.continued:
        yield f"continues a run from a checkpoint at {log.times[0]:.6g} s: what was before is in another log"
    ended = next((event for event in reversed(log.events) if event.level == "error" and not event.source), None)
    if ended is not None:
        yield f"an error ended the run at {ended.time:.6g} s: {clear(ended.text.partition(chr(10))[0])}"
