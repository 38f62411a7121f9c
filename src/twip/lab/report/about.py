"""What a report says in words about its logs: verdict, metrics, parameters that are not nominal, origin."""

import math
from collections.abc import Mapping, Sequence
from html import escape

from ...cosim import Playback
from ..metrics import METRICS, Verdict
from ..remarks import cut_off, remarks
from ..run_parameters import given
from .messages import level_counts

NOTHING = "–"
Cell = str | None
"""Text, or None where a log has nothing to say."""


def table(title: str, logs: Sequence[str], rows: Mapping[str, Sequence[Cell]]) -> str:
    """Return a table with a row per label and a column per log; nothing without rows. All text is escaped."""
    if not rows:
        return ""
    head = ""
    if len(logs) > 1:
        head = f"<thead><tr><th></th>{''.join(f'<th scope=col>{escape(name)}</th>' for name in logs)}</tr></thead>"
    lines = "".join(f"<tr><th scope=row>{escape(label)}</th>{_cells(cells)}</tr>" for label, cells in rows.items())
    return f"<h2>{escape(title)}</h2><table>{head}<tbody>{lines}</tbody></table>"


def summary(logs: Sequence[Playback], verdicts: Sequence[Verdict | None]) -> dict[str, list[Cell]]:
    """Return what each log amounts to, by label."""
    rows: dict[str, list[Cell]] = {}
    if any(verdicts):
        fell = any(verdict.metrics["fallen_at"] < math.inf for verdict in verdicts if verdict)
        for name, metric in METRICS.items():
            if name != "balanced" and (name != "fallen_at" or fell):
                rows[metric.label] = [verdict.text(name) if verdict else None for verdict in verdicts]
    rows["simulated"] = [_span(log) for log in logs]
    rows["messages"] = [_messages(log) for log in logs]
    return rows


def parameters(logs: Sequence[Playback]) -> dict[str, list[Cell]]:
    """Return the parameters that are not nominal in some log, with the nominal value in the label."""
    rows: dict[str, list[Cell]] = {}
    for column, log in enumerate(logs):
        for item in given(log):
            unit = f" {item.unit}" if item.unit not in ("", "1") else ""
            label = item.name if item.nominal is None else f"{item.name} (nominal {_short(item.nominal)}{unit})"
            rows.setdefault(label, [None] * len(logs))[column] = f"{_short(item.value)}{unit}"
    return dict(sorted(rows.items()))


def origin(logs: Sequence[Playback]) -> dict[str, list[Cell]]:
    """Return where the logs come from: command, versions, files and their fingerprints."""
    rows: dict[str, list[Cell]] = {"log": [str(log.path) for log in logs]}
    if not all(log.complete for log in logs):
        rows["state"] = [cut_off(log) or "complete" for log in logs]
    found: dict[str, list[Cell]] = {}
    for column, log in enumerate(logs):
        for title, values in log.metadata.items():
            if title.startswith("component "):
                text = f"{values.get('fmu', '')} {values.get('sha256', '')[:12]}"
                tool = values.get("generation_tool", "")
                entries = {title: f"{text}, {tool}" if tool else text}
            elif title.startswith("start values ") or title == "twip.log":
                continue
            else:
                entries = {f"{title}: {key}": _fingerprint(key, value) for key, value in values.items()}
            for label, value in entries.items():
                found.setdefault(label, [None] * len(logs))[column] = value
    first = [label for label in found if label.startswith("run: ")]
    return (
        rows
        | {label.removeprefix("run: "): found[label] for label in first}
        | {label: cells for label, cells in found.items() if label not in first}
    )


def verdicts_line(names: Sequence[str], colors: Sequence[str], verdicts: Sequence[Verdict | None]) -> str:
    """Return the verdicts for the head of the page."""
    texts = []
    for name, color, verdict in zip(names, colors, verdicts, strict=True):
        words = verdict.sentence() if verdict else ""
        if len(names) > 1:
            words = words or ("not the robot" if any(verdicts) else "")
            words = f"{name}: {words}" if words else name
        elif verdict:
            color = "var(--green)" if verdict.balanced else "var(--red)" if verdict.decided else "var(--grey)"
        if words:
            texts.append(f'<span class="verdict" style="--mark: {color}">{escape(words)}</span>')
    return "".join(texts)


def remarks_line(names: Sequence[str], logs: Sequence[Playback]) -> str:
    """Return what should be known before anything else, for the head of the page."""
    found = [(name, text) for name, log in zip(names, logs, strict=True) for text in remarks(log)]
    texts = [f"{name}: {text}" if len(names) > 1 else text for name, text in found]
    return "".join(f'<span class="remark">{escape(text)}</span>' for text in texts)


def _cells(cells: Sequence[Cell]) -> str:
    return "".join(f"<td>{escape(cell or NOTHING)}</td>" for cell in cells)


def _span(log: Playback) -> str:
    if not len(log.times):
        return "no rows"
    first, last = float(log.times[0]), float(log.times[-1])
    cut = "" if log.complete else ", cut off"
    return f"{first:.6g} s to {last:.6g} s, {len(log.times)} rows{cut}"


def _messages(log: Playback) -> str:
    return level_counts((event.level, 1) for event in log.events) or "none"


def _short(text: str) -> str:
    """Return a number as people write it; other text as it is."""
    try:
        return text if text in ("True", "False") else f"{float(text):g}"
    except ValueError:
        return text


def _fingerprint(key: str, value: str) -> str:
    return value[:12] if key == "sha256" else value
