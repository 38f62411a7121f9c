"""What can be said of the files that a description names when the description itself is invalid.

Its own mistakes have been told; what is read of it here serves to find the FMUs, parameter sets and mappings, each of
which is wrong or not by itself.
"""

import pathlib
from collections.abc import Callable, Mapping

from ..reading.files import Location
from ..reading.problems import Problems
from ..reading.xml import Element, Reader
from .bindings import find
from .component_fmus import read_fmus
from .elements import read_system
from .ssm import read_parameter_mapping
from .ssv import read_parameter_set
from .structure import Document, Outside, components_of, systems_of


def check_files(root: Element, location: Location, swap: Mapping[str, pathlib.Path], problems: Problems) -> None:
    """Report what is wrong with the files that an invalid description names; `swap` replaces some FMUs by others."""
    told = Problems()
    reader = Reader(location.name, told)
    top = reader.child(root, "System")
    if top is None:
        return
    document = Document(location, {}, {}, root)
    system = read_system(reader, top, document)
    components = components_of(system)
    read_fmus(components, {name: file for name, file in swap.items() if name in components}, problems)
    bindings = [binding for element in components.values() for binding in element.bindings]
    bindings += [binding for element in systems_of(system).values() for binding in element.bindings]
    for binding in bindings:
        _check(binding.values, read_parameter_set, document, problems)
        _check(binding.mapping, read_parameter_mapping, document, problems)


def _check(
    outside: Outside | None, read: Callable[[Element, str, Problems], object], document: Document, problems: Problems
) -> None:
    """Report what is wrong with a file beside the description."""
    if outside is None or outside.source is None or outside.in_component:
        return
    found = find(outside, document, None, problems)
    if found is not None:
        read(*found, problems)
