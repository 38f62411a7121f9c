"""Options that say what is to be run: the system, its values, times, inputs and coupling."""

import argparse
from collections.abc import Sequence

from ...cosim import Algorithm, Inputs, Request, System, load, time_problems
from ...errors import TwipError
from .build_hint import told_to_build
from .coupling import coupling_options, declare_coupling


def declare_values(parser: argparse.ArgumentParser) -> None:
    """Declare what the variables begin with."""
    parser.add_argument(
        "--start-values",
        nargs="+",
        action="extend",
        default=[],
        metavar=("NAME", "VALUE"),
        help="start values of component.variable, in the variable's unit; default: the system's",
    )
    parser.add_argument(
        "--parameters",
        nargs="+",
        action="extend",
        default=[],
        metavar="FILE.ssv",
        help="parameter sets with names component.variable; a later one wins; default: none",
    )


def declare_experiment(parser: argparse.ArgumentParser) -> None:
    """Declare what is to be run: values, times, inputs, coupling."""
    parser.add_argument(
        "--ssd", metavar="NAME", help="one of several descriptions in the archive; default: SystemStructure.ssd"
    )
    parser.add_argument("--start-time", type=float, metavar="S", help="start time in s; default: the system's, else 0")
    parser.add_argument("--stop-time", type=float, metavar="S", help="stop time in s; default: the system's")
    parser.add_argument(
        "--step-size",
        type=float,
        metavar="S",
        help="communication step in s; default: the system's, else the smallest of its FMUs",
    )
    declare_values(parser)
    parser.add_argument(
        "--swap",
        nargs="+",
        action="extend",
        default=[],
        metavar="NAME=FILE.fmu",
        help="another FMU in a component's place; it must fit (docs/swapping.md)",
    )
    parser.add_argument(
        "--swap-map",
        nargs="+",
        action="extend",
        default=[],
        metavar="NAME=FILE.toml",
        help="how names and units of a swapped FMU differ from the system's; default: not at all",
    )
    parser.add_argument(
        "--input-file", metavar="FILE.csv", help="time series for open inputs: columns time in s, component.variable"
    )
    parser.add_argument(
        "--scenario",
        metavar="FILE.toml",
        help="time series, parameter changes and faults of connections (docs/scenarios.md); default: none",
    )
    declare_coupling(parser)


def load_system(path: str, arguments: argparse.Namespace) -> System:
    """Load the system at `path` with the values and swaps of the options; wrong times are told with what is wrong."""
    wrong = time_problems(arguments.start_time, arguments.stop_time, arguments.step_size)
    try:
        with told_to_build(path):
            return load(
                path,
                ssd=arguments.ssd,
                parameters=arguments.parameters,
                start_values=pairs(arguments.start_values),
                swap=swaps("--swap", arguments.swap),
                swap_map=swaps("--swap-map", arguments.swap_map),
            )
    except TwipError as error:
        raise TwipError([*error.problems, *wrong]) from None


def request(arguments: argparse.Namespace) -> Request:
    """Return what the options want of the run."""
    return Request(
        start_time=arguments.start_time,
        stop_time=arguments.stop_time,
        step_size=arguments.step_size,
        algorithm=Algorithm(**coupling_options(arguments)),
        inputs=Inputs(arguments.input_file, arguments.scenario),
        isolate=getattr(arguments, "isolate", False),
    )


def swaps(option: str, values: Sequence[str]) -> dict[str, str]:
    """Return the files by component of `--swap a=b.fmu c=d.fmu`."""
    found: dict[str, str] = {}
    for text in values:
        name, equals, file = text.partition("=")
        if not (name and equals and file):
            raise TwipError(f"{option} {text}: a component and a file are needed, such as controller=other.fmu")
        if name in found:
            raise TwipError(f"{option}: {name} is given more than once")
        found[name] = file
    return found


def pairs(values: Sequence[str]) -> dict[str, str]:
    """Return the name-value pairs of `--start-values a 1 b 2`."""
    if len(values) % 2:
        raise TwipError(
            f"--start-values {' '.join(values)}: names and values must come in pairs, but {values[-1]} has no value"
        )
    twice = sorted({name for name in values[::2] if values[::2].count(name) > 1})
    if twice:
        raise TwipError(f"--start-values: {', '.join(twice)} is given more than once")
    return dict(zip(values[::2], values[1::2], strict=True))
