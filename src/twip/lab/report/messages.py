"""The messages of components and of the master in a report: equal ones once, the gravest kept where they are many."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape

from ...cosim import Playback, counted
from ...cosim.log import LEVELS

MOST_MESSAGES = 100
"""Different messages of a log that are shown."""
MOST_CHARACTERS = 2000
"""Of one message."""


@dataclass
class Said:
    """A message, when it was said first and last in s, and how often."""

    level: str
    source: str
    text: str
    first: float
    last: float
    count: int = 0


def grouped(log: Playback) -> list[Said]:
    """Return the different messages of a log in the order in which they were said first."""
    found: dict[tuple[str, str, str], Said] = {}
    for event in log.events:
        key = (event.level, event.source, event.text)
        said = found.setdefault(key, Said(*key, event.time, event.time))
        said.last = event.time
        said.count += 1
    return list(found.values())


def messages_table(labels: Sequence[str], logs: Sequence[Playback]) -> str:
    """Return the messages of all logs as HTML with all text escaped, nothing where there are none."""
    lines = []
    for label, log in zip(labels, logs, strict=True):
        name = [label] if len(logs) > 1 else []
        said = grouped(log)
        gravest = sorted(range(len(said)), key=lambda i: (-LEVELS.index(said[i].level), i))
        for i in sorted(gravest[:MOST_MESSAGES]):
            one = said[i]
            lines.append(_line([*name, _when(one), one.level, one.source, _shortened(one.text)], one.level))
        if left := [said[i] for i in gravest[MOST_MESSAGES:]]:
            counts = level_counts((one.level, one.count) for one in left)
            lines.append(_line([*name, "", "", "", f"… and {counts} more, in the log"], ""))
    if not lines:
        return ""
    names = [*(["log"] if len(logs) > 1 else []), "time", "level", "source", "message"]
    head = f"<thead><tr>{''.join(f'<th scope=col>{name}</th>' for name in names)}</tr></thead>"
    return f'<h2>Messages</h2><table class="messages">{head}<tbody>{"".join(lines)}</tbody></table>'


def level_counts(said: Iterable[tuple[str, int]]) -> str:
    """Return how many messages there are of each level in words, of levels and numbers of messages."""
    counts: dict[str, int] = {}
    for level, count in said:
        counts[level] = counts.get(level, 0) + count
    return ", ".join(
        counted(count, level) if level in ("warning", "error") else f"{count} {level}"
        for level, count in counts.items()
    )


def _line(cells: Sequence[str], level: str) -> str:
    return f'<tr class="{level}">{"".join(f"<td>{escape(cell)}</td>" for cell in cells)}</tr>'


def _when(said: Said) -> str:
    if said.count == 1:
        return f"{said.first:.6g} s"
    span = f"{said.first:.6g} s" if said.first == said.last else f"{said.first:.6g} s to {said.last:.6g} s"
    return f"{span}, {said.count} times"


def _shortened(text: str) -> str:
    if len(text) <= MOST_CHARACTERS:
        return text
    return f"{text[:MOST_CHARACTERS]} … and {len(text) - MOST_CHARACTERS} more characters"
