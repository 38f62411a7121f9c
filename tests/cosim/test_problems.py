"""Everything wrong with a system is told at once, with file and line, before any FMU is loaded."""

import zipfile

import pytest
from ssp_writer import (
    a_and_b,
    algorithm,
    bind,
    component,
    connection,
    connector,
    edit_fmu,
    line_of,
    linear,
    proposing,
    system,
    units,
    write,
)

from twip.cosim import check, load
from twip.errors import TwipError

GAIN = "CosimGain.fmu"
TAIL = '<ssd:DefaultExperiment startTime="0" stopTime="1"/>'
ONE_GAIN = system([component("a", GAIN)])
MAPPED = (
    '<ssc:BooleanMappingTransformation><ssc:MapEntry source="true" target="false"/></ssc:BooleanMappingTransformation>'
)


@pytest.mark.parametrize(
    ("wire", "message"),
    [
        ("c.y -> b.u", "c.y → b.u: there is no element c"),
        ("a.y -> b.v", "a.y → b.v: b has no connector v"),
        ("x -> b.u", "x → b.u: the system has no connector x"),
        ("a.u -> b.u", "a.u → b.u: both ends take a value (input to input)"),
        ("a.y -> b.y", "a.y → b.y: both ends give a value (output to output)"),
        ("a.y -> b.k", "a.y → b.k: output cannot feed parameter"),
    ],
)
def test_a_connection_that_makes_no_sense(folder, wire, message):
    path = write(folder, a_and_b(connection(wire)))
    assert check(path) == [f"{message} (SystemStructure.ssd line {line_of(path, 'Connection ')})"]


def test_an_input_connected_twice(folder):
    path = write(folder, a_and_b(connection("a.y -> b.u"), connection("b.y -> b.u")))
    first = line_of(path, "startElement")
    assert check(path) == [
        f"b.u is connected twice: to a.y (line {first}) and b.y (SystemStructure.ssd line {first + 1})"
    ]


def test_units_that_differ(folder):
    definitions = "N.m kg=1 m=2 s=-2; rad/s rad=1 s=-1"
    a = edit_fmu(folder / GAIN, folder / "a.fmu", variables={"y": {"unit": "N.m"}}, definitions=definitions).name
    b = edit_fmu(folder / GAIN, folder / "b.fmu", variables={"u": {"unit": "rad/s"}}, definitions=definitions).name
    path = write(folder, a_and_b(connection("a.y -> b.u"), a=a, b=b))
    assert check(path) == [
        f"a.y [N.m] → b.u [rad/s]: units differ (SystemStructure.ssd line {line_of(path, 'Connection ')})"
    ]
    assert check(write(folder, a_and_b(connection("a.y -> b.u", suppressUnitConversion="true"), a=a, b=b))) == []


def test_a_unit_without_definition(folder):
    path = write(folder, a_and_b(connection("a.y -> b.u"), a_ports="y<[ell]", b_ports="u>[rod]"))
    assert check(path) == [
        f"a.y [ell] → b.u [rod]: unit ell has no definition (SystemStructure.ssd line {line_of(path, 'Connection ')})"
    ]


def test_a_unit_that_the_file_does_not_define_is_warned_of(folder):
    with load(write(folder, a_and_b(connection("a.y -> b.u"), a_ports="y<[ell]", b_ports="u>[ell]"))) as loaded:
        assert [w.split(" (")[0] for w in loaded.warnings] == ["unit ell has no definition in the file"]


def test_units_of_a_nested_chain_are_named_at_the_hop_that_fails(folder):
    inner = system([component("g", GAIN, "u>[m]")], [connection("v -> g.u")], "v>[s]", name="inner")
    path = write(folder, system([inner]), tail=units("m m=1; s s=1") + TAIL)
    assert check(path) == [
        f"inner.v [s] → inner.g.u [m]: units differ (SystemStructure.ssd line {line_of(path, 'Connection ')})"
    ]


def test_connectors_that_do_not_match_the_fmu(folder):
    path = write(folder, system([component("a", GAIN, "w> y> u>:Integer k<")]))
    at = f"(SystemStructure.ssd line {line_of(path, 'Connector')})"
    assert check(path) == [
        f"connector a.w: {GAIN} has no such variable {at}",
        f"connector a.y: is input, but output in {GAIN} {at}",
        f"connector a.u: is Integer, but Real in {GAIN} {at}",
        f"connector a.k: is output, but parameter in {GAIN} {at}",
    ]


def test_types_that_differ_also_through_connectors_without_type(folder):
    parts = [component("m", "CosimMixed.fmu", "n> total<"), component("g", GAIN, "u> y<")]
    path = write(folder, system(parts, [connection("m.total -> g.u"), connection("v -> m.n", linear(2))], "v>"))
    first = line_of(path, 'm" startConnector')
    assert check(path) == [
        f"m.total → g.u: types differ (Integer, Real) (SystemStructure.ssd line {first})",
        f"v → m.n: a linear transformation needs Real values, not Integer (SystemStructure.ssd line {first + 1})",
    ]


def test_names_that_are_there_twice(folder):
    path = write(folder, system([component("a", GAIN, "u> u>"), component("a", GAIN)]))
    assert check(path) == [
        f"element a is there twice in system root (SystemStructure.ssd line {line_of(path, 'Connectors') + 1})",
        f"connector u of a is there twice (SystemStructure.ssd line {line_of(path, 'Connectors')})",
    ]


def test_a_missing_damaged_or_foreign_fmu(folder):
    (folder / "cut.fmu").write_bytes((folder / GAIN).read_bytes()[:5000])
    with zipfile.ZipFile(folder / "empty.fmu", "w") as archive:
        archive.writestr("a", "")
    with zipfile.ZipFile(folder / "one.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", '<fmiModelDescription fmiVersion="1.0"/>')
    with zipfile.ZipFile(folder / GAIN) as archive:
        description = archive.read("modelDescription.xml")
    with zipfile.ZipFile(folder / "bare.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", description)
    names = ["none", "cut", "empty", "one", "bare"]
    path = write(folder, system([component(n, f"{n}.fmu", "u>") for n in names], [connection("none.u -> cut.u")]))
    problems = check(path)
    first = line_of(path, "none.fmu")
    assert problems[0] == f"FMU none.fmu does not exist (SystemStructure.ssd line {first})"
    assert problems[1].startswith("FMU cut.fmu is not a readable zip archive: ")
    assert problems[2] == f"FMU empty.fmu has no modelDescription.xml (SystemStructure.ssd line {first + 2})"
    assert (
        problems[3] == f"FMU one.fmu: FMI 1.0 is not supported, only 2.0 and 3.0 (SystemStructure.ssd line {first + 3})"
    )
    assert problems[4].startswith("FMU bare.fmu has no binary for this platform (binaries/")
    assert len(problems) == 5


@pytest.mark.parametrize(
    ("body", "tail", "message"),
    [
        (
            a_and_b(connection("a.y -> b.u", MAPPED)),
            TAIL,
            "a.y → b.u: a boolean mapping needs Boolean values, not Real",
        ),
        (
            system([component("a", GAIN, "", bind(source="a.ssv").replace("></", "><ssd:ParameterMapping/></", 1))]),
            TAIL,
            "a parameter mapping needs either a source or one inline ParameterMapping",
        ),
        (
            system([component("a", GAIN), '<ssd:SignalDictionaryReference name="d" dictionary="e"/>']),
            TAIL,
            "d: there is no signal dictionary e",
        ),
        (
            system([component("a", GAIN)], inside=f"<ssd:Connectors>{connector('q', 'inout')}</ssd:Connectors>"),
            TAIL,
            "connector root.q: kind inout is not supported",
        ),
        (
            system(['<ssd:Component name="a" source="x.mo" type="text/x-modelica"/>']),
            TAIL,
            "component a: type text/x-modelica is not supported",
        ),
        (
            system(['<ssd:Component name="a" source="x.fmu" implementation="ModelExchange"/>']),
            TAIL,
            "component a: only co-simulation is supported, not ModelExchange",
        ),
        (
            system([component("a", "http://x.y/a.fmu")]),
            TAIL,
            "source http://x.y/a.fmu: only relative paths and file: URIs are supported",
        ),
        (
            ONE_GAIN,
            proposing('coupling="magic"'),
            "coupling 'magic' must be one of jacobi, gauss-seidel, iterated",
        ),
        (
            ONE_GAIN,
            proposing('order="a b"'),
            "attribute order of {https://twip.example/ssp}Algorithm is not supported",
        ),
        (
            system([component("a", GAIN)], [connection("s -> t")], "s>:String t<:Integer"),
            TAIL,
            "s → t: types differ (String, Integer)",
        ),
        (ONE_GAIN + "<ssd:Strange/>", "", "Element 'Strange': This element is not expected."),
        (
            system([component("a", GAIN, "", algorithm('coupling="jacobi"'))]),
            TAIL,
            "annotation org.twip.cosim has no meaning here",
        ),
    ],
)
def test_what_is_not_supported_is_named(folder, body, tail, message):
    problems = check(write(folder, body, tail=tail))
    assert any(p.startswith(message) and "SystemStructure.ssd line " in p for p in problems), problems


def warnings_of(path):
    assert check(path) == []
    with load(path) as loaded:
        return [w.split(" (")[0] for w in loaded.warnings]


def test_annotations_of_others_are_ignored_with_a_warning_and_geometry_without(folder):
    other = '<ssd:Annotations><ssc:Annotation type="com.other"><z xmlns="z"/></ssc:Annotation></ssd:Annotations>'
    geometry = '<ssd:ElementGeometry x1="0" y1="0" x2="1" y2="1"/>'
    path = write(folder, system([component(name, GAIN, "u>", geometry + other) for name in "ab"]))
    assert warnings_of(path) == ["annotations of type com.other are ignored"]


OMS = 'xmlns:oms="https://raw.githubusercontent.com/OpenModelica/OMSimulator/master/schema/oms.xsd"'
STEP = "<oms:SimulationInformation><oms:FixedStepMaster stepSize='0.1'/></oms:SimulationInformation>"


@pytest.mark.parametrize(
    ("content", "ours", "warned"),
    [
        (STEP, True, False),
        (STEP, False, True),  # nothing else in the file says how to step: what OMSimulator would do is lost
        (f"<oms:Buses/>{STEP}", True, True),
        ("", True, True),
    ],
)
def test_a_step_for_omsimulator_beside_our_own_is_no_loss(folder, content, ours, warned):
    theirs = f"<oms:Annotations {OMS}>{content}</oms:Annotations>"
    theirs = f'<ssc:Annotation type="org.openmodelica">{theirs}</ssc:Annotation>'
    body = system([component("a", GAIN, "u>")]).replace(
        "</ssd:System>", f"<ssd:Annotations>{theirs}</ssd:Annotations></ssd:System>"
    )
    path = write(folder, body, tail=algorithm('coupling="jacobi" stepSize="0.1"') if ours else TAIL)
    assert warnings_of(path) == ["annotations of type org.openmodelica are ignored"] * warned


@pytest.mark.parametrize("schema", [True, False])
def test_meta_data_and_signatures_are_ignored_with_a_warning(folder, monkeypatch, schema):
    if not schema:
        monkeypatch.setattr("twip.cosim.ssp.schemas.schema_folder", lambda _: None)
    more = '<ssc:MetaData kind="quality" type="text/plain" source="a.txt"/>'
    more += '<ssc:Signature role="authenticity" type="text/plain"><ssc:Content/></ssc:Signature>'
    path = write(folder, system([component("a", GAIN, "u>", more)]), version="2.0")
    assert warnings_of(path) == ["MetaData of Component is ignored", "Signature of Component is ignored"]
    if schema:  # they are no part of version 1, whose schemas are always there
        assert check(write(folder, system([component("a", GAIN, "u>", more)]))) != []


def test_all_problems_come_together(folder):
    path = write(folder, a_and_b(connection("c.y -> b.u"), connection("a.y -> b.v"), inside=bind({"q": ("Real", 1)})))
    with pytest.raises(TwipError) as failure:
        load(path, start_values={"a.kk": 0})
    assert len(str(failure.value).splitlines()) == 3


@pytest.mark.parametrize("schema", [True, False])
def test_version_2_is_read_with_the_same_care(folder, monkeypatch, schema):
    if not schema:
        monkeypatch.setattr("twip.cosim.ssp.schemas.schema_folder", lambda _: None)
    body = a_and_b(connection("a.y -> b.u"), a_ports="u>:Float64 y<:Float64", b_ports="u> y<")
    assert check(write(folder, body, version="2.0")) == []
    wrong = body.replace('endConnector="u"', 'fluxCapacitor="u"') + "<ssd:Strange/>"
    problems = check(write(folder, wrong, version="2.0"))
    said = [p.split(" (")[0] for p in problems]
    if schema:
        assert (
            said[0] == "Element 'Connection', attribute 'fluxCapacitor': The attribute 'fluxCapacitor' is not allowed."
        )
        assert len(said) == 3
    else:
        assert said[:3] == [
            "Strange in SystemStructureDescription is not supported",
            "attribute fluxCapacitor of Connection is not supported",
            "Connection has no endConnector",
        ]


@pytest.mark.parametrize("schema", [True, False])
@pytest.mark.parametrize("namespace", ["Common", "Description"])
def test_elements_of_another_namespace_are_no_elements_of_ssp(folder, monkeypatch, schema, namespace):
    if not schema:
        monkeypatch.setattr("twip.cosim.ssp.schemas.schema_folder", lambda _: None)
    path = write(folder, a_and_b(connection("a.y -> b.u"), a_ports="u>:Real y<"), version="2.0")
    assert check(path) == []
    path.write_text(path.read_text().replace(f"SSP1/SystemStructure{namespace}", f"SSP2/SystemStructure{namespace}"))
    assert check(path) != []


def test_versions(folder):
    assert check(write(folder, ONE_GAIN, version="3.0")) == [
        "version 3.0 of the format is not supported (SystemStructure.ssd line 1)"
    ]
    assert check(write(folder, ONE_GAIN, version="")) == ["there is no version (SystemStructure.ssd line 1)"]
    assert check(write(folder, ONE_GAIN, version="Draft20180219")) != []
    assert warnings_of(write(folder, ONE_GAIN, version="1.0")) == []
    assert warnings_of(write(folder, ONE_GAIN, version="2.0")) == []
    assert warnings_of(write(folder, ONE_GAIN, version="1.1")) == ["version 1.1 of the format is read as 1.0"]
    assert warnings_of(write(folder, ONE_GAIN, version="2.1")) == ["version 2.1 of the format is read as 2.0"]
