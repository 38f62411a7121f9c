"""Systems by reference: another description, a package, a system of the same file; and several in one archive."""

import math
import shutil

import pytest
from flat_options import grouped
from ssp_writer import bind, component, connection, pack, parameter_set, system, units, write

from twip.cli import main
from twip.cosim import Runtime, Table, check, load, simulate
from twip.errors import TwipError

GAIN = "CosimGain.fmu"
INNER = system(
    [component("g", GAIN, "u> k* y<", bind({"k": ("Real", 3)}))],
    [connection("v -> g.u"), connection("g.y -> w")],
    "v>:Real w<:Real",
    name="whatever",
)
DEFINITION, PACKAGE = "application/x-ssp-definition", "application/x-ssp-package"


def reference(name, source, type_=DEFINITION, ports="v>:Real w<:Real", inside=""):
    return component(name, source, ports, inside).replace(" source=", f' type="{type_}" source=')


def put(folder, name, body=INNER, **options):
    """Write a description under a name of its own."""
    there = folder / name
    there.parent.mkdir(exist_ok=True)
    kept = folder / "SystemStructure.ssd"
    before = kept.read_bytes() if kept.exists() else None
    shutil.move(write(folder, body, **options), there)
    if before is not None:
        kept.write_bytes(before)
    return there


def outer(folder, *elements):
    """Two gains of what `inner` and `more` make of `x`."""
    return write(
        folder,
        system(
            elements,
            [connection("x -> one.v"), connection("one.w -> two.v"), connection("two.w -> z")],
            "x>:Real z<:Real",
        ),
    )


def last(path, **options):
    with load(path, start_values={"x": 2.0}) as loaded:
        table = Table(loaded.channels)
        simulate(loaded, sinks=[table], step_size=0.5, **grouped(**options))
    return {name: table[name][-1] for name in table.columns}


def test_a_description_in_the_place_of_a_component(folder, loop):
    put(folder, "inner.ssd")
    values = last(outer(folder, reference("one", "inner.ssd"), reference("two", "inner.ssd")), loop=loop)
    assert values["z"] == 18.0
    assert values["one.g.y"] == values["one.w"] == 6.0
    assert values["two.g.u"] == 6.0


def test_bindings_of_the_component_win_over_those_of_the_system_it_refers_to(folder):
    own = system(
        [component("g", GAIN, "u> k* y<")],
        [connection("v -> g.u"), connection("g.y -> w")],
        "v>:Real w<:Real",
        bind({"g.k": ("Real", 3)}),
    )
    put(folder, "inner.ssd", own)
    path = outer(
        folder, reference("one", "inner.ssd", inside=bind({"g.k": ("Real", 10)})), reference("two", "inner.ssd")
    )
    assert last(path)["z"] == 60.0


def test_a_package_keeps_its_own_files_and_units(folder, loop):
    """Units count in one file: `a` is an angle of 2 rad inside, of 1 rad outside."""
    inner = system(
        [component("g", GAIN, "u>[a] y<")], [connection("v -> g.u"), connection("g.y -> w")], "v>[a] w<:Real"
    )
    experiment = '<ssd:DefaultExperiment stopTime="1"/>'
    ssd = put(folder, "resources/SystemStructure.ssd", inner, tail=units("a rad=1 factor=2") + experiment)
    pack(ssd, folder / "inner.ssp", {GAIN: folder / GAIN})
    body = system(
        [reference("one", "inner.ssp", PACKAGE, "v> w<")],
        [connection("x -> one.v"), connection("one.w -> z")],
        "x>[a] z<:Real",
    )
    path = write(folder, body, tail=units("a rad=1") + experiment)
    values = last(path, loop=loop)
    assert (values["one.g.u"], values["z"]) == (1.0, 2.0)
    # the same, the package inside a package
    outside = pack(path, folder / "outer.ssp", {"inner.ssp": folder / "inner.ssp"})
    assert last(outside, loop=loop) == values


def test_another_description_of_a_package_by_a_fragment(folder):
    put(folder, "VariantB.ssd", INNER.replace('value="3"', 'value="5"'))
    ssd = put(folder, "default.ssd")
    files = {"VariantB.ssd": folder / "VariantB.ssd", GAIN: folder / GAIN}
    pack(ssd, folder / "inner.ssp", files)
    path = outer(folder, reference("one", "inner.ssp", PACKAGE), reference("two", "inner.ssp#VariantB.ssd", PACKAGE))
    assert last(path)["z"] == 30.0
    path = outer(folder, reference("one", "inner.ssp#C.ssd", PACKAGE), reference("two", "inner.ssp", PACKAGE))
    assert check(path)[0].startswith("inner.ssp holds no C.ssd (SystemStructure.ssd line ")


def test_a_system_of_the_same_file_by_its_id(folder, loop):
    named = INNER.replace('name="whatever"', 'name="one" id="twice"')
    path = outer(folder, named, reference("two", "#twice", ports=""))
    assert last(path, loop=loop)["z"] == 18.0
    path = outer(folder, named, reference("two", "#thrice", ports=""))
    assert check(path)[0].startswith("source #thrice: the file has no system with this id")


def test_files_of_a_description_are_relative_to_it_and_named_with_their_way(folder):
    (folder / "parts").mkdir()
    shutil.copy(folder / GAIN, folder / "parts")
    (folder / "parts" / "set.ssv").write_text(parameter_set({"g.k": ("Real", 7)}))
    body = system([component("g", GAIN, "u> y<")], [connection("v -> g.u")], "v>:Real", bind(source="set.ssv"))
    put(folder, "parts/inner.ssd", body)
    path = write(folder, system([reference("one", "parts/inner.ssd", ports="v>")]))
    with load(path) as loaded:
        assert [s.value for s in loaded.components[0].start_values] == [7.0]
        assert set(loaded.provenance()) >= {"parameters parts/set.ssv"}
        assert loaded.components[0].fmu.name == f"parts/{GAIN}"
    (folder / "parts" / "set.ssv").write_text(parameter_set({"g.k": ("Boolean", "true")}))
    assert check(path) == [
        "k = 'true' must be a finite Real number, not Boolean (component one.g, parts/set.ssv line 3)"
    ]


@pytest.mark.parametrize("names", [["a.ssd"], ["a.ssd", "b.ssd"], ["a.ssd", "b.ssd", "c.ssd"]])
def test_a_circle_of_descriptions_is_named(folder, names):
    for name, following in zip(names, [*names[1:], names[0]], strict=True):
        put(folder, name, system([reference("next", following, ports="")]))
    path = write(folder, system([reference("first", names[0], ports="")]))
    way = " → ".join(["SystemStructure.ssd", *names, names[0]])
    assert check(path)[0] == f"component next: a system cannot contain itself: {way} ({names[-1]} line 4)"


def test_a_system_that_contains_itself_by_its_id(folder):
    inner = system([reference("again", "#me", ports="")], name="me").replace('name="me"', 'name="me" id="me"')
    assert "a system cannot contain itself: SystemStructure.ssd → #me → #me" in check(write(folder, system([inner])))[0]


def test_too_many_elements_by_reference_are_refused(folder, monkeypatch):
    monkeypatch.setattr("twip.cosim.ssp.references.MAXIMUM_ELEMENTS", 100)
    for i in range(20):
        following = f"s{i + 1}.ssd"
        put(folder, f"s{i}.ssd", system([reference(n, following, ports="") for n in "ab"]))
    put(folder, "s20.ssd", system([component("g", GAIN)]))
    path = write(folder, system([reference("first", "s0.ssd", ports="")]))
    assert any("more than 100 elements" in p for p in check(path))


def test_what_a_reference_may_not_be(folder):
    put(folder, "inner.ssd")
    wrong = {
        "none.ssd": "none.ssd does not exist",
        "inner.ssd#x": "source inner.ssd#x: a fragment needs a package",
        "http://a/b.ssd": "source http://a/b.ssd: only relative paths and file: URIs are supported",
    }
    for source, message in wrong.items():
        assert check(write(folder, system([reference("one", source)])))[0].split(" (")[0] == message
    path = write(folder, system([reference("one", "inner.ssd", ports="v< q> w<:Integer")]))
    assert [p.split(" (")[0] for p in check(path)] == [
        "connector one.v: is output, but input in the system",
        "connector one.q: the system it refers to has no such connector",
        "connector one.w: has another type or unit in the system it refers to",
    ]
    archive = pack(path, folder / "a.ssp", {"inner.ssd": folder / "inner.ssd"})
    assert "FMU CosimGain.fmu does not exist" in check(archive)[-1]


def test_a_component_without_a_source_is_an_empty_system(folder):
    empty = component("none", "", "u> y<").replace(' source=""', "")
    path = write(folder, system([empty, component("g", GAIN, "y<")], [connection("g.y -> none.u")]), version="2.0")
    with load(path) as loaded:
        assert [w.split(" (")[0] for w in loaded.warnings] == [
            "component none has no source: an empty system",
            "connector none.y of the system is not connected and not recorded",
        ]
    path = write(folder, system([empty, component("g", GAIN, "u>")], [connection("none.y -> g.u")]), version="2.0")
    assert [p.split(" (")[0] for p in check(path)] == ["none.y → g.u: nothing feeds none.y"]
    empty = component("none", "", "u> y<")
    assert check(write(folder, system([empty]), version="2.0"))[0].startswith("Component has no source")


@pytest.mark.parametrize("archived", [True, False])
def test_one_of_several_descriptions(folder, archived):
    variant = system([component("g", GAIN, "y<", bind({"k": ("Real", 8)}))])
    shutil.move(write(folder, variant), folder / "VariantB.ssd")
    path = write(folder, system([component("g", GAIN, "y<")]))
    where = pack(path, folder / "s.ssp", {GAIN: folder / GAIN, "VariantB.ssd": folder / "VariantB.ssd"})
    where = where if archived else folder
    for ssd, expected in ((None, 1.0), ("SystemStructure.ssd", 1.0), ("VariantB.ssd", 4.0), ("VariantB", 4.0)):
        with load(where, ssd=ssd) as loaded:
            assert simulate(loaded, step_size=0.5).values["g.y"] == expected
            assert loaded.provenance()["system"].get("ssd") == (None if ssd is None else loaded.file)
    with pytest.raises(TwipError) as failure:
        load(where, ssd="VariantC")
    assert str(failure.value).endswith("holds no VariantC, only SystemStructure.ssd, VariantB.ssd")
    with pytest.raises(TwipError, match="is one description"):
        load(path, ssd="VariantB")


def test_the_command_line_chooses_a_description_and_names_the_log_by_it(folder, monkeypatch, capsys):
    shutil.move(write(folder, system([component("g", GAIN, "y<", bind({"k": ("Real", 8)}))])), folder / "VariantB.ssd")
    path = write(folder, system([component("g", GAIN, "y<")]))
    pack(path, folder / "s.ssp", {GAIN: folder / GAIN, "VariantB.ssd": folder / "VariantB.ssd"})
    monkeypatch.chdir(folder)
    assert main(["run", "s.ssp", "--ssd", "VariantB", "--step-size", "0.5", "--output-file", "b.csv"]) == 0
    assert (folder / "logs" / "s-VariantB.mcap").is_file()
    assert (folder / "b.csv").read_text().splitlines()[-1].split(",")[1:] == ["4.0", "-0.5"]
    for command in ("run", "check"):
        assert main([command, "s.ssp", "--ssd", "C", "--step-size", "0.5"]) == 1
        assert "the archive holds no C, only SystemStructure.ssd, VariantB.ssd" in capsys.readouterr().err
    assert main(["check", "s.ssp", "--ssd", "VariantB", "--step-size", "0.5"]) == 0
    assert main(["parameters", "s.ssp", "--ssd", "VariantB"]) == 0
    assert capsys.readouterr().out.split()[-2:] == ["g.k", "8.0"]


def test_sources_by_file_uri_and_by_relative_uri(folder):
    (folder / "fmus ä").mkdir()
    shutil.copy(folder / GAIN, folder / "fmus ä" / "g.fmu")
    for source in ("fmus%20%C3%A4/g.fmu", "./fmus%20ä/g.fmu", (folder / "fmus ä" / "g.fmu").as_uri()):
        path = write(folder, system([component("g", source, "y<")]))
        with load(path) as loaded:
            assert simulate(loaded, step_size=0.5).values["g.y"] == 1.0
    for source in ("file://elsewhere/g.fmu", "g.fmu?x=1", "ftp://a/g.fmu", "fmus%00/g.fmu", "%ff.fmu", "g.fmu#x"):
        assert len(check(write(folder, system([component("g", source)])))) == 1
    path = write(folder, system([component("g", (folder / GAIN).as_uri())]))
    assert "leads out of the archive" in check(pack(path, folder / "s.ssp", {GAIN: folder / GAIN}))[0]


def test_units_with_offsets_on_the_way_into_a_system(folder, loop):
    inner = system([component("g", GAIN, "u>[degC] y<")], [connection("v -> g.u")], "v>[K]", name="inner")
    text = "K K=1; degC K=1 offset=273.15; degF K=1 factor=0.5555555555555556 offset=255.3722222222222"
    body = system([inner], [connection("x -> inner.v")], "x>[degF]")
    path = write(folder, body, tail=units(text) + '<ssd:DefaultExperiment stopTime="1"/>')
    with load(path, start_values={"x": 212.0}) as loaded:
        values = simulate(loaded, step_size=0.5, runtime=Runtime(loop=loop)).values
    assert values["inner.v"] == pytest.approx(373.15, rel=1e-15)
    # 100 degC is the difference of two numbers near 373: 4 roundings of these
    assert values["inner.g.u"] == pytest.approx(100.0, abs=4 * math.ulp(373.15))
