"""Components that are systems themselves: another SSD, a package (.ssp), or a system of the same file by its id.

The referenced system stands in the place of the component; the component's parameter bindings come after those of the
system (SSP 1.0 section 5.2.3).
"""

import pathlib

from ..fmus.description import file_fingerprint
from ..model.experiment import Experiment
from ..reading.archive import Workspace, unpack
from ..reading.files import Location, read_file
from ..reading.problems import Problems
from ..reading.xml import Reader, name_of
from .elements import read_system
from .ssd import read_description
from .structure import DEFINITION, FMU, PACKAGE, ComponentElement, SystemElement

DEFAULT_SSD = "SystemStructure.ssd"
MAXIMUM_ELEMENTS = 10_000
"""Most elements that a system may have with all that it refers to."""
MAXIMUM_LEVELS = 200
"""Most systems within each other."""
Way = tuple[tuple[str, str], ...]
"""The systems that are being read within each other: identity, and name for messages."""


class References:
    """Puts the systems that components refer to in the components' places."""

    def __init__(self, workspace: Workspace, problems: Problems):
        self._workspace = workspace
        self._problems = problems
        self._unpacked: dict[str, pathlib.Path] = {}
        self._count = 0

    def expand(self, system: SystemElement, way: Way, level: int = 1) -> None:
        """Replace all components in `system` that are systems; `way` is what has been followed to get there."""
        if level > MAXIMUM_LEVELS:
            self._problems.add(f"there are more than {MAXIMUM_LEVELS} systems within each other", system.place)
            return
        for i, element in enumerate(system.elements):
            self._count += 1
            if self._count > MAXIMUM_ELEMENTS:
                if self._count == MAXIMUM_ELEMENTS + 1:
                    self._problems.add(f"the system has more than {MAXIMUM_ELEMENTS} elements", element.place)
                return
            if isinstance(element, SystemElement):
                self.expand(element, way, level + 1)
            elif isinstance(element, ComponentElement) and (element.type != FMU or element.source is None):
                found = self._system(element, way)
                if found is not None:
                    inner, further = found
                    self._take_place(inner, element)
                    system.elements[i] = inner
                    self.expand(inner, further, level + 1)

    def _system(self, element: ComponentElement, way: Way) -> tuple[SystemElement, Way] | None:
        if element.type not in (FMU, DEFINITION, PACKAGE):
            self._problems.add(f"component {element.name}: type {element.type} is not supported", element.place)
            return None
        if element.source is None:
            self._problems.warn(f"component {element.name} has no source: an empty system", element.place)
            return SystemElement(element.name, element.place, element.document, element.connectors, []), way
        if element.source.startswith("#"):
            return self._embedded(element, element.source[1:], way)
        location = element.document.location
        found = location.resolve(element.source, element.place, self._problems)
        if found is None:
            return None
        path, fragment = found
        name = location.beside(element.source.partition("#")[0])
        if not path.is_file() and not (element.type == PACKAGE and path.is_dir()):
            self._problems.add(f"{name} does not exist", element.place)
            return None
        if element.type == DEFINITION:
            if fragment:
                self._problems.add(f"source {element.source}: a fragment needs a package", element.place)
                return None
            return self._described(element, path, Location(path.parent, location.enclosure, name), str(path), way)
        folder = self._folder(path, name, element)
        if folder is None:
            return None
        ssd = fragment or DEFAULT_SSD
        inside = Location(folder, folder, f"{name}/{ssd}")
        if "/" in ssd or not (folder / ssd).is_file():
            self._problems.add(f"{name} holds no {ssd}", element.place)
            return None
        return self._described(element, folder / ssd, inside, f"{folder}/{ssd}", way)

    def _folder(self, path: pathlib.Path, name: str, element: ComponentElement) -> pathlib.Path | None:
        """Return the folder of a package, unpacked once for all packages of the same content."""
        if path.is_dir():
            return path
        content = file_fingerprint(path)
        if content not in self._unpacked:
            folder = self._workspace.folder("ssp")
            with self._problems.catch(element.place):
                unpack(path, folder, name)
                self._unpacked[content] = folder
        return self._unpacked.get(content)

    def _described(
        self, element: ComponentElement, ssd: pathlib.Path, location: Location, identity: str, way: Way
    ) -> tuple[SystemElement, Way] | None:
        further = self._follow(element, identity, location.name, way)
        root = None if further is None else read_file(ssd, location.name, self._problems, element.place)
        description = None if root is None else read_description(root, location, self._problems)
        if description is None or further is None:
            return None
        if description.experiment != Experiment(description.experiment.start_time, description.experiment.stop_time):
            self._problems.warn(f"{location.name}: what it proposes for a run is ignored in a system around it")
        return description.system, further

    def _embedded(self, element: ComponentElement, name: str, way: Way) -> tuple[SystemElement, Way] | None:
        document = element.document
        found = [e for e in document.root.iter("{*}*") if e.get("id") == name and name_of(e) == "System"]
        if len(found) != 1:
            count = "no" if not found else "more than one"
            self._problems.add(f"source #{name}: the file has {count} system with this id", element.place)
            return None
        identity = f"{document.location.folder}/{document.location.name}#{name}"
        further = self._follow(element, identity, f"#{name}", way)
        if further is None:
            return None
        return read_system(Reader(document.location.name, self._problems), found[0], document), further

    def _follow(self, element: ComponentElement, identity: str, name: str, way: Way) -> Way | None:
        names = [step[1] for step in way]
        if identity in [step[0] for step in way]:
            self._problems.add(
                f"component {element.name}: a system cannot contain itself: {' → '.join([*names, name])}", element.place
            )
            return None
        return *way, (identity, name)

    def _take_place(self, system: SystemElement, element: ComponentElement) -> None:
        """Give a system the name of the component, and its bindings; check the component's connectors."""
        own = {connector.name: connector for connector in system.connectors}
        for connector in element.connectors:
            inner = own.get(connector.name)
            label = f"connector {element.name}.{connector.name}"
            if inner is None:
                self._problems.add(f"{label}: the system it refers to has no such connector", connector.place)
            elif inner.kind != connector.kind:
                self._problems.add(f"{label}: is {connector.kind}, but {inner.kind} in the system", connector.place)
            elif connector.type.type is not None and connector.type != inner.type:
                self._problems.add(f"{label}: has another type or unit in the system it refers to", connector.place)
        system.name, system.place, system.source = element.name, element.place, element.source
        system.expected = frozenset(connector.name for connector in element.connectors)
        system.bindings += element.bindings
