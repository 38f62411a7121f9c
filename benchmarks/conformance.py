"""Runs the robot in other people's tools and compares each with our loop, signal by signal.

    python benchmarks/conformance.py                    build in a temporary folder, run, write docs/conformance.md
    python benchmarks/conformance.py --built DIR        use what `twip build --out DIR`, plain and --native, built

Every tool gets the same file and the same scenario: the stand-up from 27°, 3 s at 1 ms. It is compared with our loop in
that tool's own scheme: the same order of exchange, the same times and step sizes as it computes them. The same blocks
then see the same numbers, so that the bound is equality. Native FMUs are compared with our loop on Python FMUs. A tool
that is not installed is reported as missing. The exit status is 1 when a tool is missing or differs.
"""

import argparse
import importlib
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray

from twip.commands.build import built_containers
from twip.cosim import Algorithm, Runtime, Table, load, simulate
from twip.cosim.coupling.loop import PythonLoop
from twip.fmi.build import build_all, build_native
from twip.fmi.native.toolchain import this_machine
from twip.lab.native_container import pack_native

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "conformance.md"
STEP_SIZE = 0.001
"""Communication step in s."""
STEPS = 3000
Rows = NDArray[np.float64]
"""Outputs of all components, (steps + 1, outputs)."""


def times_by_product(steps: int) -> tuple[Rows, Rows]:
    """Return times `k·h` and steps `h`: ours, and fmpy's."""
    return np.arange(steps + 1) * STEP_SIZE, np.full(steps, STEP_SIZE)


def times_by_sum(steps: int) -> tuple[Rows, Rows]:
    """Return times that are added up and steps `h`: Ecos."""
    return np.cumsum([0.0, *[STEP_SIZE] * steps]), np.full(steps, STEP_SIZE)


def times_by_nanoseconds(steps: int) -> tuple[Rows, Rows]:
    """Return times of whole nanoseconds and steps that are their differences: libcosim."""
    times = np.arange(steps + 1) * round(STEP_SIZE * 1e9) / 1e9
    return times, np.diff(times)


@dataclass(frozen=True)
class Tool:
    """A program that runs the robot."""

    name: str
    package: str
    """Distribution that brings it."""
    script: str
    """In benchmarks/tools/."""
    file: str
    """What it runs, below the build's folder."""
    scheme: str
    times: Callable[[int], tuple[Rows, Rows]] | None
    """How it computes times and steps; None: what it does is known to differ, or not known, and is not judged."""
    first: int = 0
    """First row that it shows."""
    coupled: bool = False
    """Whether what it runs is coupled inside, as the robot's file says; else the tool couples, by Jacobi."""


COUPLED = "Gauss–Seidel, shaft speeds at mid-step (the file's)"
TOOLS = (
    Tool("fmpy simulate, container FMI 2.0", "fmpy", "fmpy_container.py", "fmus/twip.fmu",
         "Jacobi; connections copied once at the start; times k·h", times_by_product),
    Tool("fmpy simulate, container FMI 3.0", "fmpy", "fmpy_container.py", "fmus/twip_fmi3.fmu",
         "Jacobi; connections copied once at the start; times k·h", times_by_product),
    Tool("libcosim", "libcosimpy", "libcosim.py", "ssp/twip.ssp",
         "Jacobi; times in whole nanoseconds, steps are their differences; no row at the start",
         times_by_nanoseconds, 1),
    Tool("Ecos", "ecospy", "ecos.py", "ssp/twip.ssp", "Jacobi; times added up", times_by_sum),
    Tool("fmpy simulate, native robot FMI 2.0", "fmpy", "fmpy_container.py", "fmus/twip_native.fmu",
         COUPLED, times_by_product, coupled=True),
    Tool("fmpy simulate, native robot FMI 3.0", "fmpy", "fmpy_container.py", "fmus/twip_native_fmi3.fmu",
         COUPLED, times_by_product, coupled=True),
    Tool("libcosim, native FMUs", "libcosimpy", "libcosim.py", "ssp/twip_native.ssp",
         "as libcosim with Python FMUs", times_by_nanoseconds, 1),
    Tool("Ecos, native FMUs", "ecospy", "ecos.py", "ssp/twip_native.ssp", "as Ecos with Python FMUs", times_by_sum),
    Tool("OMSimulator", "OMSimulator", "omsimulator.py", "ssp/twip.ssp", "not tried", None),
    Tool("fmpy simulate_ssp", "fmpy", "fmpy_ssp.py", "ssp/twip.ssp",
         "ignores parameter sets, takes the signal of another connection for an open input, starts inputs at 0, "
         "stamps rows with the time before the step", None),
)  # fmt: skip


@dataclass(frozen=True)
class Outcome:
    """What came of a tool."""

    tool: str
    version: str
    """Empty where it is missing."""
    scheme: str
    differences: dict[str, float] | None
    """Largest difference by signal, in the signal's unit; None where there are no rows to compare."""
    judged: bool
    problem: str = ""

    @property
    def equal(self) -> bool:
        """Whether all signals are equal."""
        return self.differences is not None and not any(self.differences.values())


def robot(built: Path) -> tuple[list[str], list[int]]:
    """Return names and value references of the outputs of all components."""
    with load(built / "ssp" / "twip.ssp") as system:
        outputs = [(f"{c.name}.{v.name}", v.reference) for c in system.components for v in c.outputs]
    return [name for name, _ in outputs], [reference for _, reference in outputs]


def ours(
    built: Path,
    names: Sequence[str],
    times: tuple[Rows, Rows] | None = None,
    steps: int = STEPS,
    system: str = "twip",
    loop: str | None = None,
    coupling: str | None = None,
) -> Rows:
    """Run our loop on ssp/`system`.ssp; with `times` the plain one on another tool's times and steps."""
    if times is not None:
        coupling, loop = "jacobi", "python"
    module = importlib.import_module("twip.cosim.simulate")
    plain = PythonLoop if times is None else loop_on(*times)
    with load(built / "ssp" / f"{system}.ssp") as loaded, patch.object(module, "PythonLoop", plain):
        table = Table(loaded.channels)
        simulate(
            loaded,
            stop_time=steps * STEP_SIZE,
            step_size=STEP_SIZE,
            sinks=[table],
            algorithm=Algorithm(coupling=coupling),
            runtime=Runtime(loop=loop),
        )
    return np.array([table[name] for name in names]).T


def loop_on(times: Rows, sizes: Rows) -> type[PythonLoop]:
    """Return our plain loop, on given times (s) and step sizes (s)."""

    class ToolLoop(PythonLoop):
        done = 0

        def run(self, _times, _step_size, inputs, rows, stop):
            for k in range(len(rows)):
                step = times[self.done : self.done + 2], float(sizes[self.done])
                finished, failure = super().run(*step, inputs[k : k + 1], rows[k : k + 1], stop)
                if not finished:
                    return k, failure
                self.done += 1
            return len(rows), None

    return ToolLoop


def try_tool(tool: Tool, built: Path, names: list[str], references: list[int], steps: int = STEPS) -> Outcome:
    """Run a tool and compare it."""
    try:
        number = version(tool.package)
    except PackageNotFoundError:
        return Outcome(tool.name, "", tool.scheme, None, tool.times is not None, "missing")
    with tempfile.TemporaryDirectory(prefix="twip_conformance_") as folder:
        plan = {"names": names, "references": references, "steps": steps, "step_size": STEP_SIZE}
        target = Path(folder) / "rows.npy"
        script = Path(__file__).parent / "tools" / tool.script
        command = [sys.executable, script, built / tool.file, target, json.dumps(plan)]
        libraries = {**os.environ, "LD_LIBRARY_PATH": str(Path(sys.prefix) / "lib")}  # Ecos needs tbb's
        run = subprocess.run(list(map(str, command)), env=libraries, capture_output=True, text=True, check=False)
        if run.returncode:
            reason = (run.stderr.strip().splitlines() or ["no message"])[-1]
            return Outcome(tool.name, number, tool.scheme, None, tool.times is not None, f"failed: {reason}")
        found = np.load(target)
    if tool.coupled:
        expected = ours(built, names, None, steps, loop="python")
    else:
        expected = ours(built, names, (tool.times or times_by_product)(steps), steps)[tool.first :]
    count = min(len(found), len(expected)) if tool.times is None else len(expected)
    if len(found) < count or (tool.times is not None and len(found) != count):
        problem = f"shows {len(found)} rows, not {count}"
        return Outcome(tool.name, number, tool.scheme, None, tool.times is not None, problem)
    worst = np.abs(found[:count] - expected[:count]).max(axis=0)
    differences = dict(zip(names, worst.tolist(), strict=True))
    return Outcome(tool.name, number, tool.scheme, differences, tool.times is not None)


def try_our_loops(built: Path, names: list[str], steps: int = STEPS) -> list[Outcome]:
    """Compare our compiled loop with our plain one, coupled as the robot's file says and by Jacobi."""
    outcomes = []
    for coupling, scheme in (("gauss-seidel", COUPLED), ("jacobi", "Jacobi")):
        options = {} if coupling == "gauss-seidel" else {"coupling": coupling}
        plain = ours(built, names, None, steps, loop="python", **options)
        for flavour, system in (("", "twip"), (", native FMUs", "twip_native")):
            compiled = ours(built, names, None, steps, system, loop="compiled", **options)
            differences = dict(zip(names, np.abs(compiled - plain).max(axis=0).tolist(), strict=True))
            name = f"our compiled loop, {coupling}{flavour}"
            outcomes.append(Outcome(name, version("twip"), scheme, differences, True))
    return outcomes


def build_for_here(folder: Path) -> None:
    """Build native FMUs for this machine, the systems of them, and the robot of them as one FMU."""
    built = build_native(folder, platforms=[this_machine()])
    assert folder / "ssp" / "twip_native.ssp" in built
    for number, file in (("2.0", "twip_native.fmu"), ("3.0", "twip_native_fmi3.fmu")):
        with load(folder / "ssp" / "twip_native.ssp") as system:
            pack_native(system, number, folder / "fmus" / file, platforms=[this_machine()])


def page(outcomes: list[Outcome], names: list[str]) -> str:
    """Return docs/conformance.md."""
    lines = [
        "# Conformance",
        "",
        "Written by `python benchmarks/conformance.py`. The same robot, the same stand-up from 27° over "
        f"{STEPS * STEP_SIZE:g} s in steps of {STEP_SIZE * 1e3:g} ms, in each tool; compared with our plain loop in "
        "that tool's own scheme: its order of exchange, its times and its step sizes as it computes them. "
        "The blocks then see the same numbers in the same order, so that the bound is equality, bit for bit. "
        "Native FMUs ([native](native.md)) are compared with our loop on Python FMUs. "
        "[Tools](tools.md) says how to use each.",
        "",
        "| tool | version | scheme | largest difference | bound | verdict |",
        "|---|---|---|---|---|---|",
    ]
    for o in outcomes:
        largest = "–" if o.differences is None else f"{max(o.differences.values()):.3g}"
        verdict = o.problem or ("not judged" if not o.judged else "equal" if o.equal else "**differs**")
        lines.append(
            f"| {o.tool} | {o.version or '–'} | {o.scheme} | {largest} | {'0' if o.judged else '–'} | {verdict} |"
        )
    shown = [o for o in outcomes if o.differences is not None]
    lines += ["", "## Largest difference per signal", "", "In the signal's own unit.", ""]
    lines += ["| signal | " + " | ".join(o.tool for o in shown) + " |", "|---|" + "---|" * len(shown)]
    for name in names:
        lines.append(f"| `{name}` | " + " | ".join(f"{o.differences[name]:.3g}" for o in shown if o.differences) + " |")
    return "\n".join(lines) + "\n"


def main() -> int:
    """Run everything, print and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--built", type=Path, metavar="DIR", help="folder with fmus/ and ssp/; default: build anew")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="twip_conformance_") as folder:
        built = arguments.built or Path(folder)
        if arguments.built is None:
            built_containers(built, build_all(built))
            build_for_here(built)
        names, references = robot(built)
        outcomes = try_our_loops(built, names)
        outcomes += [try_tool(tool, built, names, references) for tool in TOOLS]
    text = page(outcomes, names)
    PAGE.write_text(text, encoding="utf-8")
    print(text.split("## ")[0].strip())
    print(f"\nwritten to {PAGE.relative_to(ROOT)}")
    return 0 if all(o.equal for o in outcomes if o.judged) else 1


if __name__ == "__main__":
    sys.exit(main())
