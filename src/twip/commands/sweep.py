"""`twip sweep`: many runs with other values, here or on a cluster."""

import argparse
import shlex
from collections.abc import Sequence
from pathlib import Path

from ..cosim import COUPLINGS, DEFAULT_COUPLING
from ..errors import TwipError
from ..interrupts import INTERRUPTED
from ..lab.endings import check_ending
from ..lab.sweep.axis import Axis
from ..lab.sweep.design import DESIGNS
from ..lab.sweep.keep import record_runs
from ..lab.sweep.parquet import ENDINGS
from ..lab.sweep.plan import ParameterSet, Plan
from ..lab.sweep.plan_file import read_plan
from ..lab.sweep.run import Outcome, run_sweep
from ..lab.sweep.statistics import Rate
from .parts.experiment import pairs
from .parts.paths import refuse_clashes
from .parts.progress import progress_bar
from .parts.sweep_questions import Questions, logs_of, remove_earlier
from .parts.terminal import notice, print_json, print_rows

DESCRIPTION = """\
examples:
  twip sweep ssp/twip.ssp --repeat 100 --stop-time 5
  twip sweep ssp/twip.ssp --vary plant.body_mass=1:6:11 --rate plant.body_mass
  twip sweep ssp/twip.ssp --vary plant.body_mass=1:6:6 plant.cog_height=x0.5:4:8 --map plant.body_mass plant.cog_height
  twip sweep ssp/twip.ssp --vary 'plant.pitch_start=normal(0, 0.2)' --design lhs --samples 200 --keep worst:3
  twip sweep ssp/twip.ssp --parameter-sets sliding= pid=ssp/parameters/pid.ssv --vary plant.pitch_start=-0.4,0,0.4
  twip sweep ssp/twip.ssp --vary friction:left.coulomb_forward,left.coulomb_reverse=x0:4:9
  twip sweep plan.toml --jobs 4
  twip sweep plan.toml --dask tcp://127.0.0.1:8786
  twip sweep plan.toml --resume
  twip sweep logs/plan.parquet --rate plant.body_mass --sensitivity settling_time

Run a system many times with other start values and parameters, judge every run, and write one Parquet file with a row
per run; from such a file, draw pictures. The result does not depend on where and in which order the runs are done.
Pictures and logs of runs that an earlier sweep has left beside the same file are removed."""
_PLAN = ("vary", "parameter_sets", "parameters", "start_values", "design", "samples", "repeat", "seed", "seed_into",
         "metric", "success", "input_file", "start_time", "stop_time", "step_size", "coupling")  # fmt: skip
"""Options that a plan file states instead."""


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.description = DESCRIPTION
    parser.add_argument("source", type=Path, help="system (.ssp, folder or .ssd), plan (.toml), or results (.parquet)")
    what = parser.add_argument_group("what varies")
    what.add_argument(
        "--vary",
        nargs="+",
        action="extend",
        metavar="NAME=VALUES",
        help="component.variable, or LABEL:NAME,NAME for several that take the same value, and the values in the "
        "variable's unit: 1,2,5 (a list), 1:4:7 (7 values from 1 to 4), 1:100:5:log, or a distribution of scipy.stats "
        "such as 'normal(2, 0.1)'; x before any of these for multiples of what it would start with",
    )
    what.add_argument(
        "--parameter-sets",
        nargs="+",
        action="extend",
        metavar="LABEL=FILE.ssv",
        help="whole parameter sets to run everything with, several files with commas, none after = for the system as "
        "it stands; default: none",
    )
    what.add_argument("--design", choices=DESIGNS, help="how distributions are sampled; default: random")
    what.add_argument("--samples", type=int, metavar="N", help="samples of the distributions; needed if there are any")
    what.add_argument("--repeat", type=int, metavar="N", help="runs of each point, with different seeds; default: 1")
    what.add_argument("--seed", type=int, metavar="N", help="seed of the samples and of all runs' seeds; default: 1")
    what.add_argument(
        "--seed-into", nargs="*", action="extend", metavar="NAME",
        help="variables that get each run's seed; default: every Integer parameter called seed",
    )  # fmt: skip
    every = parser.add_argument_group("every run")
    every.add_argument(
        "--parameters", nargs="+", action="extend", metavar="FILE.ssv", help="parameter sets, as of twip run"
    )
    every.add_argument(
        "--start-values", nargs="+", action="extend", metavar=("NAME", "VALUE"), help="start values, as of twip run"
    )
    every.add_argument("--input-file", type=Path, metavar="FILE.csv", help="time series, as of twip run")
    every.add_argument("--start-time", type=float, metavar="S", help="in s; default: the system's, else 0")
    every.add_argument("--stop-time", type=float, metavar="S", help="in s; default: the system's")
    every.add_argument("--step-size", type=float, metavar="S", help="in s; default: the system's, else of its FMUs")
    every.add_argument(
        "--coupling", choices=tuple(COUPLINGS), help=f"default: the system's, else {DEFAULT_COUPLING.name}"
    )
    judged = parser.add_argument_group("how runs are judged")
    judged.add_argument(
        "--metric",
        nargs="+",
        action="extend",
        metavar="METRIC",
        help="final:, min:, max:, peak:, mean: or rms: and a signal; FILE.py:FUNCTION of the table of a run; robot or "
        "one of its metrics; default: robot if the system has its signals",
    )
    judged.add_argument(
        "--success", nargs="+", action="extend", metavar="CONDITION",
        help="'METRIC < NUMBER' and the like, all of which a run must meet; default: 'fallen == 0' for the robot",
    )  # fmt: skip
    how = parser.add_argument_group("how it runs")
    how.add_argument("--out", type=Path, metavar="FILE.parquet", help="default: logs/<source>.parquet")
    how.add_argument("--jobs", type=int, metavar="N", help="local processes, 1 is this one; default: one per processor")
    how.add_argument("--dask", metavar="ADDRESS", help="run on the workers of this Dask scheduler; default: here")
    how.add_argument("--resume", action="store_true", help="do what an interrupted or killed sweep has left")
    how.add_argument("--shuffle", action="store_true", help="do the runs in a random order; the result is the same")
    how.add_argument(
        "--keep", metavar="RUNS",
        help="do some runs again and write their full logs: worst:COUNT, worst:COUNT:METRIC or runs:NUMBER,NUMBER; "
        "default: none",
    )  # fmt: skip
    pictures = parser.add_argument_group("pictures, beside the Parquet file")
    pictures.add_argument(
        "--map",
        nargs="+",
        action="extend",
        metavar="X Y [METRIC]",
        help="a metric, else the share that passes, over two axes",
    )
    pictures.add_argument(
        "--rate", nargs="+", action="extend", metavar="X", help="share that passes along axes, with 95 %% intervals"
    )
    pictures.add_argument("--sensitivity", metavar="METRIC", help="how much a metric, or success, depends on each axis")
    parser.add_argument("--json", action="store_true", help="print one JSON object instead of text, for scripts")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Run the sweep or read its results, draw the pictures, and return the exit status."""
    questions = Questions.of(arguments)
    source: Path = arguments.source
    if source.suffix == ".parquet":
        others = (*_PLAN, "out", "jobs", "dask", "resume", "shuffle", "keep")
        _refuse(arguments, others, f"{source} is there already: it is only drawn")
        if not questions.pictures:
            raise TwipError(f"{source}: what should be drawn? --map, --rate or --sensitivity")
        _tell(arguments, {"results": source}, questions, source)
        return 0
    if source.suffix == ".toml":
        _refuse(arguments, _PLAN, f"belongs into {source}")
        plan = read_plan(source)
    else:
        plan = _plan(arguments)
    out: Path = arguments.out or Path("logs") / f"{source.stem}.parquet"
    check_ending(out, ENDINGS)
    refuse_clashes(
        [("the sweep", source), ("the sweep", plan.system), ("--input-file", plan.input_file)], {"--out": out}
    )
    with progress_bar(out.stem, None, "runs", digits=0) as progress:
        outcome = run_sweep(
            plan,
            out,
            jobs=arguments.jobs,
            dask=arguments.dask,
            resume=arguments.resume,
            shuffle=arguments.shuffle,
            progress=progress,
            notice=notice,
            check=questions.check,
        )
    if outcome.rows:
        remove_earlier(out)
    if not arguments.json:
        _print(outcome)
    told = summary(outcome)
    if outcome.interrupted:
        words = [word for word in arguments.words if word != "--resume"]
        again = shlex.join(["twip", *words, "--resume"]) if outcome.rows else None
        if arguments.json:
            print_json({**told, "go_on_by": again})
        else:
            print_rows(("go on by", again))
        return int(INTERRUPTED)
    logs = []
    if questions.keep is not None:
        logs = record_runs(outcome, questions.keep, logs_of(out))
        if not arguments.json:
            print_rows(*(("log", path) for path in logs))
    _tell(arguments, {**told, "logs": logs, "go_on_by": None}, questions, out)
    return 0


def summary(outcome: Outcome) -> dict[str, object]:
    """Return what a sweep came to, for scripts; times in s, the share of runs that pass with its interval."""
    rate = _rate(outcome)
    return {
        "results": outcome.path if outcome.rows else None,
        "runs": outcome.runs,
        "finished": outcome.finished,
        "done_now": outcome.done_now,
        "passed": outcome.passed,
        "failed": outcome.failed,
        "errors": outcome.errors,
        "pass_rate": None if rate is None else rate.share,
        "pass_rate_interval": None if rate is None else rate.interval,
        "seconds": outcome.seconds,
        "interrupted": outcome.interrupted,
    }


def _tell(arguments: argparse.Namespace, told: dict[str, object], questions: Questions, path: Path) -> None:
    """Draw what is asked for beside the results at `path`, and print that, as JSON together with `told`."""
    pictures: dict[str, Path] = {}
    words: dict[str, list[str]] = {}
    try:
        for kind, picture, lines in questions.draw(path):
            pictures[kind], words[kind] = picture, lines
            if not arguments.json:
                print_rows(*((kind, line) for line in lines), ("picture", picture))
    finally:
        if arguments.json:
            print_json({**told, "pictures": pictures, "sensitivity": words.get("sensitivity")})


def _plan(arguments: argparse.Namespace) -> Plan:
    """Return the plan that the options state. Raises `TwipError`."""
    given = {name: getattr(arguments, name) for name in ("design", "samples", "repeat", "seed")}
    seeds = arguments.seed_into
    return Plan(
        system=arguments.source,
        axes=tuple(_axis(text) for text in arguments.vary or ()),
        parameter_sets=tuple(_set(text) for text in arguments.parameter_sets or ()),
        parameters=tuple(Path(file) for file in arguments.parameters or ()),
        start_values=dict(pairs(arguments.start_values or ())),
        seed_names=None if seeds is None else tuple(seeds),
        metrics=tuple(arguments.metric or ()),
        success=tuple(arguments.success or ()),
        input_file=arguments.input_file,
        start_time=arguments.start_time,
        stop_time=arguments.stop_time,
        step_size=arguments.step_size,
        coupling=arguments.coupling,
        **{name: value for name, value in given.items() if value is not None},
    )


def _axis(text: str) -> Axis:
    target, equals, values = text.partition("=")
    if not equals:
        raise TwipError(f"--vary {text}: must be NAME=VALUES")
    label, colon, names = target.partition(":")
    return Axis.parse(label, values, names.split(",") if colon else ())


def _set(text: str) -> ParameterSet:
    label, equals, files = text.partition("=")
    if not equals or not label:
        raise TwipError(f"--parameter-sets {text}: must be LABEL=FILE.ssv, or LABEL= for the system as it stands")
    return ParameterSet(label, tuple(Path(file) for file in files.split(",") if file))


def _refuse(arguments: argparse.Namespace, names: Sequence[str], why: str) -> None:
    """Raise `TwipError` when one of these options is given."""
    given = [f"--{name.replace('_', '-')}" for name in names if getattr(arguments, name) not in (None, False)]
    if given:
        raise TwipError(f"{', '.join(given)}: {why}")


def _print(outcome: Outcome) -> None:
    """Print what a sweep came to."""
    counts = f"{outcome.finished} of {outcome.runs}" if outcome.interrupted else f"{outcome.finished}"
    speed = ""
    if outcome.done_now:
        speed = f", {outcome.done_now} now in {outcome.seconds:.1f} s ({outcome.seconds / outcome.done_now:.3f} s each)"
    rate = _rate(outcome)
    print_rows(
        ("runs", f"{counts}{speed}"),
        ("passed", None if rate is None else rate_text(rate)),
        ("could not be run", outcome.errors or None),
        ("results", outcome.path if outcome.rows else None),
    )


def _rate(outcome: Outcome) -> Rate | None:
    """Return the share of finished runs that passed, None without conditions; a run that failed has not passed."""
    return Rate(outcome.passed, outcome.finished) if outcome.passed + outcome.failed else None


def rate_text(rate: Rate) -> str:
    """Return a share with its interval in words."""
    low, high = rate.interval
    return f"{rate.successes} of {rate.runs}: {rate.share:.1%} ({low:.1%} to {high:.1%})"
