"""The FMUs of a system's components, each file read once."""

import pathlib
from collections.abc import Mapping

from ..fmus.description import read_fmu
from ..model.fmu import Fmu
from ..reading.problems import Place, Problems
from ..reading.wording import did_you_mean
from .structure import DEFINITION, FMU, PACKAGE, ComponentElement


def read_fmus(
    components: Mapping[str, ComponentElement], swap: Mapping[str, pathlib.Path], problems: Problems
) -> dict[str, Fmu | None]:
    """Return the FMU of each component by dotted path, None where it is unusable; `swap` replaces some by others."""
    for name in sorted(swap.keys() - components.keys()):
        problems.add(f"there is no component {name} to swap{did_you_mean(name, components)}")
    known: dict[pathlib.Path, Fmu | None] = {}
    found: dict[str, Fmu | None] = {}
    for path, element in components.items():
        located = _locate(element, problems) if path not in swap else (swap[path].resolve(), str(swap[path]))
        if located is None:
            found[path] = None
            continue
        file, name = located
        if file not in known:
            place = Place(f"swap {path}") if path in swap else element.place
            known[file] = read_fmu(file, name, problems, place)
        found[path] = known[file]
    return found


def _locate(element: ComponentElement, problems: Problems) -> tuple[pathlib.Path, str] | None:
    """Return the file of a component, and how messages call it."""
    if not element.source or element.type != FMU:
        return None  # reported where it was read
    location = element.document.location
    resolved = location.resolve(element.source, element.place, problems)
    if resolved is None:
        return None
    if resolved[1]:
        problems.add(f"source {element.source}: an FMU has no fragment", element.place)
        return None
    kind = {".ssd": DEFINITION, ".ssp": PACKAGE}.get(resolved[0].suffix.lower())
    if kind is not None:
        problems.add(f"component {element.name}: {element.source} is a system: its type must be {kind}", element.place)
        return None
    return resolved[0], location.beside(element.source)
