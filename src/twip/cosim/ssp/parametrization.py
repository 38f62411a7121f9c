"""Applies all parameters and start values of a system in their order of precedence.

Lowest first: bindings of components, of inner systems, of the outermost system (each in the order of the file; SSP 1.0
section 5.2.3), connections from parameters of inner systems, of the outermost system and from constants, parameter
files of the caller in their order, start values of the caller. The standard ranks bindings among each other; what is
connected takes its value from the connection wherever a binding for it stands.
"""

import pathlib
from collections.abc import Mapping, Sequence

from ..fmus.description import file_fingerprint
from ..model.fmu import Fmu
from ..reading.problems import Problems
from ..values.names import Key
from ..values.variable import Variable
from ..values.written import Value
from .bindings import fetch
from .duplicate_paths import DuplicatePaths
from .parameter_sets import apply_set
from .parameters import Assignments, Scope
from .ssv import read_parameter_file
from .structure import Binding, ComponentElement, SystemElement, components_of, systems_of
from .wiring import Wiring

Sources = dict[str, dict[str, str]]


def parametrize(
    system: SystemElement,
    fmus: Mapping[str, Fmu | None],
    wiring: Wiring,
    files: Sequence[pathlib.Path],
    start_values: Mapping[str, Value],
    sources: Sources,
    problems: Problems,
    before: Mapping[Key, Variable],
    duplicates: DuplicatePaths,
) -> Assignments:
    """Return what every variable is set to; the files that values come from are entered in `sources`.

    `before` are the variables that values in the description were written for, where others have taken their places.
    """
    usable = {path: fmu for path, fmu in fmus.items() if fmu is not None}
    assignments = Assignments(
        wiring=wiring,
        problems=problems,
        fmus=usable,
        before=before,
        duplicates=duplicates,
        unreadable=fmus.keys() - usable.keys(),
    )
    scopes: list[tuple[str, ComponentElement | SystemElement]] = [*components_of(system).items()]
    scopes += reversed(systems_of(system).items())  # inner systems before the ones around them
    for path, element in scopes:
        base = usable[path].path if path in usable else _folder(element)  # of an unreadable FMU there is none
        for binding in element.bindings:
            parameters, mapping, whole = fetch(binding, base, problems)
            _note_files(binding, sources)
            if parameters is not None and whole:
                scope = Scope(path, binding.prefix, binding.document.units)
                apply_set(assignments, parameters, scope, mapping)
    assignments.apply_connections()
    assignments.apply_constants()
    for file in files:
        given = read_parameter_file(file, file.name if file.is_file() else str(file), problems)
        if given is not None:
            sources[f"parameters {file.name}"] = {"file": str(file), "sha256": file_fingerprint(file)}
            apply_set(assignments, given, Scope("", "", {}, from_caller=True))
    assignments.apply_values(start_values)
    if assignments.unchecked:
        names = ", ".join(assignments.unchecked)
        problems.add(f"values of {names} were not checked: the FMU cannot be read")
    if start_values:
        sources["start values"] = {name: str(value) for name, value in start_values.items()}
    assignments.check()
    return assignments


def _folder(element: ComponentElement | SystemElement) -> pathlib.Path | None:
    """Return the folder of the description that a system comes from, if a component refers to it."""
    described = isinstance(element, SystemElement) and element.source is not None
    return element.document.location.folder if described else None


def _note_files(binding: Binding, sources: Sources) -> None:
    for outside in (binding.values, binding.mapping):
        if outside is None or outside.source is None or outside.in_component:
            continue
        found = binding.document.location.resolve(outside.source, outside.place, Problems())
        if found is not None and found[0].is_file():
            name = binding.document.location.beside(outside.source)
            sources[f"parameters {name}"] = {"file": outside.source, "sha256": file_fingerprint(found[0])}
