"""Variables, structure and capabilities as FMI 3.0 writes them (FMI 3.0.1, sections 2.4.7, 2.4.8 and 4.3.1)."""

from lxml import etree

from .description_variable import common_attributes, knowns, typed_attributes
from .interface import Capabilities, Interface

ELEMENT = {"Real": "Float64", "Integer": "Int32", "Boolean": "Boolean"}
"""FMI 3.0's names of FMI 2.0's types."""


def co_simulation(abilities: Capabilities) -> dict[str, str]:
    """Return the attributes of `CoSimulation`; what is false is the default and left out."""
    flags = {
        "needsExecutionTool": abilities.needs_execution_tool,
        "canBeInstantiatedOnlyOncePerProcess": abilities.only_once,
        "canGetAndSetFMUState": abilities.state,
        "canSerializeFMUState": abilities.state,
        "canHandleVariableCommunicationStepSize": abilities.variable_step,
    }
    attributes = {name: "true" for name, value in flags.items() if value}
    if abilities.fixed_step is not None:
        attributes["fixedInternalStepSize"] = repr(abilities.fixed_step)
    return attributes


def add_variables_and_structure(root: etree._Element, interface: Interface) -> None:
    """Add `ModelVariables`, time among them, and `ModelStructure`; dependencies are given by value reference."""
    variables = etree.SubElement(root, "ModelVariables")
    references = interface.references
    time = {
        "name": "time",
        "valueReference": str(interface.time_reference),
        "description": "simulated time",
        "causality": "independent",
        "variability": "continuous",
    }
    if not any(unit.get("name") == "s" for unit in interface.units):
        etree.SubElement(variables, "Float64", time)
    else:
        etree.SubElement(variables, "Float64", {**time, "unit": "s"})
    for v in interface.variables:
        etree.SubElement(
            variables, ELEMENT[v.type], {**common_attributes(v, references[v.name]), **typed_attributes(v)}
        )
    structure = etree.SubElement(root, "ModelStructure")
    dependencies = knowns(interface)
    for element, moment in (("Output", 0), ("InitialUnknown", 1)):
        for name, names in ((n, pair[moment]) for n, pair in dependencies.items()):
            attributes = {"valueReference": str(references[name])}
            if names is not None:
                known = sorted({references[n] for n in names})
                attributes["dependencies"] = " ".join(map(str, known))
                attributes["dependenciesKind"] = " ".join("dependent" for _ in known)
            etree.SubElement(structure, element, attributes)
