"""`twip run`: run a system of FMUs."""

import argparse
import shlex
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from signal import SIGINT

from ..cosim import (
    START_LIMIT,
    TIME_LIMIT,
    Attachment,
    Checkpoint,
    Checkpoints,
    McapLog,
    Observer,
    Request,
    Result,
    RunDetails,
    Runtime,
    Sink,
    System,
    TimeGrid,
    grid_of,
    open_sink,
    prepare,
    scenario_files,
    simulate,
)
from ..errors import TwipError
from ..lab.course import Course
from ..lab.metrics import Verdict, is_robot
from ..lab.scene import scene
from .parts import live
from .parts.experiment import declare_experiment, load_system, request, swaps
from .parts.paths import refuse_clashes
from .parts.progress import progress_bar
from .parts.terminal import Warnings, notice, print_json, print_rows

DEFAULT = Path()
"""Stands for the default path where an option is given without one."""
EXAMPLES = """\
examples:
  twip run ssp/twip.ssp
  twip run ssp/twip.ssp --stop-time 5 --start-values plant.pitch_start 0.3 imu.seed 7
  twip run ssp/twip.ssp --parameters ssp/parameters/pid.ssv --log logs/pid.mcap
  twip run ssp/twip.ssp --input-file ssp/inputs/push.csv --output-file push.csv
  twip run ssp/twip.ssp --scenario ssp/scenarios/bad_day.toml
  twip run ssp/twip.ssp --swap controller=other.fmu --swap-map controller=other.toml
  twip run ssp/twip.ssp --real-time
  twip run ssp/twip.ssp --isolate
  twip run ssp/twip.ssp --checkpoint-every 1
  twip run ssp/twip.ssp --real-time --live --stop-time 600
  twip run ssp/twip.ssp --resume logs/twip.checkpoint --stop-time 20
"""
CACHE = """\
Unpacked FMUs and the code compiled for them are kept for later runs in ~/.cache/twip, or in the folder
that the variable TWIP_CACHE names; delete it when no run uses it to get the space back."""


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.description = f"{EXAMPLES}\nRun a system of FMUs (SSP) and log it.\n\n{CACHE}"
    parser.add_argument("ssp", help=".ssp archive, unpacked folder or .ssd file")
    declare_experiment(parser)
    declare_execution(parser)
    parser.set_defaults(run=run)


def declare_execution(parser: argparse.ArgumentParser) -> None:
    """Declare how it is run, and what is written."""
    parser.add_argument(
        "--output-file",
        type=Path,
        metavar="FILE.csv",
        help="write all outputs as CSV, or in the format that another ending names, such as .mcap; default: none",
    )
    parser.add_argument(
        "--loop",
        choices=["compiled", "python"],
        help="how steps are executed, with the same results; default: compiled where numba is installed, "
        "but python where steps are repeated",
    )
    parser.add_argument(
        "--isolate",
        action="store_true",
        help="run each FMU in a process of its own: one that crashes or hangs ends the run cleanly; the results are "
        "the same, each step takes longer; default: all in this process",
    )
    parser.add_argument(
        "--time-limit",
        type=float,
        metavar="S",
        help=f"with --isolate, longest that a call of an FMU may take, in s; default: {TIME_LIMIT:g}, "
        f"and at least {START_LIMIT:g} until its first step is done",
    )
    parser.add_argument(
        "--log",
        type=Path,
        metavar="FILE.mcap",
        help="default: logs/<system>.mcap; of a resumed run logs/<system>-from-<time>s.mcap",
    )
    parser.add_argument("--no-log", action="store_true", help="write no log")
    parser.add_argument(
        "--checkpoint",
        nargs="?",
        type=Path,
        const=DEFAULT,
        metavar="FILE",
        help="keep the state of the whole run at its end, also after Ctrl-C, for --resume; "
        "default: none, without FILE or with --checkpoint-every logs/<system>.checkpoint",
    )
    parser.add_argument(
        "--checkpoint-every",
        type=float,
        metavar="S",
        help="keep the state every S simulated seconds too; default: at the end only",
    )
    parser.add_argument(
        "--resume",
        type=Path,
        metavar="FILE",
        help="go on from a checkpoint, with all other options as before; only --stop-time (in s) may be later, "
        "and inputs later than the checkpoint may differ",
    )
    parser.add_argument(
        "--real-time",
        nargs="?",
        type=float,
        const=1.0,
        metavar="FACTOR",
        help="pace the run to the wall clock, at FACTOR simulated seconds per second (1 if not given); "
        "default: as fast as it goes",
    )
    live.declare(parser)
    parser.add_argument("--json", action="store_true", help="print one JSON object instead of text, for scripts")


def run(arguments: argparse.Namespace) -> int:
    """Run the system, and return the exit status."""
    if arguments.no_log and arguments.log is not None:
        raise TwipError(f"--log {arguments.log} and --no-log exclude each other")
    with load_system(arguments.ssp, arguments) as system:
        wanted = request(arguments)
        grid = _grid(system, wanted)
        variant = "" if arguments.ssd is None else f"-{Path(arguments.ssd).stem}"
        unresumed = default = Path("logs") / f"{Path(arguments.ssp).stem}{variant}"
        if arguments.resume is not None:
            default = from_time(default, grid.times(Checkpoint.read(arguments.resume).steps, 0)[0])
        log = None if arguments.no_log else arguments.log or default.with_name(f"{default.name}.mcap")
        checkpoint = arguments.checkpoint
        if checkpoint == DEFAULT or (checkpoint is None and arguments.checkpoint_every is not None):
            checkpoint = unresumed.with_name(f"{unresumed.name}.checkpoint")
        reads = [("SSP", arguments.ssp), *(("--parameters", p) for p in arguments.parameters)]
        scenario = [] if arguments.scenario is None else scenario_files(arguments.scenario)
        reads += [("--input-file", arguments.input_file), *(("--scenario", file) for file in scenario)]
        writes = {"--log": log, "--output-file": arguments.output_file, "--checkpoint": checkpoint}
        swapped = [*swaps("--swap", arguments.swap).values(), *swaps("--swap-map", arguments.swap_map).values()]
        reads += [("--swap", file) for file in swapped]
        refuse_clashes(reads, writes)
        refuse_clashes([("--resume", arguments.resume)], {**writes, "--checkpoint": None})
        metadata = {
            **system.provenance(),
            "run": {"command": shlex.join(["twip", *arguments.words]), "twip": version("twip")},
        }
        attachments = [
            Attachment.file(Path(p))
            for p in (arguments.ssp, *arguments.parameters, arguments.input_file, *scenario, *swapped)
            if p and Path(p).is_file()
        ]

        inputs = live.live_inputs(arguments, system)
        course = Course(system.channels, arguments.resume is not None) if is_robot(system.columns) else None

        def details(grid: TimeGrid) -> RunDetails:
            extras = scene(system.channels, metadata)  # for one sink: they remember the rows
            return RunDetails(system.channels, metadata, attachments, grid.start, extras)

        def sinks(grid: TimeGrid) -> list[Sink]:
            opened: list[Sink] = [Warnings()] if course is None else [Warnings(), course]
            if inputs is not None:
                opened.append(live.live_view(arguments, system, metadata, inputs, grid.start))
            if log is not None:
                opened.append(McapLog.open(log, details(grid)))
            if arguments.output_file is not None:
                opened.append(open_sink(arguments.output_file, details(grid)))
            return opened

        with progress_bar(system.name, grid.stop, "s") as progress, live.steering(inputs):
            result = simulate(
                system,
                start_time=grid.start,
                stop_time=grid.stop,
                step_size=grid.step_size,
                algorithm=wanted.algorithm,
                inputs=replace(wanted.inputs, live=inputs),
                sinks=sinks,
                runtime=Runtime(
                    loop=arguments.loop,
                    isolate=arguments.isolate,
                    time_limit=arguments.time_limit,
                    real_time=arguments.real_time or (None if inputs is None else 1.0),
                ),
                checkpoints=Checkpoints(checkpoint, arguments.checkpoint_every, arguments.resume),
                observer=Observer(progress, notice),
            )
    again = None
    if result.interrupted and result.checkpoint is not None:
        more = ["--resume", str(result.checkpoint)]
        for option, path in (("--log", arguments.log), ("--output-file", arguments.output_file)):
            if path is not None:  # a later option wins: the files of this run are not replaced
                more += [option, str(from_time(path, result.time))]
        again = shlex.join(["twip", *arguments.words, *more])
    began = bool(result.values)  # otherwise the files of an earlier run are still there
    files = (
        ("log", log if began else None),
        ("output", arguments.output_file if began else None),
        ("checkpoint", result.checkpoint),
        ("go on by", again),
    )
    verdict = None if course is None else course.verdict()
    if arguments.json:
        print_json(summary(result) | {label.replace(" ", "_"): path for label, path in files} | judgement(verdict))
    else:
        print_result(result)
        print_rows(*files, ("verdict", None if verdict is None else verdict.sentence()))
    return 128 + (result.signal or SIGINT) if result.interrupted else 0


def _grid(system: System, wanted: Request) -> TimeGrid:
    """Return the times of the run; what is wrong with them is told with all the rest."""
    try:
        return grid_of(system, wanted)
    except TwipError:
        return prepare(system, wanted).grid


def from_time(path: Path, time: float) -> Path:
    """Return the path of a file that begins at `time` in s instead of the start time."""
    return path.with_name(f"{path.stem}-from-{time:g}s{path.suffix}")


def summary(result: Result) -> dict[str, object]:
    """Return what a run did, for scripts; times in s."""
    kept = ("start_time", "time", "steps", "step_size", "coupling", "setup_time", "wall_time", "real_time_factor")
    found: dict[str, object] = {name: getattr(result, name) for name in kept}
    if result.real_time is not None:
        found["deadlines"] = {
            name: getattr(result.real_time, name) for name in ("factor", "deadlines", "missed", "worst_lateness")
        }
    return found | {
        "interrupted": result.interrupted,
        "ended": result.ended,
        "warnings": result.warnings,
        "values": result.values,
    }


def judgement(verdict: Verdict | None) -> dict[str, object]:
    """Return the verdict on the robot's run, for scripts; all null for another system."""
    if verdict is None:
        return {"verdict": None, "balanced": None, "metrics": None}
    balanced = verdict.balanced if verdict.decided else None
    return {"verdict": verdict.sentence(), "balanced": balanced, "metrics": verdict.metrics}


def print_result(result: Result) -> None:
    """Print what a run did."""
    start = f" from {result.start_time:g} s" if result.start_time else ""
    steps = f"{result.steps} steps of {result.step_size:g} s ({result.coupling})"
    if result.variable is not None:
        steps = f"{result.steps} variable steps, {result.variable} ({result.coupling})"
    if result.iterations:
        steps = f"{steps[:-1]}, {result.iterations / max(result.steps, 1):.1f} iterations per step)"
    print_rows(
        ("interrupted at" if result.interrupted else "simulated to", f"{result.time:g} s{start} in {steps}"),
        ("ended", result.ended or None),
        ("start-up", f"{result.setup_time:.2f} s"),
        ("real-time factor", f"{result.real_time_factor:.1f} ({result.wall_time:.2f} s)"),
        ("real time", result.real_time),
    )
