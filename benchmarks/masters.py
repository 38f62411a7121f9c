"""Measures how fast masters run the same FMUs: ours, fmpy's, libcosim, Ecos, CoFmuPy, and the floor.

    python benchmarks/masters.py                      all parts; writes docs/performance.md and docs/performance.png
    python benchmarks/masters.py --only contest       one part: contest, parts, growth or precision; writes nothing
    python benchmarks/masters.py --quick              3 repetitions instead of 7; writes nothing
    python benchmarks/masters.py --cofmupy PYTHON     an interpreter that has CoFmuPy, which pins old versions

Everything is pinned to one processor and measured in turns; ratios of medians within one run are what counts. Takes
about six minutes. The exit status is 1 when a ratio misses its limit. Peers come with the extra `foreign`; one that is
missing is reported as missing. The chains of small FMUs need a C compiler.
"""

import argparse
import os
import sys
import tempfile
import zipfile
from collections.abc import Callable
from pathlib import Path

import growth
import parts
import precision
from chain import write_chain
from contest import Contestant, compete
from figures import draw

from twip.cosim import load
from twip.fmi.build import build_all, build_fmi3
from twip.lab.container import pack

PAGE = Path(__file__).resolve().parents[1] / "docs" / "performance.md"
CHAIN = 6
"""FMUs in the chain that masters are compared on."""
OURS, THROUGH_FMI, PLAIN = "twip, compiled", "twip, compiled, FMI calls only", "twip, plain loop"
FMI3 = "twip, compiled, blocks in FMI 3.0"
FLOOR, NATIVE_FLOOR = "floor: bare FMI calls", "floor: bare native calls"
SSP = "fmpy simulate_ssp"
PEERS = ("fmpy, methods in a loop", SSP, "fmpy, container FMU", "libcosim", "Ecos")


def contestants(container: Path, cofmupy: str | None, blocks: Path | None) -> list[Contestant]:
    """Return who takes part, each without and with its log; `blocks` holds the FMUs in FMI 3.0 where there are any."""
    entries = [
        (OURS, ("twip_loop", "compiled"), (False, True)),
        *([] if blocks is None else [(FMI3, ("twip_loop", "compiled", str(blocks)), (False, True))]),
        (THROUGH_FMI, ("twip_loop", "fmi"), (False, True)),
        (PLAIN, ("twip_loop", "python"), (False, True)),
        (FLOOR, ("floor", "fmi"), (False,)),
        (NATIVE_FLOOR, ("floor", "native"), (False,)),
        ("fmpy, methods in a loop", ("fmpy_methods",), (False, True)),
        (SSP, ("fmpy_ssp",), (True,)),
        ("fmpy, container FMU", ("fmpy_container", str(container)), (False, True)),
        ("libcosim", ("libcosim",), (False, True)),
        ("Ecos", ("ecos",), (False, True)),
    ]
    made = [Contestant(name, words, log) for name, words, logs in entries for log in logs]
    return [*made, Contestant("CoFmuPy", ("cofmupy_master",), False, cofmupy or sys.executable)]


def contest(
    ssp: Path, folder: Path, repetitions: int, cofmupy: str | None, blocks: Path | None = None
) -> list[Contestant]:
    """Measure all masters on one system."""
    unpacked, logs = folder / f"{ssp.stem}_unpacked", folder / f"{ssp.stem}_logs"
    logs.mkdir()
    with zipfile.ZipFile(ssp) as archive:
        archive.extractall(unpacked)
    container = folder / f"{ssp.stem}_container.fmu"
    with load(ssp) as system:
        pack(system, "2.0", container, 0.001)
    made = contestants(container, cofmupy, blocks)
    compete(made, ssp, unpacked, logs, repetitions)
    return made


def table(made: list[Contestant]) -> list[str]:
    """Return a Markdown table of one contest."""
    lines = ["| master | without log | with log |", "|---|---|---|"]
    for name in dict.fromkeys(c.name for c in made):
        cells = []
        for logging in (False, True):
            found = [c for c in made if c.name == name and c.logging is logging]
            cells.append(_cell(found[0]) if found else "")
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return lines


def _cell(c: Contestant) -> str:
    if c.trouble:
        return c.trouble
    first, last = c.spread
    return f"{1e6 * c.median:.2f} ({1e6 * first:.2f}–{1e6 * last:.2f})"


def checks(made: list[Contestant], system: str) -> list[tuple[str, float, float, bool]]:
    """Return claim, measured ratio, limit, and whether it holds."""
    times = {(c.name, c.logging): c.median for c in made if not c.trouble}
    peers = {name: times[name, True] for name in PEERS if (name, True) in times}
    fastest = min(peers, key=lambda name: peers[name]) if peers else ""
    floor, ours = times[FLOOR, False], times[OURS, True]
    found: list[tuple[str, float, float, bool]] = []

    def at_most(claim: str, ratio: float, limit: float) -> None:
        found.append((f"{system}: {claim}", ratio, limit, ratio <= limit))

    def at_least(claim: str, ratio: float, limit: float) -> None:
        found.append((f"{system}: {claim}", ratio, limit, ratio >= limit))

    if system == "robot":
        at_most("without log over bare FMI calls", times[OURS, False] / floor, 1.1)
        at_most("with log over bare FMI calls", ours / floor, 1.3)
        at_most("FMI calls only, without log, over bare FMI calls", times[THROUGH_FMI, False] / floor, 1.1)
        at_most("FMI calls only, with log, over bare FMI calls", times[THROUGH_FMI, True] / floor, 1.3)
    if peers:
        # The chain's steps cost next to nothing, so that the logs are compared: runs of the same code gave 2.6 and 2.0.
        limit = 2.0 if system == "robot" else 1.5
        at_least(f"fastest peer ({fastest}) over ours, both with log", peers[fastest] / ours, limit)
    if SSP in peers:
        at_least("simulate_ssp over ours, both with log", peers[SSP] / ours, 5.0)
    return found


def main() -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", choices=["contest", "parts", "growth", "precision"], help="one part; default: all")
    parser.add_argument("--quick", action="store_true", help="3 repetitions instead of 7; writes nothing")
    parser.add_argument("--cofmupy", metavar="PYTHON", help="an interpreter with CoFmuPy; default: this one")
    arguments = parser.parse_args()
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    repetitions = 3 if arguments.quick else 7
    held: list[tuple[str, float, float, bool]] = []
    sections: dict[str, list[str]] = {}
    data: dict[str, object] = {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        build_all(folder)
        build_fmi3(folder)
        robot = folder / "ssp" / "twip.ssp"

        def masters() -> list[str]:
            lines = []
            (folder / "chain").mkdir()
            for title, ssp in (("robot", robot), ("chain", write_chain(folder / "chain", CHAIN))):
                blocks = folder / "fmus" if title == "robot" else None
                made = contest(ssp, folder, repetitions, arguments.cofmupy, blocks)
                data[title] = made
                held.extend(checks(made, title))
                heading = "The robot" if title == "robot" else f"A chain of {CHAIN} small C FMUs"
                lines += [f"{heading}, µs per step of 1 ms, median (quartiles):", "", *table(made), ""]
            return lines

        steps: dict[str, Callable[[], list[str]]] = {
            "contest": masters,
            "parts": lambda: parts.measure(robot, folder, data),
            "growth": lambda: growth.measure(robot, folder, data, arguments.quick),
            "precision": lambda: precision.measure(robot, data),
        }
        for part, measure in steps.items():
            if arguments.only in (None, part):
                sections[part] = measure()
                print("\n".join(sections[part]), flush=True)
    verdicts = ["| ratio | measured | limit | |", "|---|---|---|---|"]
    for claim, ratio, limit, holds in held:
        verdicts.append(f"| {claim} | {ratio:.2f} | {limit:g} | {'holds' if holds else 'MISSED'} |")
    if held:
        sections["ratios"] = [*verdicts, ""]
        print("\n".join(verdicts))
    if not arguments.quick and arguments.only is None:
        text = PAGE.read_text(encoding="utf-8")
        for part, lines in sections.items():
            begin, end = f"<!-- {part}: begin -->\n", f"<!-- {part}: end -->"
            before, _, rest = text.partition(begin)
            text = before + begin + "\n".join(lines) + end + rest.partition(end)[2]
        PAGE.write_text(text, encoding="utf-8")
        draw(data, PAGE.with_suffix(".png"))
    return 0 if all(holds for *_, holds in held) else 1


if __name__ == "__main__":
    sys.exit(main())
