"""Model descriptions of FMI 3.0: what is read from them, and what is refused by name, with its place."""

import zipfile

import fmpy
import pytest
from echo_fmu import compiled, echo3, echo3_description
from ssp_writer import component, connection, system, units, write

from twip.cli import main
from twip.cosim import Runtime, Table, check, load, simulate
from twip.cosim.fmus.description import read_fmu
from twip.cosim.reading.problems import Place, Problems
from twip.cosim.ssp.parameter_file import parameters_of, write_parameter_set
from twip.errors import TwipError

BINARY = '<Binary name="blob_in" valueReference="9001" causality="input"><Start value="00"/></Binary>'
BINARY_OUT = '<Binary name="blob" valueReference="9002" causality="output"/>'


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    return compiled("echo3", tmp_path_factory.mktemp("library"))


def read(folder, library, **edits):
    problems = Problems()
    fmu = read_fmu(echo3(folder, library, **edits), "echo3.fmu", problems, Place("test"))
    return fmu, problems.lines


def line_of(text, **edits):
    lines = echo3_description(**edits).splitlines()
    return next(i for i, line in enumerate(lines, 1) if text in line)


def test_variables_with_their_elements_defaults_and_aliases(tmp_path, library):
    fmu, problems = read(tmp_path, library)
    assert problems == []
    table = [v for v in fmu.variables.values() if v.array == "table"]
    assert [v.name for v in table] == [f"table[{i},{j}]" for i in (1, 2) for j in (1, 2, 3)]
    assert [v.start for v in table] == list("012345")
    assert {v.reference for v in table} == {6}
    assert fmu.variables["way"].alias_of == "mode"
    assert (fmu.variables["mode"].initial, fmu.variables["mode"].variability) == ("exact", "fixed")
    assert (fmu.variables["out_Int8"].initial, fmu.variables["out_Int8"].variability) == ("calculated", "discrete")
    assert fmu.variables["u"].variability == "continuous"
    assert fmu.units["degC"].offset == 273.15
    assert fmu.feedthrough["x"] == frozenset()
    assert fmu.feedthrough["outs_Int8[1]"] == {f"ins_Int8[{i}]" for i in (1, 2, 3)}
    assert len(fmu.feedthrough["sets"]) == 49
    assert (fmu.fmi_version, fmu.saves_state, fmu.serializes_state, fmu.only_once) == ("3.0", True, True, False)
    assert fmu.varies_step


@pytest.mark.parametrize(
    ("variables", "kind", "said"),
    [
        (
            '<Clock name="tick" valueReference="9000" causality="input" intervalVariability="triggered"/>',
            'hasEventMode="true"',
            "variable tick is a Clock: clocks need event mode, which is not used",
        ),
        (
            '<Float64 name="late" valueReference="9000" causality="input" clocks="9001" start="0"'
            ' variability="discrete"/>',
            'hasEventMode="true"',
            "variable late is clocked: clocks need event mode, which is not used",
        ),
        (
            '<Float64 name="late" valueReference="9000"><Dimension valueReference="2"/></Float64>',
            "",
            "variable late: its size, value reference 2, is not a structural parameter",
        ),
        (
            '<Float64 name="late" valueReference="9000"><Dimension start="400"/><Dimension start="400"/></Float64>',
            "",
            "variable late: with its 160000 elements the FMU has more than 100000 variables",
        ),
        (
            '<Float64 name="late" valueReference="9000" causality="parameter" variability="fixed" start="1 2">'
            '<Dimension start="3"/></Float64>',
            "",
            "variable late has 2 start values for 3 elements",
        ),
        ('<Float64 name="late" valueReference="3"/>', "", "value reference 3 is there twice"),
        ('<Float64 name="u" valueReference="9000"/>', "", "variable u is there twice"),
        ('<Float64 name="ins_Int8[2]" valueReference="9000"/>', "", "variable ins_Int8[2] is there twice"),
        ('<Float64 name="late" valueReference="-1"/>', "", "Element 'Float64', attribute 'valueReference'"),
        ('<Float65 name="late" valueReference="9"/>', "", "Element 'Float65': This element is not expected"),
    ],
)
def test_what_cannot_be_done_is_told_with_its_line(tmp_path, library, variables, kind, said):
    fmu, problems = read(tmp_path, library, variables=f"\n{variables}", kind=kind)
    place = f"(echo3.fmu: modelDescription.xml line {line_of(variables[:20], variables=f'{chr(10)}{variables}')}"
    assert fmu is None
    assert any(line.startswith(said) and (place in line or "there twice" in line) for line in problems), problems


def test_other_versions_and_kinds_are_refused(tmp_path, library):
    assert read(tmp_path, library, version="3.1")[1] == [
        "FMU echo3.fmu: FMI 3.1 is not supported, only 2.0 and 3.0 (test)"
    ]
    assert read(tmp_path, library, version="3.0.2")[1] == []
    text = echo3_description().replace("CoSimulation", "ModelExchange")
    with zipfile.ZipFile(tmp_path / "me.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", text.replace('canHandleVariableCommunicationStepSize="true"', ""))
    problems = Problems()
    assert read_fmu(tmp_path / "me.fmu", "me.fmu", problems, Place("test")) is None
    assert problems.lines == ["FMU me.fmu offers no co-simulation (test)"]


def test_binary_variables_are_left_alone_and_not_connected(tmp_path, library):
    echo3(tmp_path, library, variables=BINARY + BINARY_OUT, structure='<Output valueReference="9002"/>')
    with load(write(tmp_path, system([component("a", "echo3.fmu")]))) as loaded:
        table = Table(loaded.channels)
        result = simulate(loaded, sinks=[table], step_size=0.5, runtime=Runtime(loop="python"))
    assert "a: variables of type Binary are not read or set: blob_in, blob" in result.warnings
    parts = [component("a", "echo3.fmu", "blob<"), component("b", "echo3.fmu", "blob_in>")]
    problems = check(write(tmp_path, system(parts, [connection("a.blob -> b.blob_in")])))
    assert any("a.blob → b.blob_in: connections of type Binary are not supported" in line for line in problems)


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("rows", 3, "rows cannot be set: it is a structural parameter, and arrays are not resized"),
        ("way", 3, "way cannot be set: it is another name of mode"),
        ("x", "0", ""),
        ("out_Int8", 1, "out_Int8 cannot be set: it is a discrete output"),
        ("mode", 21, "mode = 21 must be at most 20"),
        ("in_Int8", 1.5, "in_Int8 = '1.5' must be a value of type Int8 (-128 to 127)"),
        ("in_UInt64", -1, "in_UInt64 = '-1' must be a value of type UInt64 (0 to 18446744073709551615)"),
        (
            "in_UInt64",
            2**64,
            "in_UInt64 = '18446744073709551616' must be a value of type UInt64 (0 to 18446744073709551615)",
        ),
        ("in_Float32", 1e39, "in_Float32 = '1e+39' must be a finite number within the range of Float32"),
        ("in_Boolean", 2, "in_Boolean = '2' must be a Boolean (true or false)"),
        ("table[2,4]", 2, "unknown parameter a.table[2,4], did you mean a.table[2,3]?"),
    ],
)
def test_start_values_are_checked_by_type(tmp_path, library, name, value, said):
    echo3(tmp_path, library)
    problems = check(write(tmp_path, system([component("a", "echo3.fmu")])), start_values={f"a.{name}": value})
    assert [line.split(" (component")[0].split(" (start values")[0] for line in problems] == [said] * bool(said)


def test_temperatures_with_offsets_are_converted_between_fmus(tmp_path, library):
    """21.5 °C is 294.65 K; the FMU's own units say so."""
    text = echo3_description().replace('name="u" valueReference="3"', 'name="u" valueReference="3" unit="degC"')
    other = echo3_description().replace('name="in_Float64"', 'name="in_Float64" unit="K"')
    for name, description in (("c.fmu", text), ("k.fmu", other)):
        with zipfile.ZipFile(tmp_path / name, "w") as archive:
            archive.writestr("modelDescription.xml", description)
            archive.write(library, f"binaries/x86_64-linux/{library.name}")
    parts = [component("c", "c.fmu", "u>[degC]"), component("k", "k.fmu", "in_Float64>[K]")]
    body = system(parts, [connection("t -> c.u"), connection("t -> k.in_Float64")], "t>:Real[degC]")
    known = units("degC K=1 offset=273.15; K K=1")
    path = write(tmp_path, body, tail=f'{known}<ssd:DefaultExperiment startTime="0" stopTime="1"/>')
    with load(path, start_values={"t": 21.5}) as loaded:
        table = Table(loaded.channels)
        simulate(loaded, sinks=[table], step_size=0.5, runtime=Runtime(loop="python"))
    assert table["c.x"][-1] == 21.5
    assert table["k.out_Float64"][-1] == 21.5 + 273.15


def test_parameters_of_every_type_are_listed_and_read_back(tmp_path, library):
    more = '<Enumeration name="gear" valueReference="9000" causality="parameter" declaredType="Gear" start="-5"/>'
    more += '<UInt64 name="big" valueReference="9001" causality="parameter" start="18446744073709551615"/>'
    more += '<String name="label" valueReference="9002" causality="parameter"><Start value="a b"/></String>'
    more += '<Float32 name="small" valueReference="9003" causality="parameter" start="0.1"/>'
    echo3(tmp_path, library, variables=more)
    path = write(tmp_path, system([component("a", "echo3.fmu")]))
    with load(path, start_values={"a.gear": "high", "a.table[1,2]": 0.5}) as loaded:
        entries = parameters_of(loaded)
    values = {entry.name: entry.value for entry in entries}
    assert values["a.gear"] == "high"
    assert values["a.big"] == 2**64 - 1
    assert (values["a.label"], values["a.table[1,2]"], values["a.table[2,3]"]) == ("a b", 0.5, 5.0)
    assert "a.way" not in values
    write_parameter_set(tmp_path / "all.ssv", "all", entries)
    with load(path, parameters=[tmp_path / "all.ssv"]) as again:
        assert parameters_of(again) == entries


def test_check_names_the_version(tmp_path, library, capsys):
    echo3(tmp_path, library)
    assert main(["check", str(tmp_path / "echo3.fmu")]) == 0
    assert capsys.readouterr().out.startswith("FMU                 echo3.fmu, FMI 3.0 co-simulation\n")


@pytest.mark.parametrize(
    ("structure", "variables", "reference"),
    [('<Output valueReference="77"/>', "", 77), ('<Output valueReference="8" dependencies="3 78"/>', "8", 78)],
)
def test_an_output_that_no_variable_is_behind_is_refused(tmp_path, library, structure, variables, reference):
    if variables:
        variables = '<Float64 name="more" valueReference="8" causality="output"/>'
    fmu, problems = read(tmp_path, library, structure=structure, variables=variables)
    line = line_of(structure, structure=structure, variables=variables)
    assert fmu is None
    assert problems == [
        f"an output in ModelStructure names value reference {reference}, which no variable has"
        f" (echo3.fmu: modelDescription.xml line {line})"
    ]


def test_a_type_without_definition_is_refused(tmp_path, library):
    variables = '<Float64 name="more" valueReference="8" causality="input" start="0" declaredType="Lost"/>'
    _, problems = read(tmp_path, library, variables=variables)
    line = line_of("Lost", variables=variables)
    assert problems == [f"variable more: type Lost is not defined (echo3.fmu: modelDescription.xml line {line})"]


@pytest.mark.parametrize(
    ("variable", "said"),
    [
        ('<Float64 name="more" valueReference="8" causality="input" start="0" declaredType="Gear"/>',
         "variable more: type Gear is no Float64"),
        ('<Float64 name="more" valueReference="8" causality="input" variability="constant" start="0"/>',
         "variable more: there is no constant input"),
        ('<Int32 name="more" valueReference="8" causality="parameter" variability="discrete" start="0"/>',
         "variable more: there is no discrete parameter"),
        ('<Int32 name="more" valueReference="8" causality="input" start="0 1"/>',
         "variable more has 2 start values for 1 element"),
    ],
)  # fmt: skip
def test_variables_that_cannot_be_are_refused(tmp_path, library, variable, said):
    fmu, problems = read(tmp_path, library, variables=variable)
    assert fmu is None
    assert problems == [f"{said} (echo3.fmu: modelDescription.xml line {line_of('more', variables=variable)})"]


def test_a_unit_and_a_type_of_which_there_are_two_are_refused(tmp_path, library):
    text = echo3_description().replace("<TypeDefinitions>", '<TypeDefinitions><Int8Type name="Gear"/>')
    text = text.replace("<UnitDefinitions>", '<UnitDefinitions><Unit name="K"/>')
    with zipfile.ZipFile(tmp_path / "e.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", text)
        archive.write(library, f"binaries/{fmpy.platform_tuple}/{library.name}")
    problems = Problems()
    assert read_fmu(tmp_path / "e.fmu", "e.fmu", problems, Place("test")) is None
    assert [line.partition(" (")[0] for line in problems.lines] == [
        "unit K is defined twice",
        "type Gear is defined twice",
    ]


def test_what_makes_no_sense_and_does_no_harm_is_warned_of(tmp_path, library):
    more = '<Float64 name="more" valueReference="8" causality="input" start="0" nominal="INF"/>'
    output = '<Output valueReference="3"/>'
    text = echo3_description(variables=more, structure=output)
    text = text.replace("<ModelVariables>", '<DefaultExperiment stepSize="NaN"/><ModelVariables>')
    with zipfile.ZipFile(tmp_path / "e.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", text)
        archive.write(library, f"binaries/{fmpy.platform_tuple}/{library.name}")
    problems = Problems()
    fmu = read_fmu(tmp_path / "e.fmu", "e.fmu", problems, Place("test"))
    places = [
        f"(e.fmu: modelDescription.xml line {next(i for i, row in enumerate(text.splitlines(), 1) if found in row)})"
        for found in (more, "stepSize", output)
    ]
    assert problems.lines == []
    assert problems.warnings == [
        f"nominal = inf of variable more must be positive, it is taken for 1 {places[0]}",
        f"stepSize = nan of DefaultExperiment must be positive, it is ignored {places[1]}",
        f"ModelStructure has u for an output, which it is not {places[2]}",
    ]
    assert (fmu.variables["more"].nominal, fmu.step_size) == (1.0, None)


@pytest.mark.parametrize("values", [{"a.ins_Float64[2]": 5}, {"a.ins_Float64[2]": 5, "a.ins_Float64[3]": 6}])
def test_an_array_with_values_for_some_elements_is_told_before_it_runs(tmp_path, library, values):
    text = echo3_description().replace('start="1 2 3"', "")
    with zipfile.ZipFile(tmp_path / "e.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", text)
        archive.write(library, f"binaries/{fmpy.platform_tuple}/{library.name}")
    path = write(tmp_path, system([component("a", "e.fmu")]))
    lacking = ", ".join(f"ins_Float64[{i}]" for i in (1, 2, 3) if f"a.ins_Float64[{i}]" not in values)
    told = (
        f"ins_Float64 is set as a whole, but nothing gives {lacking} a value: the FMU states no start value"
        " (component a, start values)"
    )
    assert check(path, start_values=values) == [told]
    with load(path) as loaded, pytest.raises(TwipError) as refused:
        loaded.with_start_values(values)
    assert str(refused.value) == told
    everything = {f"a.ins_Float64[{i}]": float(i) for i in (1, 2, 3)}
    result = simulate(load(path, start_values=everything), step_size=0.5, runtime=Runtime(loop="python"))
    assert [result[name][-1] for name in everything] == [1.0, 2.0, 3.0]


def test_an_integer_that_cannot_travel_is_told_before_it_runs(tmp_path, library):
    echo3(tmp_path, library)
    path = write(tmp_path, system([component("a", "echo3.fmu")]))
    (told,) = check(path, start_values={"a.in_Int64": 2**53 + 1})
    assert told.startswith("in_Int64 cannot be set: 9007199254740993 is a value which is beyond ±2^53")
    text = echo3_description().replace(
        'name="in_Int64" valueReference="901" causality="input" start="0"',
        'name="in_Int64" valueReference="901" causality="input" start="9007199254740993"',
    )
    assert text != echo3_description()
    with zipfile.ZipFile(tmp_path / "echo3.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", text)
        archive.write(library, f"binaries/{fmpy.platform_tuple}/{library.name}")
    (told,) = check(path)
    assert told.startswith("a.in_Int64 begins with 9007199254740993 in echo3.fmu")


def test_check_of_a_system_tells_in_what_its_fmus_depart_from_the_standard(tmp_path, library, capsys):
    text = echo3_description().replace('name="u"', 'name="u" unit="furlong"')
    text = text.replace('<Output valueReference="5"/>', "")
    with zipfile.ZipFile(tmp_path / "e.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", text)
        archive.write(library, f"binaries/{fmpy.platform_tuple}/{library.name}")
    path = write(tmp_path, system([component("a", "e.fmu"), component("b", "e.fmu")]))
    assert main(["check", str(path), "--step-size", "0.5"]) == 0
    said = capsys.readouterr().out
    assert said.count('e.fmu: The unit "furlong" of variable "u"') == 1
    assert said.count("e.fmu: ModelStructure/Outputs must have exactly one entry for each variable") == 1
