"""Reads a system structure, checks all of it, and returns a `System` or every problem at once."""

import pathlib
import zipfile
from collections.abc import Mapping, Sequence

from ..errors import AbsentFileError, TwipError
from .fmus.description import file_fingerprint
from .model.system import System, cannot_share_a_process
from .reading.archive import Workspace, unpack
from .reading.arguments import PathLike, Paths, by_name, paths
from .reading.files import Location, is_special, read_file
from .reading.problems import Problems
from .ssp.arrays import expand_arrays
from .ssp.assembly import assemble
from .ssp.broken_description import check_files
from .ssp.component_fmus import read_fmus
from .ssp.duplicate_paths import tell_apart
from .ssp.file_kinds import SYSTEM, why_no_system
from .ssp.parametrization import parametrize
from .ssp.references import DEFAULT_SSD, References
from .ssp.ssd import read_description
from .ssp.ssv import read_parameter_file
from .ssp.structure import components_of
from .ssp.wiring import wire
from .swap.swap_map import read_swap_map
from .swap.swaps import Swaps
from .values.written import Value


def load(
    path: PathLike,
    *,
    ssd: str | None = None,
    parameters: Paths = (),
    start_values: Mapping[str, Value] | None = None,
    swap: Mapping[str, PathLike] | None = None,
    swap_map: Mapping[str, PathLike] | None = None,
) -> System:
    """Read and check a system, without running code of any FMU.

    `path` is a `.ssp` archive, an unpacked folder or a bare `.ssd`. `ssd` names one of several descriptions in an
    archive or folder; the default is `SystemStructure.ssd`. `parameters` are further parameter sets (`.ssv`), or one,
    that address `component.variable`; `start_values` do so too and win over them. `swap` replaces the FMU of a
    component by another file, which must fit; `swap_map` names a file by component that says how names and units differ
    (docs/swapping.md). Raises `TwipError` with one line per problem, `AbsentFileError` where
    there is nothing at `path`.
    """
    system, problems = _load(pathlib.Path(path), ssd, parameters, start_values, swap, swap_map)
    problems.raise_any()
    if system is None:
        raise TwipError(f"{path}: cannot be loaded")
    return system


def check(
    path: PathLike,
    *,
    ssd: str | None = None,
    parameters: Paths = (),
    start_values: Mapping[str, Value] | None = None,
    swap: Mapping[str, PathLike] | None = None,
    swap_map: Mapping[str, PathLike] | None = None,
) -> list[str]:
    """Return the problems that `load` would raise, one line each, and whether the FMUs can share a process.

    Times, coupling and scenario of a run are checked by `simulate` before anything is instantiated.
    """
    system, problems = _load(pathlib.Path(path), ssd, parameters, start_values, swap, swap_map)
    return problems.lines + ([] if system is None else cannot_share_a_process(system))


def _load(
    path: pathlib.Path,
    ssd: str | None,
    parameters: Paths,
    start_values: Mapping[str, Value] | None,
    swap: Mapping[str, PathLike] | None,
    swap_map: Mapping[str, PathLike] | None,
) -> tuple[System | None, Problems]:
    problems = Problems()
    workspace = Workspace()
    files = [pathlib.Path(p) for p in paths(parameters)]
    others = {name: pathlib.Path(file) for name, file in by_name("swap", swap).items()}
    map_files = by_name("swap_map", swap_map)
    values = by_name("start_values", start_values)
    maps = {name: read_swap_map(pathlib.Path(file), problems) for name, file in map_files.items()}
    located = None
    with problems.catch():
        located = _locate(path, ssd, workspace)
    if located is None:
        return None, _with_files(problems, files)
    file, enclosure = located
    root = read_file(file, file.name, problems)
    location = Location(file.parent, enclosure, file.name)
    description = None if root is None else read_description(root, location, problems)
    if description is None:
        if root is not None:
            check_files(root, location, others, problems)
        return None, _with_files(problems, files)
    sources = {"system": {"file": path.name, "name": description.name}}
    if path.is_file():
        sources["system"]["sha256"] = file_fingerprint(path)
    if ssd is not None:
        sources["system"]["ssd"] = file.name
    top = description.system
    References(workspace, problems).expand(top, ((str(file.resolve()), file.name),))
    duplicates = tell_apart(top, problems)
    components = components_of(top)
    if not components:
        problems.add(f"system {top.name} has no components", top.place)
    swaps = Swaps(top, components, others, maps, problems)
    fmus = swaps.fit(read_fmus(components, others, problems), sources)
    expand_arrays(top, fmus, problems)
    wiring = wire(top, fmus, components, problems)
    swaps.refuse_loops(wiring, fmus)
    sound = not problems
    assignments = parametrize(top, fmus, wiring, files, values, sources, problems, swaps.variables, duplicates)
    system = assemble(description, fmus, wiring, assignments, sources, problems, workspace) if sound else None
    return system, problems


def _with_files(problems: Problems, files: Sequence[pathlib.Path]) -> Problems:
    """Add what is wrong with the caller's parameter files by themselves, where there is no system to apply them to."""
    for file in files:
        read_parameter_file(file, file.name if file.is_file() else str(file), problems)
    return problems


def _locate(path: pathlib.Path, ssd: str | None, workspace: Workspace) -> tuple[pathlib.Path, pathlib.Path | None]:
    """Return the SSD, and the folder of the unpacked archive that it may not refer out of, if it is in one."""
    if not path.exists():
        raise AbsentFileError(f"{path}: no such file", path=path)
    if is_special(path):
        raise TwipError(f"{path} is a device or the like, not a file")
    if why := why_no_system(path):
        raise TwipError(why)
    if path.is_dir():
        return _choose(path, ssd, f"{path}: the folder"), None
    if path.suffix.lower() == ".ssd":
        if ssd is not None:
            raise TwipError(f"{path} is one description: {ssd} cannot be chosen in it")
        return path, None
    if not zipfile.is_zipfile(path):
        raise TwipError(f"{path}: not a readable zip archive; {SYSTEM}")
    folder = workspace.folder("ssp")
    unpack(path, folder, str(path))
    return _choose(folder, ssd, f"{path}: the archive"), folder


def _choose(folder: pathlib.Path, ssd: str | None, what: str) -> pathlib.Path:
    """Return the description called `ssd` (with or without extension), else the default one."""
    there = sorted(file.name for file in folder.glob("*.ssd") if file.is_file())
    name = DEFAULT_SSD if ssd is None else ssd if ssd in there else f"{ssd}.ssd"
    if name in there:
        return folder / name
    known = "" if ssd is None else f", only {', '.join(there) or 'no .ssd at all'}"
    inside = sorted(file.relative_to(folder).as_posix() for file in folder.glob(f"*/{name}"))
    if inside and not there:
        known = f", only {inside[0]}: what is in that folder belongs directly into it"
    raise TwipError(f"{what} holds no {DEFAULT_SSD if ssd is None else ssd}{known}")
