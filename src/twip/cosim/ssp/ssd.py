"""System structure descriptions (`.ssd`) of SSP 1.0 and 2.0: the file as plain data, nothing resolved yet."""

from dataclasses import dataclass

from ..model.algorithm import Algorithm
from ..model.experiment import Experiment
from ..reading.files import Location
from ..reading.problems import Problems
from ..reading.xml import ANNOTATION, METADATA_ATTRIBUTES, Element, Reader
from .algorithm_annotation import read_algorithm, read_step_size
from .elements import read_system
from .schemas import opened
from .structure import Document, SystemElement
from .type_elements import read_enumerations
from .unit_definitions import read_units


@dataclass(frozen=True)
class Description:
    """A whole system structure description."""

    name: str
    system: SystemElement
    document: Document
    experiment: Experiment


def read_description(root: Element, location: Location, problems: Problems) -> Description | None:
    """Turn the XML of an SSD into data; None when it cannot be one. What it says and nobody here reads is a problem."""
    reader = opened(root, "SystemStructureDescription", location.name, problems)
    if reader is None:
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
    start = stop = step = None
    algorithm = Algorithm()
    hosts = [root, top]
    if experiment is not None:
        hosts.insert(0, experiment)
        reader.leaf(experiment, {"startTime", "stopTime"})
        start, stop = reader.number(experiment, "startTime"), reader.number(experiment, "stopTime")
    known = [reader.child(host, "Annotations") for host in hosts]
    for annotation in root.iter("{*}Annotation"):
        if annotation.get("type") != ANNOTATION:
            continue
        if annotation.getparent() not in known:
            reader.problems.add(f"annotation {ANNOTATION} has no meaning here", reader.place(annotation))
        step = read_step_size(reader, annotation, step)
        algorithm = read_algorithm(reader, annotation, algorithm)
    return Experiment(start, stop, step, algorithm)
