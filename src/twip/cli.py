"""The command line: `twip build`, `twip run` and `twip demo`."""

import argparse
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from .cosim.log import Attachment, McapLog
from .cosim.record import Sink
from .cosim import CsvSink, Result, load, simulate
from .cosim.experiment import time_grid
from .errors import TwipError
from .fmi.build import build_all
from .lab.demo import demo

INTERRUPTED = 130
"""Exit status after Ctrl-C: 128 + SIGINT."""


@contextmanager
def progress_bar(label: str, total: float, unit: str) -> Iterator[Callable[[float], None]]:
    """Show a progress bar on standard error while the block runs; silent where that is not a terminal."""
    console = Console(stderr=True)
    text = TextColumn("{task.completed:.1f}/{task.total:g} " + unit)
    bar = Progress(TextColumn("{task.description}"), BarColumn(), text, TimeElapsedColumn(), TimeRemainingColumn(),
                   console=console, transient=True, disable=not console.is_terminal)  # fmt: skip
    with bar:
        task = bar.add_task(label, total=total)
        yield lambda done: bar.update(task, completed=done)


def pairs(values: Sequence[str]) -> dict[str, str]:
    """Return the name-value pairs of `--start-values a 1 b 2`."""
    if len(values) % 2:
        raise TwipError(f"--start-values {' '.join(values)}: names and values must come in pairs, but {values[-1]} has no value")
    return dict(zip(values[::2], values[1::2], strict=True))


def run_build(arguments: argparse.Namespace) -> int:
    """Build the FMUs and SSPs."""
    paths = build_all(arguments.out, arguments.blocks or None)
    for path in paths:
        print(path)
    return 0


def run_system(arguments: argparse.Namespace) -> int:
    """Run an SSP."""
    system = load(arguments.ssp, parameters=arguments.parameters, start_values=pairs(arguments.start_values))
    grid = time_grid(system, arguments.start_time, arguments.stop_time, arguments.step_size)
    log = None if arguments.no_log else arguments.log or Path("logs") / f"{Path(arguments.ssp).stem}.mcap"
    metadata = {**system.provenance(), "run": {"command": " ".join(["twip", *arguments.words]), "twip": version("twip")}}
    attachments = [Attachment.file(Path(p)) for p in (arguments.ssp, *arguments.parameters, arguments.input_file) if p and Path(p).is_file()]
    sinks: list[Sink] = []
    if log:
        sinks.append(McapLog(log, system.channels, metadata, attachments, start_time=grid.start))
    if arguments.output_file:
        sinks.append(CsvSink(arguments.output_file, system.channels))
    with progress_bar(system.name, grid.stop, "s") as progress:
        result = simulate(system, start_time=grid.start, stop_time=grid.stop, step_size=grid.step_size, coupling=arguments.coupling,
                          input_file=arguments.input_file, sinks=sinks, progress=progress, loop=arguments.loop)  # fmt: skip
    print_result(result)
    for label, path in (("log", log), ("output", arguments.output_file)):
        if path:
            print(f"{label:<17} {path}")
    return INTERRUPTED if result.interrupted else 0


def print_result(result: Result) -> None:
    """Print what a run did."""
    ended = "interrupted at" if result.interrupted else "simulated"
    print(f"{ended:<17} {result.time:g} s in {result.steps} steps of {result.step_size:g} s ({result.coupling})")
    print(f"{'real-time factor':<17} {result.real_time_factor:.1f} ({result.wall_time:.2f} s)")


def run_demo(arguments: argparse.Namespace) -> int:
    """Stand the robot up from 27 degrees."""
    with progress_bar("standing up", 1.0, "") as progress:
        report = demo(arguments.out, progress)
    print(report.text)
    if report.interrupted:
        return INTERRUPTED
    return 0 if report.balanced else 1


RUN_EXAMPLES = """\
examples:
  twip run ssp/twip.ssp
  twip run ssp/twip.ssp --stop-time 5 --start-values plant.pitch_start 0.3 imu.seed 7
  twip run ssp/twip.ssp --parameters ssp/parameters/pid.ssv --log logs/pid.mcap
  twip run ssp/twip.ssp --input-file ssp/inputs/push.csv --output-file push.csv
"""


def parser() -> argparse.ArgumentParser:
    """Return the command line's grammar."""
    style = argparse.RawDescriptionHelpFormatter
    examples = "examples:\n  twip demo\n  twip build\n" + RUN_EXAMPLES.partition("\n")[2]
    top = argparse.ArgumentParser("twip", formatter_class=style, usage="twip COMMAND [options]",
                                  description=f"{examples}\n{sys.modules[__package__].__doc__}")  # fmt: skip
    top.add_argument("--version", action="version", version=f"twip {version('twip')}")
    commands = top.add_subparsers(title="commands", required=True, metavar="COMMAND")

    build = commands.add_parser("build", help="build the FMUs and SSPs", formatter_class=style,
                                description="examples:\n  twip build\n  twip build motor plant --out /tmp/robot\n\nBuild the blocks' FMUs and the wired systems' SSPs.")  # fmt: skip
    build.add_argument("blocks", nargs="*", help="names of blocks; default: all blocks and systems")
    build.add_argument("--out", type=Path, default=Path(), metavar="DIR", help="where fmus/ and ssp/ are written; default: the current folder")
    build.set_defaults(run=run_build)

    run = commands.add_parser("run", help="run a system of FMUs", formatter_class=style,
                              description=f"{RUN_EXAMPLES}\nRun a system of FMUs (SSP) and log it.")  # fmt: skip
    run.add_argument("ssp", help=".ssp archive, unpacked folder or .ssd file")
    run.add_argument("--start-time", type=float, metavar="S", help="start time in s; default: the system's, else 0")
    run.add_argument("--stop-time", type=float, metavar="S", help="stop time in s; default: the system's")
    run.add_argument("--step-size", type=float, metavar="S", help="communication step in s; default: the system's, else the smallest of its FMUs")
    run.add_argument("--start-values", nargs="+", default=[], metavar=("NAME", "VALUE"), help="start values of component.variable, in the variable's unit")
    run.add_argument("--parameters", nargs="+", default=[], metavar="FILE.ssv", help="parameter sets with names component.variable; a later one wins")
    run.add_argument("--input-file", metavar="FILE.csv", help="time series for open inputs: columns time, component.variable")
    run.add_argument("--output-file", metavar="FILE.csv", help="write all outputs as CSV")
    run.add_argument("--coupling", choices=["jacobi", "gauss-seidel"], help="default: the system's, else jacobi")
    run.add_argument("--loop", choices=["compiled", "python"], help="how steps are executed; default: compiled where numba is installed")
    run.add_argument("--log", type=Path, metavar="FILE.mcap", help="default: logs/<system>.mcap")
    run.add_argument("--no-log", action="store_true", help="write no log")
    run.set_defaults(run=run_system)

    stand_up = commands.add_parser("demo", help="build the robot and stand it up from 27 degrees", formatter_class=style,
                                   description="examples:\n  twip demo\n  twip demo --out /tmp/robot\n\nBuild the robot, stand it up from 27 degrees, print a summary and write log and picture.")  # fmt: skip
    stand_up.add_argument("--out", type=Path, default=Path(), metavar="DIR", help="where fmus/, ssp/ and logs/ are written; default: the current folder")
    stand_up.set_defaults(run=run_demo)
    return top


def main(words: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit status; a user's mistake is one line on standard error and status 1."""
    words = list(sys.argv[1:] if words is None else words)
    arguments = parser().parse_args(words)
    arguments.words = words
    try:
        return int(arguments.run(arguments))
    except TwipError as error:
        for line in str(error).splitlines():
            print(f"twip: {line}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("twip: interrupted", file=sys.stderr)
        return INTERRUPTED


if __name__ == "__main__":
    sys.exit(main())
