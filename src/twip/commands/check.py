"""`twip check`: say what a system, an FMU or a parameter set is, and what is wrong with it."""

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path

from ..cosim.fmus.description import read_fmu
from ..cosim.overview import (
    Section,
    departures,
    dictionary_overview,
    fmu_overview,
    mapping_overview,
    set_overview,
    system_overview,
    weaknesses,
)
from ..cosim.reading.files import read_file
from ..cosim.reading.problems import Place, Problems
from ..cosim.reading.xml import Element
from ..cosim.run.preparation import prepare
from ..cosim.ssp.ssb import read_signal_dictionary
from ..cosim.ssp.ssm import read_parameter_mapping
from ..cosim.ssp.ssv import read_parameter_set
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
    if kind == ".fmu" or (path / "modelDescription.xml").is_file():
        return _check_fmu(path)
    if kind in _DOCUMENTS:
        return _check_document(path, _DOCUMENTS[kind])
    return _check_system(arguments)


def _check_fmu(path: Path) -> int:
    problems = Problems()
    fmu = read_fmu(path, path.name, problems, Place(str(path)))
    problems.raise_any()
    if fmu is not None:
        _print(fmu_overview(fmu))
        _print_warnings([*problems.warnings, *weaknesses(path)])
    print("nothing is wrong")
    return 0


def _check_document(path: Path, overview: Callable[[Element, str, Problems], list[Section]]) -> int:
    problems = Problems()
    root = read_file(path, path.name if path.is_file() else str(path), problems)
    sections = [] if root is None else overview(root, path.name, problems)
    problems.raise_any()
    _print(sections)
    if problems.warnings:
        _print_warnings(problems.warnings)
    print("nothing is wrong")
    return 0


def _of_set(root: Element, name: str, problems: Problems) -> list[Section]:
    found = read_parameter_set(root, name, problems)
    return [] if found is None else set_overview(name, found)


def _of_mapping(root: Element, name: str, problems: Problems) -> list[Section]:
    found = read_parameter_mapping(root, name, problems)
    return [] if found is None else mapping_overview(name, found)


def _of_dictionary(root: Element, name: str, problems: Problems) -> list[Section]:
    found = read_signal_dictionary(root, name, problems)
    return [] if found is None else dictionary_overview(name, found)


_DOCUMENTS = {".ssv": _of_set, ".ssm": _of_mapping, ".ssb": _of_dictionary}


def _check_system(arguments: argparse.Namespace) -> int:
    with load_system(arguments.file, arguments) as system:
        prepared = prepare(system, request(arguments))
        _print(system_overview(system, prepared.grid, prepared.coupling, prepared.scenario))
        _print_warnings([*system.warnings, *prepared.scenario.warnings, *departures(system)])
    print("it would run")
    return 0


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
