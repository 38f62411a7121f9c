"""Parameter mappings (`.ssm`) of SSP 1.0 and 2.0."""

from dataclasses import dataclass

from ..reading.problems import Place, Problems
from ..reading.xml import METADATA_ATTRIBUTES, Element
from ..values.transformation import TRANSFORMATIONS, Transformation, read_transformation
from .schemas import opened


@dataclass(frozen=True)
class MappingEntry:
    """One parameter of a set (`source`, with the prefix of the binding) that becomes the parameter `target`."""

    source: str
    target: str
    suppress_unit_conversion: bool
    transformation: Transformation | None
    place: Place


@dataclass(frozen=True)
class ParameterMapping:
    """A parameter mapping: what it does not name is not applied."""

    entries: tuple[MappingEntry, ...]


def read_parameter_mapping(root: Element, file: str, problems: Problems) -> ParameterMapping | None:
    """Read a `ParameterMapping` element that stands alone or inside an SSD; None when it is invalid."""
    reader = opened(root, "ParameterMapping", file, problems)
    if reader is None:
        return None
    reader.attributes(root, {"version", *METADATA_ATTRIBUTES})
    entries: dict[str, MappingEntry] = {}
    for element in reader.children(root, {"MappingEntry"}):
        reader.attributes(element, {"source", "target", "suppressUnitConversion"})
        transformation = None
        for item in reader.children(element, TRANSFORMATIONS):
            if transformation is not None:
                problems.add("a mapping entry has more than one transformation", reader.place(item))
            transformation = read_transformation(reader, item)
        entry = MappingEntry(
            reader.required(element, "source"),
            reader.required(element, "target"),
            reader.boolean(element, "suppressUnitConversion"),
            transformation,
            reader.place(element),
        )
        if entry.target in entries:
            problems.add(f"two parameters are mapped to {entry.target}", entry.place)
        entries[entry.target] = entry
    return ParameterMapping(tuple(entries.values()))
