"""Everything wrong with a system is told at once, with file and line, before any FMU is loaded."""

import random
import re
import shutil
import zipfile

import pytest
from ssp_writer import (
    algorithm,
    bind,
    component,
    connection,
    connector,
    edit_fmu,
    linear,
    pack,
    parameter_set,
    system,
    units,
    write,
)

from twip.cosim import check, load, simulate
from twip.errors import TwipError

GAIN = "CosimGain.fmu"
TAIL = '<ssd:DefaultExperiment startTime="0" stopTime="1"/>'


def a_and_b(*connections, ports="", inside="", a_ports="u> k* y<", b_ports="u> k* y<", a=GAIN, b=GAIN):
    return system([component("a", a, a_ports), component("b", b, b_ports)], connections, ports, inside)


def line_of(path, text):
    return next(i for i, line in enumerate(path.read_text().splitlines(), 1) if text in line)


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
    with zipfile.ZipFile(folder / "three.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", '<fmiModelDescription fmiVersion="3.0"/>')
    with zipfile.ZipFile(folder / GAIN) as archive:
        description = archive.read("modelDescription.xml")
    with zipfile.ZipFile(folder / "bare.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", description)
    names = ["none", "cut", "empty", "three", "bare"]
    path = write(folder, system([component(n, f"{n}.fmu", "u>") for n in names], [connection("none.u -> cut.u")]))
    problems = check(path)
    first = line_of(path, "none.fmu")
    assert problems[0] == f"FMU none.fmu does not exist (SystemStructure.ssd line {first})"
    assert problems[1].startswith("FMU cut.fmu is not a readable zip archive: ")
    assert problems[2] == f"FMU empty.fmu has no modelDescription.xml (SystemStructure.ssd line {first + 2})"
    assert problems[3] == f"FMU three.fmu: FMI 3.0 is not supported, only 2.0 (SystemStructure.ssd line {first + 3})"
    assert problems[4].startswith("FMU bare.fmu has no binary for this platform (binaries/")
    assert len(problems) == 5


def test_values_outside_their_bounds_and_of_the_wrong_kind(folder):
    bounds = {"k": {"min": 0.001, "max": 5, "unit": "m"}}
    fmu = edit_fmu(folder / GAIN, folder / "g.fmu", variables=bounds, definitions="m m=1; s s=1").name
    (folder / "nominal.ssv").write_text(
        parameter_set(
            {"a.k": ("Real", -0.03), "b.k": ("Real", 7), "c.k": ("Boolean", "true"), "d.k": ("Real", 1, "s")},
            units("s s=1", "ssv"),
        )
    )
    path = write(folder, system([component(n, fmu) for n in "abcd"], inside=bind(source="nominal.ssv")))
    line = line_of(folder / "nominal.ssv", "-0.03")
    assert sorted(check(path)) == sorted([
        f"k = -0.03 m must be at least 0.001 m (component a, nominal.ssv line {line})",
        f"k = 7.0 m must be at most 5.0 m (component b, nominal.ssv line {line + 2})",
        f"k = 'true' must be a finite Real number, not Boolean (component c, nominal.ssv line {line + 4})",
        f"k = 1 [s] for a variable in m: units differ (component d, nominal.ssv line {line + 6})",
    ])  # fmt: skip


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"a.kk": 1}, "unknown parameter a.kk, did you mean a.k? (start values)"),
        ({"zzz.q": 1}, "unknown parameter zzz.q (start values)"),
        ({"a.k": "fast"}, "k = 'fast' must be a finite Real number (component a, start values)"),
        ({"a.k": float("nan")}, "k = 'nan' must be a finite Real number (component a, start values)"),
        ({"a.y": 1}, "y cannot be set: it is a continuous output (component a, start values)"),
        ({"m.n": 1.5}, "n = '1.5' must be an Integer of 32 bits (component m, start values)"),
        ({"m.n": 2**31}, "n = '2147483648' must be an Integer of 32 bits (component m, start values)"),
        ({"m.on": "maybe"}, "on = 'maybe' must be a Boolean (true or false) (component m, start values)"),
    ],
)
def test_start_values_that_cannot_be(folder, values, message):
    path = write(folder, system([component("a", GAIN), component("m", "CosimMixed.fmu")]))
    assert check(path, start_values=values) == [message]


def test_the_caller_gives_no_start_value_to_what_is_connected(folder):
    inner = system([component("g", GAIN, "u> y<")], [connection("v -> g.u")], "v>:Real", name="inner")
    guess = bind({"u": ("Real", 1)})  # the description may give one, where initial values are sought
    path = write(
        folder,
        system(
            [component("a", GAIN, "u> y<"), component("b", GAIN, "u>", guess), inner],
            [connection("a.y -> b.u"), connection("a.y -> inner.v"), connection("x -> a.u")],
            "x>:Real",
        ),
    )
    (folder / "set.ssv").write_text(parameter_set({"b.u": ("Real", 5.5), "b.k": ("Real", 5)}))
    said = "is connected inside the system and cannot be given a start value"
    line = line_of(folder / "set.ssv", "5.5")
    assert check(path, start_values={"b.k": 1}) == []
    assert check(path, parameters=[folder / "set.ssv"]) == [f"b.u {said} (set.ssv line {line})"]
    for name in ("b.u", "inner.v", "inner.g.u"):
        assert check(path, start_values={name: 1}) == [f"{name} {said} (start values)"]
    # a connector of the system that has no value leaves the input behind it its own
    assert check(path, start_values={"a.u": 1}) == []
    assert check(path, start_values={"x": 1}) == []
    assert check(path, start_values={"a.u": 1, "x": 1}) == [f"a.u {said} (start values)"]


def test_bounds_of_integers_are_shown_as_integers(folder):
    fmu = edit_fmu(folder / "CosimMixed.fmu", folder / "few.fmu", variables={"n": {"min": 0, "max": 9}}).name
    path = write(folder, system([component("m", fmu)]))
    assert check(path, start_values={"m.n": -1}) == ["n = -1 must be at least 0 (component m, start values)"]
    assert check(path, start_values={"m.n": 10}) == ["n = 10 must be at most 9 (component m, start values)"]


def test_an_unknown_parameter_in_a_file(folder):
    path = write(folder, system([component("a", GAIN, "", bind({"kappa": ("Real", 1)}))]))
    assert check(path) == [
        f"unknown parameter kappa (component a, SystemStructure.ssd line {line_of(path, 'ssv:Real')})"
    ]
    assert check(write(folder, system([component("a", GAIN)])), parameters=[folder / "no.ssv"]) == [
        f"{folder}/no.ssv: No such file or directory"
    ]


def proposing(attributes):
    return f'<ssd:DefaultExperiment stopTime="1">{algorithm(attributes)}</ssd:DefaultExperiment>'


MAPPED = (
    '<ssc:BooleanMappingTransformation><ssc:MapEntry source="true" target="false"/></ssc:BooleanMappingTransformation>'
)
ONE_GAIN = system([component("a", GAIN)])


@pytest.mark.parametrize(
    ("body", "tail", "message"),
    [
        (
            a_and_b(connection("a.y -> b.u", MAPPED)),
            TAIL,
            "BooleanMappingTransformation in Connection is not supported",
        ),
        (
            system([component("a", GAIN, "", bind(source="a.ssv").replace("></", "><ssd:ParameterMapping/></", 1))]),
            TAIL,
            "ParameterMapping in ParameterBinding is not supported",
        ),
        (
            system([component("a", GAIN), '<ssd:SignalDictionaryReference name="d" dictionary="e"/>']),
            TAIL,
            "SignalDictionaryReference in Elements is not supported",
        ),
        (
            system([component("a", GAIN)], inside=f"<ssd:Connectors>{connector('q', 'inout')}</ssd:Connectors>"),
            TAIL,
            "connector root.q: kind inout is not supported",
        ),
        (
            system(['<ssd:Component name="a" source="x.ssp" type="application/x-ssp-package"/>']),
            TAIL,
            "component a: type application/x-ssp-package is not supported",
        ),
        (
            system(['<ssd:Component name="a" source="x.fmu" implementation="ModelExchange"/>']),
            TAIL,
            "component a: only co-simulation is supported, not ModelExchange",
        ),
        (
            system([component("a", "http://x.y/a.fmu")]),
            TAIL,
            "source http://x.y/a.fmu: only relative paths are supported",
        ),
        (
            ONE_GAIN,
            proposing('coupling="magic"'),
            "coupling 'magic' must be one of jacobi, gauss-seidel",
        ),
        (
            ONE_GAIN,
            proposing('order="a b"'),
            "attribute order of {https://twip.example/ssp}Algorithm is not supported",
        ),
        (
            system([component("a", GAIN)], [connection("s -> t")], "s>:String t<:String"),
            TAIL,
            "s → t: connections of type String are not supported",
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


def test_annotations_of_others_and_geometry_are_ignored(folder):
    other = '<ssd:Annotations><ssc:Annotation type="com.other"><z xmlns="z"/></ssc:Annotation></ssd:Annotations>'
    geometry = '<ssd:ElementGeometry x1="0" y1="0" x2="1" y2="1"/>'
    assert check(write(folder, system([component("a", GAIN, "u>", geometry + other)]))) == []


def test_all_problems_come_together(folder):
    path = write(folder, a_and_b(connection("c.y -> b.u"), connection("a.y -> b.v"), inside=bind({"q": ("Real", 1)})))
    with pytest.raises(TwipError) as failure:
        load(path, start_values={"a.kk": 0})
    assert len(str(failure.value).splitlines()) == 4


def test_version_2_is_read_with_the_same_care(folder):
    body = a_and_b(connection("a.y -> b.u"), a_ports="u>:Float64 y<:Float64", b_ports="u> y<")
    assert check(write(folder, body, version="2.0")) == []
    problems = check(
        write(folder, body.replace('endConnector="u"', 'fluxCapacitor="u"') + "<ssd:Strange/>", version="2.0")
    )
    assert [p.split(" (")[0] for p in problems[:3]] == [
        "Strange in SystemStructureDescription is not supported",
        "attribute fluxCapacitor of Connection is not supported",
        "Connection has no endConnector",
    ]


def test_xml_that_is_broken_or_hostile(folder):
    path = folder / "SystemStructure.ssd"
    path.write_text("<a><b></a>")
    broken = "not well-formed XML: Opening and ending tag mismatch: b line 1 and a, line 1, column 11"
    assert check(path)[0] == f"{broken} (SystemStructure.ssd line 1)"
    path.write_text('<!DOCTYPE a [<!ENTITY x SYSTEM "file:///etc/passwd">]><a>&x;</a>')
    assert check(path) == ["a document type declaration is not allowed (SystemStructure.ssd)"]
    path.write_bytes(b"")
    assert len(check(path)) == 1
    path.write_text("<a/>")
    assert check(path) == ["expected a SystemStructureDescription, found a (SystemStructure.ssd line 1)"]


def test_an_archive_a_folder_and_a_bare_file_are_the_same_system(folder):
    path = write(folder, system([component("a", "resources/g%20x.fmu", "u> y<")]))
    (folder / "resources").mkdir()
    shutil.copy(folder / GAIN, folder / "resources" / "g x.fmu")
    archive = pack(path, folder / "s.ssp", {"resources/g x.fmu": folder / GAIN})
    values = []
    for source in (path, folder, archive):
        with load(source) as loaded:
            values.append(simulate(loaded, step_size=0.5).values)
    assert values[0] == values[1] == values[2]


def test_archives_that_are_damaged_or_hostile(folder):
    path = write(folder, system([component("a", "../g.fmu")]))
    good = pack(path, folder / "good.ssp", {GAIN: folder / GAIN})
    assert check(good) == [
        f"source ../g.fmu leads out of the archive (SystemStructure.ssd line {line_of(path, 'g.fmu')})"
    ]
    (folder / "cut.ssp").write_bytes(good.read_bytes()[:-100])
    assert check(folder / "cut.ssp")[0].startswith(f"{folder}/cut.ssp: not a readable zip archive (")
    assert check(folder / "none.ssp") == [f"{folder}/none.ssp: no such file"]
    for entry in ("../evil.txt", "/evil.txt", "a/../../evil.txt", "C:\\evil.txt"):
        with zipfile.ZipFile(folder / "bad.ssp", "w") as archive:
            archive.write(path, "SystemStructure.ssd")
            archive.writestr(entry, "evil")
        assert check(folder / "bad.ssp")[0].endswith("leads out of the archive")
    link = zipfile.ZipInfo("link")
    link.external_attr = 0o120777 << 16
    with zipfile.ZipFile(folder / "bad.ssp", "w") as archive:
        archive.write(path, "SystemStructure.ssd")
        archive.writestr(link, "/etc/passwd")
    assert check(folder / "bad.ssp") == [f"{folder}/bad.ssp: entry 'link' is a link"]
    with zipfile.ZipFile(folder / "bad.ssp", "w") as archive:
        archive.writestr("other.ssd", "")
    assert check(folder / "bad.ssp") == [f"{folder}/bad.ssp: the archive holds no SystemStructure.ssd"]


def test_an_archive_larger_than_the_limit(folder, monkeypatch):
    path = write(folder, system([component("a", GAIN)]))
    monkeypatch.setattr("twip.cosim.archive.MAXIMUM_BYTES", 1000)
    assert "exceed the limit" in check(pack(path, folder / "s.ssp", {GAIN: folder / GAIN}))[0]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"step_size": 0}, "step size 0.0 s must be a positive number"),
        ({"step_size": -1}, "step size -1.0 s must be a positive number"),
        ({"step_size": float("nan")}, "step size nan s must be a positive number"),
        ({"step_size": 0.3}, "step size 0.3 s does not divide the interval from 0.0 s to 1.0 s (3.33333333 steps)"),
        ({"step_size": 3}, "step size 3.0 s does not divide the interval from 0.0 s to 1.0 s (0.333333333 steps)"),
        ({"step_size": 0.1, "stop_time": -1}, "stop time -1.0 s must be later than start time 0.0 s"),
        ({"step_size": 0.1, "stop_time": float("inf")}, "stop time inf s must be later than start time 0.0 s"),
        ({"step_size": 1e-300}, "step size 1e-300 s is too small for the interval from 0.0 s to 1.0 s"),
        (
            {"start_time": 1e9, "stop_time": 1e9 + 2**-21, "step_size": 2**-24},
            "step size 5.960464477539063e-08 s is below the resolution of time near 1000000000.0000005 s (1.2e-07 s)",
        ),
        ({}, "step size is not given, and neither SystemStructure.ssd nor any FMU proposes one"),
        ({"step_size": 1, "coupling": "magic"}, "coupling 'magic' must be one of jacobi, gauss-seidel"),
        ({"step_size": 1, "loop": "magic"}, "loop 'magic' must be one of compiled, python"),
    ],
)
def test_arguments_of_a_run_that_cannot_be(folder, options, message):
    with load(write(folder, system([component("a", GAIN)]))) as loaded, pytest.raises(TwipError) as failure:
        simulate(loaded, **options)
    assert str(failure.value) == message


def test_step_and_coupling_come_from_the_annotation_then_from_the_fmus(folder):
    stepped = edit_fmu(folder / GAIN, folder / "g.fmu", step_size=0.125).name
    tail = proposing('coupling="gauss-seidel" stepSize="0.25"')
    with load(write(folder, system([component("a", stepped)]), tail=tail)) as loaded:
        result = simulate(loaded)
        assert (result.step_size, result.coupling) == (0.25, "gauss-seidel")
        result = simulate(loaded, step_size=0.5, coupling="jacobi", stop_time=2)
        assert (result.steps, result.coupling) == (4, "jacobi")
    with load(write(folder, system([component("a", stepped)]))) as loaded:
        result = simulate(loaded)
        assert (result.step_size, result.coupling) == (0.125, "jacobi")
    with (
        load(write(folder, system([component("a", stepped)]), tail="")) as loaded,
        pytest.raises(TwipError, match="stop time is not given"),
    ):
        simulate(loaded)


def test_an_unpack_folder_with_special_characters_is_avoided(folder, monkeypatch):
    odd = folder / "é#+[1]"
    odd.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(odd))
    path = write(odd, system([component("a", GAIN)]))
    shutil.copy(folder / GAIN, odd / GAIN)
    with load(path) as loaded:
        assert simulate(loaded, step_size=0.5).steps == 2
    monkeypatch.setattr("twip.cosim.archive.FALLBACKS", ())
    with pytest.raises(TwipError, match="cannot hold unpacked FMUs"):
        load(path)


def test_one_dotted_name_for_two_elements(folder):
    inner = system([component("b", GAIN)], name="a")
    path = write(folder, system([component("a.b", GAIN), inner]))
    line = line_of(path, 'Component name="b"')
    assert f"a.b is the name of two elements (SystemStructure.ssd line {line})" in check(path)


def test_an_fmu_that_allows_one_instance_only(folder):
    with zipfile.ZipFile(folder / GAIN) as archive, zipfile.ZipFile(folder / "once.fmu", "w") as copy:
        for name in archive.namelist():
            data = archive.read(name)
            if name == "modelDescription.xml":
                data = data.replace(b'OnlyOncePerProcess="false"', b'OnlyOncePerProcess="true"')
            copy.writestr(name, data)
    assert check(write(folder, system([component("a", "once.fmu")]))) == []
    problems = check(write(folder, system([component("a", "once.fmu"), component("b", "once.fmu")])))
    assert [p.split(" (")[0] for p in problems] == [
        f"FMU once.fmu allows one instance per process, {name} shares it" for name in "ab"
    ]


def test_an_unknown_version_is_refused(folder):
    path = write(folder, ONE_GAIN, version="3.0")
    assert check(path) == ["version 3.0 of the format is not supported (SystemStructure.ssd line 1)"]


def test_mutated_files_never_raise_anything_but_problems(folder):
    (folder / "set.ssv").write_text(parameter_set({"a.k": ("Real", 5, "m")}, units("m m=1", "ssv")))
    inner = system([component("g", GAIN, "u> y<")], [connection("v -> g.u")], "v>:Real[m]", name="inner")
    elements = [component("a", GAIN, "u> k* y<[m]", bind({"k": ("Real", 2)})), inner]
    body = system(elements, [connection("a.y -> inner.v", linear(2))], inside=bind(source="set.ssv"))
    tail = units("m m=1") + proposing('stepSize="0.5"')
    generator = random.Random(1)
    tokens = [b"", b'"', b"<", b"nan", b"%00", b"..", b"[", b"9" * 400, b"a", b"input", b"output", b"//", b"\xff"]
    for version in ("1.0", "2.0"):
        path = write(folder, body, tail=tail, version=version)
        for target in (path, folder / "set.ssv"):
            original = target.read_bytes()
            words = [m.span() for m in re.finditer(rb"[\w.\-]+", original)]
            for _ in range(150):
                begin, end = generator.choice(words)
                target.write_bytes(original[:begin] + generator.choice(tokens) + original[end:])
                assert all(isinstance(line, str) and "\n" not in line for line in check(path))
            target.write_bytes(original)
        assert check(path) == []
