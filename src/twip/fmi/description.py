"""The model description of an FMU (modelDescription.xml), as far as FMI 2.0 and FMI 3.0 write it alike."""

import copy
from dataclasses import dataclass

from lxml import etree

from .description_fmi2 import add_variables_and_structure as add_fmi2
from .description_fmi2 import co_simulation as co_simulation_fmi2
from .description_fmi3 import add_variables_and_structure as add_fmi3
from .description_fmi3 import co_simulation as co_simulation_fmi3
from .interface import Interface
from .table import NATIVE_REFERENCE

GENERATION_DATE = "2026-01-01T00:00:00Z"
"""The same for every build, so that the same source gives the same bytes."""

NATIVE_TOOL = "org.twip.native"
"""Name of the annotation by which a master may find the values in memory and the compiled step; the protocol is in
docs/native_functions.md.
"""


@dataclass(frozen=True)
class Origin:
    """Who made an FMU, under which terms, and with what."""

    author: str
    version: str
    license: str
    copyright: str
    tool: str


def model_description(interface: Interface, version: str, token: str, origin: Origin) -> bytes:
    """Return the XML in FMI `version`; `token` is FMI 2.0's GUID or FMI 3.0's instantiation token."""
    two = version == "2.0"
    root = etree.Element(
        "fmiModelDescription",
        {
            "fmiVersion": version,
            "modelName": interface.name,
            "guid" if two else "instantiationToken": token,
            "description": interface.description,
            "author": origin.author,
            "version": origin.version,
            "copyright": origin.copyright,
            "license": origin.license,
            "generationTool": origin.tool,
            "generationDateAndTime": GENERATION_DATE,
            "variableNamingConvention": "structured",
        },
    )
    if two:
        root.set("numberOfEventIndicators", "0")
    abilities = co_simulation_fmi2 if two else co_simulation_fmi3
    co_simulation = etree.SubElement(
        root, "CoSimulation", {"modelIdentifier": interface.identifier, **abilities(interface.capabilities)}
    )
    if two and interface.sources:
        files = etree.SubElement(co_simulation, "SourceFiles")
        for name in interface.sources:
            etree.SubElement(files, "File", {"name": name})
    if interface.units:
        definitions = etree.SubElement(root, "UnitDefinitions")
        definitions.extend(copy.deepcopy(unit) for unit in interface.units)
    categories = etree.SubElement(root, "LogCategories")
    for name, meaning in interface.categories.items():
        etree.SubElement(categories, "Category", {"name": name, "description": meaning})
    etree.SubElement(
        root,
        "DefaultExperiment",
        {"startTime": "0.0", "stopTime": repr(interface.stop_time), "stepSize": repr(interface.step_size)},
    )
    native = etree.Element("NativeFunctions", {"valueReference": str(NATIVE_REFERENCE)})
    if two and interface.native:
        etree.SubElement(etree.SubElement(root, "VendorAnnotations"), "Tool", {"name": NATIVE_TOOL}).append(native)
    (add_fmi2 if two else add_fmi3)(root, interface)
    if not two and interface.native:
        etree.SubElement(etree.SubElement(root, "Annotations"), "Annotation", {"type": NATIVE_TOOL}).append(native)
    etree.indent(root)
    xml: bytes = etree.tostring(root, xml_declaration=True, encoding="UTF-8")
    return xml + b"\n"
