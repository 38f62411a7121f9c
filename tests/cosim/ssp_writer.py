"""Writes small systems for the tests: SSD and SSV text, and FMUs with an edited model description."""

import re
import zipfile
from pathlib import Path

from lxml import etree

SSP = "http://ssp-standard.org/SSP1/"
HEAD = (
    f'<ssd:SystemStructureDescription xmlns:ssd="{SSP}SystemStructureDescription"'
    f' xmlns:ssc="{SSP}SystemStructureCommon" xmlns:ssv="{SSP}SystemStructureParameterValues"'
)
TYPES = ("Real", "Integer", "Boolean", "String", "Float32", "Float64", "Int8", "UInt8", "Int16", "Binary")


def connector(name, kind, type_="Real", unit=None):
    if type_ is None or type_ in TYPES:
        inner = "" if type_ is None else f"<ssc:{type_}{f' unit={chr(34)}{unit}{chr(34)}' if unit else ''}/>"
    else:
        inner = f'<ssc:Enumeration name="{type_}"/>'
    return f'<ssd:Connector name="{name}" kind="{kind}">{inner}</ssd:Connector>'


def connectors(text):
    """Turn `u>:Real[rad] y<` into connectors: `>` input, `<` output, `*` parameter, `=` calculated
    parameter, `!` local, `~` inout; `:Type`, `[unit]` optional; in place of a type the name of an enumeration.
    """
    kinds = {">": "input", "<": "output", "*": "parameter", "=": "calculatedParameter", "!": "local", "~": "inout"}
    found = re.findall(r"([^\s<>*=!~]+)([<>*=!~])(?::(\w+))?(?:\[([^\]]+)\])?", text)
    items = "".join(
        connector(name, kinds[kind], type_ or None if not unit else "Real", unit) for name, kind, type_, unit in found
    )
    return f"<ssd:Connectors>{items}</ssd:Connectors>" if items else ""


def component(name, source, ports="", inside=""):
    return f'<ssd:Component name="{name}" source="{source}">{connectors(ports)}{inside}</ssd:Component>'


def signals(name, of, ports):
    """Return a reference to the signal dictionary `of`."""
    attributes = f'name="{name}" dictionary="{of}"'
    return f"<ssd:SignalDictionaryReference {attributes}>{connectors(ports)}</ssd:SignalDictionaryReference>"


def connection(text, inside="", **attributes):
    """Turn `a.u -> b.y` into a connection; a bare name is a connector of the system."""
    ends = []
    for side, end in zip(("start", "end"), text.split(" -> "), strict=True):
        element, _, name = end.rpartition(".")
        ends.append((f'{side}Element="{element}" ' if element else "") + f'{side}Connector="{name}"')
    more = "".join(f' {key}="{value}"' for key, value in attributes.items())
    return f"<ssd:Connection {ends[0]} {ends[1]}{more}>{inside}</ssd:Connection>"


def linear(factor=None, offset=None):
    given = {"factor": factor, "offset": offset}
    return "<ssc:LinearTransformation" + "".join(f' {k}="{v}"' for k, v in given.items() if v is not None) + "/>"


def mapping(kind, entries):
    """Return a `Boolean`, `Integer` or `Enumeration` mapping transformation."""
    items = "".join(f'<ssc:MapEntry source="{s}" target="{t}"/>' for s, t in entries.items())
    return f"<ssc:{kind}MappingTransformation>{items}</ssc:{kind}MappingTransformation>"


def enumerations(prefix="ssd", **items):
    """Return enumeration definitions: `Mode={"off": 0, "on": 1}`."""
    text = "".join(
        f'<ssc:Enumeration name="{name}">'
        + "".join(f'<ssc:Item name="{label}" value="{value}"/>' for label, value in values.items())
        + "</ssc:Enumeration>"
        for name, values in items.items()
    )
    return f"<{prefix}:Enumerations>{text}</{prefix}:Enumerations>"


def parameter_mapping(entries, version="1.0"):
    """Return an SSM element; entries are (source, target), (…, transformation) or (…, transformation, attributes)."""
    items = "".join(
        f'\n<ssm:MappingEntry source="{source}" target="{target}"{"".join(more[1:])}>{"".join(more[:1])}'
        "</ssm:MappingEntry>"
        for source, target, *more in entries
    )
    return (
        f'<ssm:ParameterMapping xmlns:ssm="{SSP}SystemStructureParameterMapping"'
        f' xmlns:ssc="{SSP}SystemStructureCommon" version="{version}">{items}</ssm:ParameterMapping>'
    )


def dictionary(entries, definitions="", version="1.0"):
    """Return an SSB element; entries are the type elements by name."""
    items = "".join(
        f'<ssb:DictionaryEntry name="{name}">{type_}</ssb:DictionaryEntry>' for name, type_ in entries.items()
    )
    return (
        f'<ssb:SignalDictionary xmlns:ssb="{SSP}SystemStructureSignalDictionary"'
        f' xmlns:ssc="{SSP}SystemStructureCommon" version="{version}">{items}{definitions}</ssb:SignalDictionary>'
    )


def system(elements, connections=(), ports="", inside="", name="root", dictionaries=None):
    """Return a system; `dictionaries` are the insides of signal dictionaries, or their files' names, by name."""
    lines = "\n".join(connections)
    wires = f"<ssd:Connections>\n{lines}\n</ssd:Connections>" if lines else ""
    parts = "\n".join(elements)
    kept = "".join(
        f'<ssd:SignalDictionary name="{n}">{content}</ssd:SignalDictionary>'
        if content.startswith("<")
        else f'<ssd:SignalDictionary name="{n}" source="{content}"/>'
        for n, content in (dictionaries or {}).items()
    )
    wires += f"<ssd:SignalDictionaries>{kept}</ssd:SignalDictionaries>" if kept else ""
    inner = f"{connectors(ports)}{inside}\n<ssd:Elements>\n{parts}\n</ssd:Elements>\n{wires}"
    return f'<ssd:System name="{name}">{inner}</ssd:System>'


def parameter_set(values, units=""):
    """Return an SSV element; values are (type, value) or (type, value, unit)."""
    items = []
    for name, (type_, value, *unit) in values.items():
        more = f' unit="{unit[0]}"' if unit else ""
        items.append(f'<ssv:Parameter name="{name}">\n<ssv:{type_} value="{value}"{more}/></ssv:Parameter>')
    return (
        f'<ssv:ParameterSet xmlns:ssv="{SSP}SystemStructureParameterValues" xmlns:ssc="{SSP}SystemStructureCommon"'
        f' version="1.0" name="values"><ssv:Parameters>\n{chr(10).join(items)}\n</ssv:Parameters>{units}'
        "</ssv:ParameterSet>"
    )


def bind(values=None, source=None, prefix=None, mapped=None, base=None):
    """Return a parameter binding; `mapped` is the inside of its `ParameterMapping` element, or that file's name."""
    given = {"source": source, "sourceBase": base, "prefix": prefix}
    attributes = "".join(f' {k}="{v}"' for k, v in given.items() if v is not None)
    inside = "" if values is None else f"<ssd:ParameterValues>{parameter_set(values)}</ssd:ParameterValues>"
    if mapped is not None and mapped.startswith("<"):
        inside += f"<ssd:ParameterMapping>{mapped}</ssd:ParameterMapping>"
    elif mapped is not None:
        inside += f'<ssd:ParameterMapping source="{mapped}"/>'
    binding = f"<ssd:ParameterBinding{attributes}>{inside}</ssd:ParameterBinding>"
    return f"<ssd:ParameterBindings>{binding}</ssd:ParameterBindings>"


def algorithm(attributes, mid_step=(), order=(), own_steps=()):
    """Return our annotation by which a file proposes how to run it; `own_steps` are pairs of component and size."""
    inputs = "".join(f'\n<t:MidStep input="{name}"/>' for name in mid_step)
    inputs += "".join(f'\n<t:Next component="{name}"/>' for name in order)
    inputs += "".join(f'\n<t:Step component="{name}" size="{size}"/>' for name, size in own_steps)
    item = f'<t:Algorithm xmlns:t="https://twip.example/ssp" {attributes}>{inputs}</t:Algorithm>'
    return f'<ssd:Annotations><ssc:Annotation type="org.twip.cosim">{item}</ssc:Annotation></ssd:Annotations>'


def units(text, prefix="ssd"):
    """Turn `deg rad=1 factor=0.0174; rad rad=1` into unit definitions."""
    items = []
    for unit in text.split(";"):
        name, *base = unit.split()
        attributes = " ".join(f'{k}="{v}"' for k, v in (item.split("=") for item in base))
        items.append(f'<ssc:Unit name="{name}"><ssc:BaseUnit {attributes}/></ssc:Unit>')
    return f"<{prefix}:Units>{''.join(items)}</{prefix}:Units>"


def write(
    folder: Path, body: str, *, tail='<ssd:DefaultExperiment startTime="0" stopTime="1"/>', version="1.0"
) -> Path:
    """Write an SSD next to which the FMUs lie; return its path."""
    path = folder / "SystemStructure.ssd"
    path.write_text(
        f'{HEAD} version="{version}" name="test">\n{body}\n{tail}\n</ssd:SystemStructureDescription>', encoding="utf-8"
    )
    return path


def pack(ssd: Path, target: Path, files: dict[str, Path]) -> Path:
    """Make an `.ssp` archive."""
    with zipfile.ZipFile(target, "w") as archive:
        archive.write(ssd, "SystemStructure.ssd")
        for name, file in files.items():
            archive.write(file, name)
    return target


def edit_fmu(
    source: Path,
    target: Path,
    *,
    variables=None,
    dependencies=None,
    definitions="",
    step_size=None,
    state=False,
    files=None,
    enums=None,
    no_output=(),
    rename=None,
) -> Path:
    """Copy an FMU with attributes added to its variables, dependencies (output to inputs), unit definitions, and files.

    With `state` it says that its state can be serialized, which every FMU of pythonfmu can do. `enums` turns Integer
    variables into enumerations: items by variable. `no_output` takes variables out of the list of outputs.
    `rename` gives variables other names, last of all.
    """
    with zipfile.ZipFile(source) as archive:
        contents = {entry: archive.read(entry) for entry in archive.namelist()}
    root = etree.fromstring(contents["modelDescription.xml"])
    scalars = {v.get("name"): v for v in root.iter("ScalarVariable")}
    index = {name: str(i) for i, name in enumerate(scalars, 1)}
    for name in enums or {}:
        scalars[name][0].tag = "Enumeration"
        scalars[name][0].set("declaredType", f"{name}_items")
    for name, attributes in (variables or {}).items():
        for key, value in attributes.items():
            (scalars[name] if key in ("causality", "variability", "initial") else scalars[name][0]).set(key, str(value))
    for unknown in list(root.iter("Unknown")):
        if list(scalars)[int(unknown.get("index")) - 1] in no_output and unknown.getparent().tag == "Outputs":
            unknown.getparent().remove(unknown)
            continue
        name = list(scalars)[int(unknown.get("index")) - 1]
        if name in (dependencies or {}):
            unknown.set("dependencies", " ".join(sorted((index[d] for d in dependencies[name]), key=int)))
    first = next(i for i, child in enumerate(root) if child.tag == "CoSimulation")
    if state:
        root[first].attrib.update({"canGetAndSetFMUstate": "true", "canSerializeFMUstate": "true"})
    if definitions:
        text = re.sub(r"ssc:", "", units(definitions, "x")).replace("x:Units", "UnitDefinitions")
        root.insert(first + 1, etree.fromstring(text))
    if enums:
        types = etree.Element("TypeDefinitions")
        for name, items in enums.items():
            declared = etree.SubElement(etree.SubElement(types, "SimpleType", name=f"{name}_items"), "Enumeration")
            for label, value in items.items():
                etree.SubElement(declared, "Item", name=label, value=str(value))
        root.insert(next(i for i, child in enumerate(root) if child.tag in ("LogCategories", "ModelVariables")), types)
    if step_size is not None:
        place = next(i for i, child in enumerate(root) if child.tag == "ModelVariables")
        root.insert(place, etree.Element("DefaultExperiment", stepSize=str(step_size)))
    for old, new in (rename or {}).items():
        scalars[old].set("name", new)
    contents["modelDescription.xml"] = etree.tostring(root)
    contents.update(files or {})
    with zipfile.ZipFile(target, "w") as archive:
        for entry, data in contents.items():
            archive.writestr(entry, data)
    return target


GAIN = "CosimGain.fmu"


def a_and_b(*connections, ports="", inside="", a_ports="u> k* y<", b_ports="u> k* y<", a=GAIN, b=GAIN):
    """Return a system of two gains."""
    return system([component("a", a, a_ports), component("b", b, b_ports)], connections, ports, inside)


def line_of(path, text):
    """Return the number of the first line with `text`."""
    return next(i for i, line in enumerate(path.read_text().splitlines(), 1) if text in line)


def proposing(attributes):
    """Return an experiment of 1 s with our annotation."""
    return f'<ssd:DefaultExperiment stopTime="1">{algorithm(attributes)}</ssd:DefaultExperiment>'
