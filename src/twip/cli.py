"""The command line: `twip build`, `twip run` and `twip demo`."""

import argparse
import shlex
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from .cosim import CsvSink, Result, load, simulate
from .cosim.checkpoint import Checkpoint
from .cosim.experiment import TimeGrid, time_grid
from .cosim.log import Attachment, McapLog
from .cosim.record import Sink
from .errors import TwipError
from .fmi.build import build_all
from .lab.demo import demo

INTERRUPTED = 130
"""Exit status after Ctrl-C: 128 + SIGINT."""
DEFAULT = Path()
"""Stands for the default path where an option is given without one."""


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
        raise TwipError(
            f"--start-values {' '.join(values)}: names and values must come in pairs, but {values[-1]} has no value"
        )
    return dict(zip(values[::2], values[1::2], strict=True))


def run_build(arguments: argparse.Namespace) -> int:
    """Build the FMUs and SSPs."""
    paths = build_all(arguments.out, arguments.blocks or None)
    for path in paths:
        print(path)
    return 0


def notice(text: str) -> None:
    """Tell the user about something that takes a while."""
    print(f"twip: {text} …", file=sys.stderr, flush=True)


def run_system(arguments: argparse.Namespace) -> int:
    """Run an SSP."""
    with load(arguments.ssp, parameters=arguments.parameters, start_values=pairs(arguments.start_values)) as system:
        grid = time_grid(system, arguments.start_time, arguments.stop_time, arguments.step_size)
        default = Path("logs") / Path(arguments.ssp).stem
        if arguments.resume is not None:
            default = from_time(default, grid.times(Checkpoint.read(arguments.resume).steps, 0)[0])
        log = None if arguments.no_log else arguments.log or default.with_name(f"{default.name}.mcap")
        checkpoint = arguments.checkpoint
        if checkpoint == DEFAULT or (checkpoint is None and arguments.checkpoint_every is not None):
            checkpoint = Path("logs") / f"{Path(arguments.ssp).stem}.checkpoint"
        metadata = {
            **system.provenance(),
            "run": {"command": shlex.join(["twip", *arguments.words]), "twip": version("twip")},
        }
        attachments = [
            Attachment.file(Path(p))
            for p in (arguments.ssp, *arguments.parameters, arguments.input_file)
            if p and Path(p).is_file()
        ]

        def sinks(grid: TimeGrid) -> list[Sink]:
            opened: list[Sink] = []
            if log is not None:
                opened.append(McapLog(log, system.channels, metadata, attachments, start_time=grid.start))
            if arguments.output_file is not None:
                opened.append(CsvSink(arguments.output_file, system.channels))
            return opened

        with progress_bar(system.name, grid.stop, "s") as progress:
            result = simulate(
                system,
                start_time=grid.start,
                stop_time=grid.stop,
                step_size=grid.step_size,
                coupling=arguments.coupling,
                mid_step=arguments.mid_step,
                input_file=arguments.input_file,
                sinks=sinks,
                progress=progress,
                notice=notice,
                loop=arguments.loop,
                checkpoint=checkpoint,
                checkpoint_every=arguments.checkpoint_every,
                resume=arguments.resume,
            )
    print_result(result)
    print_rows(("log", log), ("output", arguments.output_file), ("checkpoint", result.checkpoint))
    if result.interrupted and result.checkpoint is not None:
        more = ["--resume", str(result.checkpoint)]
        for option, path in (("--log", arguments.log), ("--output-file", arguments.output_file)):
            if path is not None:  # a later option wins: the files of this run are not replaced
                more += [option, str(from_time(path, result.time))]
        print_rows(("go on by", shlex.join(["twip", *arguments.words, *more])))
    return INTERRUPTED if result.interrupted else 0


def from_time(path: Path, time: float) -> Path:
    """Return the path of a file that begins at `time` in s instead of the start time."""
    return path.with_name(f"{path.stem}-from-{time:g}s{path.suffix}")


def print_result(result: Result) -> None:
    """Print what a run did."""
    for warning in result.warnings:
        print(f"twip: warning: {warning}", file=sys.stderr)
    start = f" from {result.start_time:g} s" if result.start_time else ""
    steps = f"{result.steps} steps of {result.step_size:g} s ({result.coupling})"
    print_rows(
        ("interrupted at" if result.interrupted else "simulated to", f"{result.time:g} s{start} in {steps}"),
        ("start-up", f"{result.setup_time:.2f} s"),
        ("real-time factor", f"{result.real_time_factor:.1f} ({result.wall_time:.2f} s)"),
    )


def print_rows(*rows: tuple[str, object]) -> None:
    """Print labels and what there is to say about them; rows with nothing are left out."""
    for label, content in rows:
        if content is not None:
            print(f"{label:<19} {content}")


def run_demo(arguments: argparse.Namespace) -> int:
    """Stand the robot up from 27 degrees."""
    with progress_bar("standing up", 10.0, "s") as progress:
        report = demo(arguments.out, progress, notice)
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
  twip run ssp/twip.ssp --checkpoint-every 1
  twip run ssp/twip.ssp --resume logs/twip.checkpoint --stop-time 20
"""
CACHE = """\
Unpacked FMUs and the code compiled for them are kept for later runs in ~/.cache/twip, or in the folder
that the variable TWIP_CACHE names; delete it when no run uses it to get the space back."""


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
    build.add_argument(
        "--out",
        type=Path,
        default=Path(),
        metavar="DIR",
        help="where fmus/ and ssp/ are written; default: the current folder",
    )
    build.set_defaults(run=run_build)

    run = commands.add_parser(
        "run",
        help="run a system of FMUs",
        formatter_class=style,
        description=f"{RUN_EXAMPLES}\nRun a system of FMUs (SSP) and log it.\n\n{CACHE}",
    )
    run.add_argument("ssp", help=".ssp archive, unpacked folder or .ssd file")
    run.add_argument("--start-time", type=float, metavar="S", help="start time in s; default: the system's, else 0")
    run.add_argument("--stop-time", type=float, metavar="S", help="stop time in s; default: the system's")
    run.add_argument(
        "--step-size",
        type=float,
        metavar="S",
        help="communication step in s; default: the system's, else the smallest of its FMUs",
    )
    run.add_argument(
        "--start-values",
        nargs="+",
        default=[],
        metavar=("NAME", "VALUE"),
        help="start values of component.variable, in the variable's unit",
    )
    run.add_argument(
        "--parameters",
        nargs="+",
        default=[],
        metavar="FILE.ssv",
        help="parameter sets with names component.variable; a later one wins",
    )
    run.add_argument(
        "--input-file", metavar="FILE.csv", help="time series for open inputs: columns time in s, component.variable"
    )
    run.add_argument("--output-file", type=Path, metavar="FILE.csv", help="write all outputs as CSV; default: none")
    run.add_argument("--coupling", choices=["jacobi", "gauss-seidel"], help="default: the system's, else jacobi")
    run.add_argument(
        "--mid-step",
        nargs="*",
        metavar="NAME",
        help="inputs (component.variable) that are taken at the middle of each step, none without names; "
        "default: the system's, unless --coupling is given",
    )
    run.add_argument(
        "--loop",
        choices=["compiled", "python"],
        help="how steps are executed, with the same results; default: compiled where numba is installed",
    )
    run.add_argument(
        "--log",
        type=Path,
        metavar="FILE.mcap",
        help="default: logs/<system>.mcap; of a resumed run logs/<system>-from-<time>s.mcap",
    )
    run.add_argument("--no-log", action="store_true", help="write no log")
    run.add_argument(
        "--checkpoint",
        nargs="?",
        type=Path,
        const=DEFAULT,
        metavar="FILE",
        help="keep the state of the whole run at its end, also after Ctrl-C, for --resume; "
        "default: none, without FILE or with --checkpoint-every logs/<system>.checkpoint",
    )
    run.add_argument(
        "--checkpoint-every",
        type=float,
        metavar="S",
        help="keep the state every S simulated seconds too; default: at the end only",
    )
    run.add_argument(
        "--resume",
        type=Path,
        metavar="FILE",
        help="go on from a checkpoint, with all other options as before; only --stop-time (in s) may be later, "
        "and inputs later than the checkpoint may differ",
    )
    run.set_defaults(run=run_system)

    stand_up = commands.add_parser("demo", help="build the robot and stand it up from 27 degrees", formatter_class=style,
                                   description="examples:\n  twip demo\n  twip demo --out /tmp/robot\n\nBuild the robot, stand it up from 27 degrees, print a summary and write log and picture.")  # fmt: skip
    stand_up.add_argument(
        "--out",
        type=Path,
        default=Path(),
        metavar="DIR",
        help="where fmus/, ssp/ and logs/ are written; default: the current folder",
    )
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
