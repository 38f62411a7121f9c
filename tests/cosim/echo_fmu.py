"""Makes the FMUs of `c/` with the system compiler: `echo2.fmu` (FMI 2.0) and `echo3.fmu` (FMI 3.0)."""

import subprocess
import zipfile
from pathlib import Path

import fmpy

HERE = Path(__file__).parent / "c"
HEADERS = Path(fmpy.__file__).parent / "c-code"
TYPES = (
    "Float64",
    "Float32",
    "Int8",
    "UInt8",
    "Int16",
    "UInt16",
    "Int32",
    "UInt32",
    "Int64",
    "UInt64",
    "Boolean",
    "String",
)
NUMBERS = {name: number for number, name in enumerate(TYPES, 1)}
"""The types of FMI 3 with the numbers that echo3.c gives them."""


def compiled(name: str, folder: Path) -> Path:
    """Return the shared library of `c/<name>.c`."""
    library = folder / f"{name}.so"
    command = [
        "cc",
        "-shared",
        "-fPIC",
        "-O1",
        "-w",
        f"-I{HEADERS}",
        str(HERE / f"{name}.c"),
        "-lm",
        "-o",
        str(library),
    ]
    subprocess.run(command, check=True, capture_output=True, timeout=60)
    return library


def pack(target: Path, library: Path, description: str, platform: str) -> Path:
    """Write an FMU whose model identifier is the name of its library."""
    with zipfile.ZipFile(target, "w") as archive:
        archive.writestr("modelDescription.xml", description)
        archive.write(library, f"binaries/{platform}/{library.name}")
    return target


def echo3(folder: Path, library: Path, name: str = "echo3.fmu", **edits: str) -> Path:
    """Write the FMI 3.0 FMU; `edits` go to `echo3_description`."""
    return pack(folder / name, library, echo3_description(**edits), fmpy.platform_tuple)


def echo2(folder: Path, library: Path) -> Path:
    """Write the FMI 2.0 FMU."""
    return pack(folder / "echo2.fmu", library, echo2_description(), fmpy.platform)


def echo3_description(variables: str = "", structure: str = "", kind: str = "", version: str = "3.0") -> str:
    """Return the model description; `variables`, `structure` and `kind` (attributes of CoSimulation) are added."""
    items, outputs = [], []
    for type_, number in NUMBERS.items():
        for name, reference, causality in (("in", 1, "input"), ("out", 11, "output")):
            for array in (False, True):
                about = f'valueReference="{100 * number + reference + array}" causality="{causality}"'
                if type_.startswith("Float"):
                    about += ' variability="continuous"'
                inner = '<Dimension start="3"/>' if array else ""
                if causality == "input":
                    one = {"Boolean": "false", "String": ""}.get(type_, "0")
                    start = ("1 2 3" if array else "0") if type_ == "Float64" else one
                    if type_ == "String":
                        inner += '<Start value=""/>'
                    else:
                        about += f' start="{start}"'
                else:
                    given = 100 * number + 1 + array
                    outputs.append(
                        f'<Output valueReference="{100 * number + reference + array}" dependencies="{given}"/>'
                    )
                label = f"{name}{'s' * array}_{type_}"
                items.append(f'<{type_} name="{label}" {about}>{inner}</{type_}>')
    return f"""<fmiModelDescription fmiVersion="{version}" modelName="echo3" instantiationToken="echo3">
<CoSimulation modelIdentifier="echo3" canGetAndSetFMUState="true" canSerializeFMUState="true"
 canHandleVariableCommunicationStepSize="true" {kind}/>
<UnitDefinitions><Unit name="degC"><BaseUnit K="1" offset="273.15"/></Unit>
<Unit name="K"><BaseUnit K="1"/></Unit></UnitDefinitions>
<TypeDefinitions><EnumerationType name="Gear"><Item name="low" value="-5"/><Item name="high" value="4294967296"/>
</EnumerationType></TypeDefinitions>
<ModelVariables>
<Float64 name="time" valueReference="0" causality="independent" variability="continuous"/>
<Int32 name="mode" valueReference="1" causality="parameter" variability="fixed" start="0" min="0" max="20">
<Alias name="way"/></Int32>
<Float64 name="at" valueReference="2" causality="parameter" variability="tunable" start="1e300"/>
<Float64 name="u" valueReference="3" causality="input" start="0"/>
<Float64 name="x" valueReference="4" causality="output" initial="exact" start="0"/>
<UInt32 name="sets" valueReference="5" causality="output"/>
<UInt64 name="rows" valueReference="7" causality="structuralParameter" start="2"/>
<Float64 name="table" valueReference="6" causality="parameter" variability="fixed" start="0 1 2 3 4 5">
<Dimension valueReference="7"/><Dimension start="3"/></Float64>
{variables}
{chr(10).join(items)}
</ModelVariables>
<ModelStructure>
<Output valueReference="4" dependencies=""/><Output valueReference="5"/>
{chr(10).join(outputs)}{structure}
{chr(10).join(outputs).replace("Output", "InitialUnknown")}<InitialUnknown valueReference="5"/>
</ModelStructure></fmiModelDescription>"""


def echo2_description() -> str:
    """Return the model description of the FMI 2.0 FMU."""
    variables = [("Real", "u", 0, "input", 'start="0"'), ("Real", "x", 1, "output", "")]
    for type_, start in (("Integer", "0"), ("Boolean", "false"), ("String", "")):
        variables.append((type_, f"in_{type_}", 0, "input", f'start="{start}"'))
        variables.append((type_, f"out_{type_}", 1, "output", ""))
    items = "".join(
        f'<ScalarVariable name="{name}" valueReference="{reference}" causality="{causality}"'
        f' variability="{"continuous" if type_ == "Real" else "discrete"}"><{type_} {more}/></ScalarVariable>'
        for type_, name, reference, causality, more in variables
    )
    outputs = "".join(
        f'<Unknown index="{i}" dependencies="{"" if name == "x" else i - 1}"/>'
        for i, (_, name, _, causality, _) in enumerate(variables, 1)
        if causality == "output"
    )
    return f"""<fmiModelDescription fmiVersion="2.0" modelName="echo2" guid="echo2">
<CoSimulation modelIdentifier="echo2" canGetAndSetFMUstate="true" canSerializeFMUstate="true"
 canHandleVariableCommunicationStepSize="true"/>
<ModelVariables>{items}</ModelVariables>
<ModelStructure><Outputs>{outputs}</Outputs><InitialUnknowns>{outputs}</InitialUnknowns></ModelStructure>
</fmiModelDescription>"""
