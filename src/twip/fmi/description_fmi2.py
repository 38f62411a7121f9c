"""Variables, structure and capabilities as FMI 2.0 writes them (FMI 2.0.4, sections 2.2.7, 2.2.8 and 4.3.1)."""

from lxml import etree

from .description_variable import common_attributes, knowns, typed_attributes
from .interface import Capabilities, Interface


def co_simulation(abilities: Capabilities) -> dict[str, str]:
    """Return the attributes of `CoSimulation`."""
    flags = {
        "needsExecutionTool": abilities.needs_execution_tool,
        "canHandleVariableCommunicationStepSize": abilities.variable_step,
        "canInterpolateInputs": False,
        "maxOutputDerivativeOrder": 0,
        "canRunAsynchronuously": False,
        "canBeInstantiatedOnlyOncePerProcess": abilities.only_once,
        "canNotUseMemoryManagementFunctions": not abilities.host_memory,
        "canGetAndSetFMUstate": abilities.state,
        "canSerializeFMUstate": abilities.state,
        "providesDirectionalDerivative": False,
    }
    return {name: str(value).lower() for name, value in flags.items()}


def add_variables_and_structure(root: etree._Element, interface: Interface) -> None:
    """Add `ModelVariables` and `ModelStructure`; what an output depends on is given by index, counted from 1."""
    variables = etree.SubElement(root, "ModelVariables")
    references = interface.references
    for v in interface.variables:
        scalar = etree.SubElement(variables, "ScalarVariable", common_attributes(v, references[v.name]))
        etree.SubElement(scalar, v.type, typed_attributes(v))
    index = {v.name: i for i, v in enumerate(interface.variables, start=1)}
    structure = etree.SubElement(root, "ModelStructure")
    outputs = etree.SubElement(structure, "Outputs")
    initial = etree.SubElement(structure, "InitialUnknowns")
    for name, (in_step, at_start) in knowns(interface).items():
        for parent, names in ((outputs, in_step), (initial, at_start)):
            attributes = {"index": str(index[name])}
            if names is not None:
                indices = sorted({index[n] for n in names})
                attributes["dependencies"] = " ".join(map(str, indices))
                attributes["dependenciesKind"] = " ".join("dependent" for _ in indices)
            etree.SubElement(parent, "Unknown", attributes)
