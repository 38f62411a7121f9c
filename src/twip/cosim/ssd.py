"""System structure descriptions (`.ssd`) of SSP 1.0 and 2.0: the file as plain data, nothing resolved yet."""

from dataclasses import dataclass

from .document import ANNOTATION, METADATA_ATTRIBUTES, Element, Reader, name_of
from .elements import read_system
from .problems import Place, Problems
from .schemas import valid
from .source import Location
from .structure import Document, SystemElement
from .units import read_units
from .value_types import read_enumerations

COUPLINGS = ("jacobi", "gauss-seidel")


@dataclass(frozen=True)
class Experiment:
    """What a file proposes for a run; None where it says nothing."""

    start_time: float | None = None
    stop_time: float | None = None
    step_size: float | None = None
    coupling: str | None = None
    mid_step: tuple[tuple[str, Place], ...] = ()
    """Inputs (`component.variable`) that are to be taken at the middle of a step."""


@dataclass(frozen=True)
class Description:
    """A whole system structure description."""

    name: str
    system: SystemElement
    document: Document
    experiment: Experiment


def read_description(root: Element, location: Location, problems: Problems) -> Description | None:
    """Turn the XML of an SSD into data; None when it cannot be one. What it says and nobody here reads is a problem."""
    reader = Reader(location.name, problems)
    if name_of(root) != "SystemStructureDescription":
        problems.add(f"expected a SystemStructureDescription, found {name_of(root)}", reader.place(root))
        return None
    if not valid(root, "SystemStructureDescription", location.name, problems):
        return None
    reader.attributes(root, {"version", "name", *METADATA_ATTRIBUTES})
    for _ in reader.children(root, {"System"}, {"Enumerations", "Units", "DefaultExperiment"}):
        pass
    top = reader.child(root, "System")
    if top is None:
        problems.add("the description has no System", reader.place(root))
        return None
    document = Document(location, read_units(reader, root), read_enumerations(reader, root), root)
    system = read_system(reader, top, document)
    return Description(root.get("name", system.name), system, document, _read_experiment(reader, root, top))


def _read_experiment(reader: Reader, root: Element, top: Element) -> Experiment:
    experiment = reader.child(root, "DefaultExperiment")
    start = stop = step = coupling = None
    mid_step: list[tuple[str, Place]] = []
    hosts = [root, top]
    if experiment is not None:
        hosts.insert(0, experiment)
        reader.attributes(experiment, {"startTime", "stopTime"})
        start, stop = reader.number(experiment, "startTime"), reader.number(experiment, "stopTime")
    known = [reader.child(host, "Annotations") for host in hosts]
    for annotation in root.iter("{*}Annotation"):
        if annotation.get("type") != ANNOTATION:
            continue
        if annotation.getparent() not in known:
            reader.problems.add(f"annotation {ANNOTATION} has no meaning here", reader.place(annotation))
        for item in annotation.iterchildren("{*}*"):
            if item.tag.rpartition("}")[2] != "Algorithm":
                reader.problems.add(f"{item.tag} in annotation {ANNOTATION} is not supported", reader.place(item))
                continue
            reader.attributes(item, {"coupling", "stepSize"})
            step = reader.number(item, "stepSize", step)
            coupling = item.get("coupling", coupling)
            if coupling is not None and coupling not in COUPLINGS:
                reader.problems.add(f"coupling {coupling!r} must be one of {', '.join(COUPLINGS)}", reader.place(item))
            for child in item.iterchildren("{*}*"):
                if child.tag.rpartition("}")[2] != "MidStep":
                    reader.problems.add(f"{child.tag} in Algorithm is not supported", reader.place(child))
                    continue
                reader.attributes(child, {"input"})
                mid_step.append((reader.required(child, "input"), reader.place(child)))
    return Experiment(start, stop, step, coupling, tuple(mid_step))
