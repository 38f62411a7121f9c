"""The table of all claims: for the terminal, as Markdown beside the pictures, and as JSON."""

import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from rich.table import Table

from ...outputs import write_file
from .checks import Check
from .programme import Timed

INTRODUCTION = """\
# The paper's experiments

Written by `twip paper --out DIR`; the numbers are those of the last run. Each experiment is the robot's SSP with
parameters and inputs of its own, run through the FMUs and the master; the sensor's noise has fixed seeds. A value is
the mean over the seeds, with the smallest and the largest in brackets; *expected* is met only if every seed is
inside. Where the range comes from stands beside it: "prototype" is an earlier program in numpy, independent of the
blocks. Whether the paper's claim *holds* is another question: some figures show, as expected, that it does not.
"""


def missed(results: Sequence[Timed]) -> list[Check]:
    """Return the checks whose expectation is not met."""
    return [check for timed in results for check in timed.result.checks if not check.met]


def terminal_table(results: Sequence[Timed]) -> Table:
    """Return the table for the terminal; what is missed is red."""
    table = Table("figure", "claim, quantity", "expected", "measured", "as expected", "claim holds", expand=False)
    for timed in results:
        for check in timed.result.checks:
            words = f"[italic]{check.claim}[/italic]\n{check.quantity}" if check.claim else check.quantity
            met = "yes" if check.met else "[bold red]MISSED[/bold red]"
            table.add_row(check.figure, words, check.expected_text, check.measured_text, met, check.holds_text)
        table.add_section()
    return table


def markdown(results: Sequence[Timed]) -> str:
    """Return the page with each figure's picture, table and commands."""
    checks = [check for timed in results for check in timed.result.checks]
    lines = [INTRODUCTION, f"{len(checks) - len(missed(results))} of {len(checks)} values are as expected.\n"]
    for timed in results:
        result = timed.result
        number = result.checks[0].figure if result.checks else result.name
        lines += [f"## {number}: {result.title}\n", f"![{number}]({result.name}.png)\n"]
        lines += ["| claim | quantity | expected | from | measured | as expected | holds | note |", "|---" * 8 + "|"]
        for check in result.checks:
            met = "yes" if check.met else "**missed**"
            cells = (
                check.claim, check.quantity, check.expected_text, check.source, check.measured_text, met,
                check.holds_text, check.note,
            )  # fmt: skip
            lines.append(f"| {' | '.join(cell.replace('|', '∣') for cell in cells)} |")
        if result.commands:
            lines += ["\nThe runs in the picture, with seed 1:\n", *(f"    {command}" for command in result.commands)]
        lines.append("")
    return "\n".join(lines)


def write_reports(results: Sequence[Timed], out: Path) -> tuple[Path, Path]:
    """Write `results.md` and `results.json` to `out` and return their paths; TwipError when that cannot be done."""
    data = [
        {
            "name": timed.result.name,
            "title": timed.result.title,
            "checks": [
                {
                    **asdict(check),
                    "measured": [float(value) for value in check.measured],
                    "low": _finite(check.low),
                    "high": _finite(check.high),
                    "holds": None if check.holds is None else bool(check.holds),
                    "met": check.met,
                }
                for check in timed.result.checks
            ],
            "commands": list(timed.result.commands),
        }
        for timed in results
    ]
    page, numbers = out / "results.md", out / "results.json"
    write_file(page, markdown(results).encode())
    write_file(numbers, f"{json.dumps(data, indent=1, ensure_ascii=False)}\n".encode())
    return page, numbers


def _finite(limit: float) -> float | None:
    """Return a limit as JSON can hold it: None where there is none."""
    return limit if abs(limit) < float("inf") else None
