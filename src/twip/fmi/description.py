"""The model description of a block's FMU (modelDescription.xml, FMI 2.0.4, section 2.2)."""

from dataclasses import dataclass

from lxml import etree

from .declare import Block, Variable
from .messages import LOG_CATEGORIES
from .table import NATIVE_REFERENCE, exposed, unit_of
from .units import BASE_UNITS, UNITS

GENERATION_DATE = "2026-01-01T00:00:00Z"
"""The same for every build, so that the same source gives the same bytes."""

CAPABILITIES = {
    "needsExecutionTool": "true",  # a Python interpreter
    "canHandleVariableCommunicationStepSize": "true",
    "canInterpolateInputs": "false",
    "maxOutputDerivativeOrder": "0",
    "canRunAsynchronuously": "false",
    "canBeInstantiatedOnlyOncePerProcess": "false",
    "canNotUseMemoryManagementFunctions": "true",
    "canGetAndSetFMUstate": "true",
    "canSerializeFMUstate": "true",
    "providesDirectionalDerivative": "false",
}
"""What an instance can do, in the words of FMI."""

NATIVE_TOOL = "org.twip.native"
"""Name of the annotation by which a master may find C functions that do what fmi2SetReal (for inputs), fmi2DoStep and
fmi2GetReal do without entering Python; docs/native.md has the protocol.
"""


@dataclass(frozen=True)
class Origin:
    """Who made an FMU, under which terms, and with what."""

    author: str
    version: str
    license: str
    copyright: str
    tool: str


def model_description(block: Block, guid: str, origin: Origin) -> bytes:
    """Return the XML of a block that keeps the rules of `rules.py`."""
    root = etree.Element(
        "fmiModelDescription",
        {
            "fmiVersion": "2.0",
            "modelName": block.name,
            "guid": guid,
            "description": block.description,
            "author": origin.author,
            "version": origin.version,
            "copyright": origin.copyright,
            "license": origin.license,
            "generationTool": origin.tool,
            "generationDateAndTime": GENERATION_DATE,
            "variableNamingConvention": "structured",
            "numberOfEventIndicators": "0",
        },
    )
    etree.SubElement(root, "CoSimulation", {"modelIdentifier": block.name, **CAPABILITIES})
    variables = exposed(block)
    _add_units(root, variables)
    categories = etree.SubElement(root, "LogCategories")
    for name, meaning in LOG_CATEGORIES.items():
        etree.SubElement(categories, "Category", {"name": name, "description": meaning})
    etree.SubElement(
        root,
        "DefaultExperiment",
        {"startTime": "0.0", "stopTime": repr(block.stop_time), "stepSize": repr(block.step_size)},
    )
    tool = etree.SubElement(etree.SubElement(root, "VendorAnnotations"), "Tool", {"name": NATIVE_TOOL})
    etree.SubElement(tool, "NativeFunctions", {"valueReference": str(NATIVE_REFERENCE)})
    model_variables = etree.SubElement(root, "ModelVariables")
    for reference, variable in enumerate(variables):
        _add_variable(model_variables, reference, variable)
    _add_structure(root, variables)
    etree.indent(root)
    xml: bytes = etree.tostring(root, xml_declaration=True, encoding="UTF-8")
    return xml + b"\n"


def _add_units(root: etree._Element, variables: tuple[Variable, ...]) -> None:
    used = {unit_of(v) for v in variables}
    names = [name for name in UNITS if name in used]
    if not names:
        return
    definitions = etree.SubElement(root, "UnitDefinitions")
    for name in names:
        unit = etree.SubElement(definitions, "Unit", {"name": name})
        exponents = UNITS[name].exponents
        if exponents is not None:
            etree.SubElement(unit, "BaseUnit", {b: str(exponents[b]) for b in BASE_UNITS if exponents.get(b)})
        for display, factor in UNITS[name].display.items():
            etree.SubElement(unit, "DisplayUnit", {"name": display, "factor": repr(factor)})


def _add_variable(parent: etree._Element, reference: int, v: Variable) -> None:
    attributes = {
        "name": v.name,
        "valueReference": str(reference),
        "description": v.description,
        "causality": v.causality,
        "variability": v.variability,
    }
    if v.causality == "parameter":
        attributes["initial"] = "exact"
    elif v.causality != "input":
        attributes["initial"] = "calculated"
    element = etree.SubElement(parent, "ScalarVariable", attributes)
    details = {"unit": unit_of(v), "displayUnit": v.display_unit} if v.type == "Real" else {}
    numbers = {"min": v.minimum, "max": v.maximum, "nominal": v.nominal, "start": v.start}
    if v.type == "Boolean":
        numbers = {"start": v.start}
    details |= {name: _text(v.type, x) for name, x in numbers.items() if x is not None}
    etree.SubElement(element, v.type, {name: text for name, text in details.items() if text is not None})


def _text(kind: str, value: float) -> str:
    """Return a number as FMI writes it in a variable of type `kind`, exactly."""
    if kind == "Boolean":
        return "true" if value else "false"
    return str(int(value)) if kind == "Integer" else repr(float(value))


def _add_structure(root: etree._Element, variables: tuple[Variable, ...]) -> None:
    """Write what each output depends on: inputs as declared, at initialization the parameters too."""
    index = {v.name: i for i, v in enumerate(variables, start=1)}
    parameters = [index[v.name] for v in variables if v.causality == "parameter"]
    structure = etree.SubElement(root, "ModelStructure")
    outputs = etree.SubElement(structure, "Outputs")
    initial = etree.SubElement(structure, "InitialUnknowns")
    for v in variables:
        if v.causality == "output":
            inputs = [index[d] for d in v.depends]
            _add_unknown(outputs, index[v.name], inputs)
            _add_unknown(initial, index[v.name], inputs + parameters + [index[d] for d in v.initially])


def _add_unknown(parent: etree._Element, index: int, knowns: list[int]) -> None:
    indices = sorted(set(knowns))
    attributes = {"index": str(index), "dependencies": " ".join(map(str, indices))}
    attributes["dependenciesKind"] = " ".join("dependent" for _ in indices)
    etree.SubElement(parent, "Unknown", attributes)
