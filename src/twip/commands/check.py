"""`twip check`: say what a system, an FMU or a parameter set is, and what is wrong with it."""

import argparse
from collections.abc import Sequence
from pathlib import Path

from ..cosim import Section, inspect_file, inspect_run
from ..errors import TwipError
from .parts.experiment import declare_experiment, load_system, request

DESCRIPTION = """\
examples:
  twip check ssp/twip.ssp
  twip check ssp/twip.ssp --scenario ssp/scenarios/bad_day.toml --parameters ssp/parameters/pid.ssv
  twip check ssp/twip.ssp --swap controller=other.fmu --swap-map controller=other.toml
  twip check fmus/motor.fmu
  twip check ssp/parameters/pid.ssv

Say what a system (.ssp, folder, .ssd), an FMU (.fmu, folder), a parameter set (.ssv), a parameter mapping (.ssm) or a
signal dictionary (.ssb) is, and everything that is wrong with it, without running any of its code. The status is 0 if
it would run with the same options, 1 if not. Time series and scenarios are checked with the system they are for."""


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.description = DESCRIPTION
    parser.add_argument("file", help="what to check")
    declare_experiment(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Print what there is to say, and return the exit status."""
    kind = Path(arguments.file).suffix.lower()
    if kind in (".toml", ".csv"):
        option = "--scenario" if kind == ".toml" else "--input-file"
        raise TwipError(
            f"{arguments.file} can be checked with its system only: twip check SYSTEM {option} {arguments.file}"
        )
    path = Path(arguments.file)
    found = inspect_file(path)
    if found is not None:
        _print(found.sections)
        if found.warnings or _is_fmu(path):
            _print_warnings(found.warnings)
        print("nothing is wrong")
        return 0
    with load_system(arguments.file, arguments) as system:
        found = inspect_run(system, request(arguments))
        _print(found.sections)
        _print_warnings(found.warnings)
    print("it would run")
    return 0


def _is_fmu(path: Path) -> bool:
    return path.suffix.lower() == ".fmu" or path.is_dir()


def _print(sections: Sequence[Section]) -> None:
    for section in sections:
        print(f"{section.title:<19} {section.text}")
        width = max([17, *(len(name) for name, _ in section.lines)])
        for name, text in section.lines:
            print(f"  {name:<{width}} {text}" if name else f"  {text}")


def _print_warnings(warnings: Sequence[str]) -> None:
    print(f"{'warnings':<19} {len(warnings) or 'none'}")
    for warning in warnings:
        print(f"  {warning}")
