"""What there is to say of a run, an FMU or a file of parameters or signals, without running any code of an FMU."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from .fmus.description import read_fmu
from .model.system import System
from .overview import (
    Section,
    departures,
    dictionary_overview,
    fmu_overview,
    mapping_overview,
    set_overview,
    system_overview,
    weaknesses,
)
from .reading.files import read_file
from .reading.problems import Place, Problems
from .reading.xml import Element
from .run.preparation import Request, prepare
from .ssp.ssb import read_signal_dictionary
from .ssp.ssm import read_parameter_mapping
from .ssp.ssv import read_parameter_set


@dataclass(frozen=True)
class Overview:
    """What there is to say of something that could be used."""

    sections: Sequence[Section]
    warnings: Sequence[str]


def inspect_run(system: System, request: Request) -> Overview:
    """Say what a run of `system` would be. Raises `TwipError` with one line per problem."""
    prepared = prepare(system, request)
    sections = system_overview(system, prepared.grid, prepared.coupling, prepared.scenario)
    return Overview(sections, [*system.warnings, *prepared.scenario.warnings, *departures(system)])


def inspect_file(path: Path) -> Overview | None:
    """Say what an FMU (`.fmu` or unpacked), a parameter set, a parameter mapping or a signal dictionary holds.

    Returns None for anything else. Raises `TwipError` with one line per problem.
    """
    kind = path.suffix.lower()
    if kind == ".fmu" or (path / "modelDescription.xml").is_file():
        return _inspect_fmu(path)
    return _inspect_document(path, _DOCUMENTS[kind]) if kind in _DOCUMENTS else None


def _inspect_fmu(path: Path) -> Overview:
    problems = Problems()
    fmu = read_fmu(path, path.name, problems, Place(str(path)))
    problems.raise_any()
    return Overview([], []) if fmu is None else Overview(fmu_overview(fmu), [*problems.warnings, *weaknesses(path)])


def _inspect_document(path: Path, overview: Callable[[Element, str, Problems], list[Section]]) -> Overview:
    problems = Problems()
    root = read_file(path, path.name if path.is_file() else str(path), problems)
    sections = [] if root is None else overview(root, path.name, problems)
    problems.raise_any()
    return Overview(sections, problems.warnings)


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
