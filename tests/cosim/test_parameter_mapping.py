"""Parameter bindings: prefixes, mappings with transformations, units, precedence, and where sets may stand."""

import math
import zipfile

import pytest
from ssp_writer import (
    bind,
    component,
    connection,
    edit_fmu,
    enumerations,
    linear,
    mapping,
    parameter_mapping,
    parameter_set,
    system,
    units,
    write,
)

from twip.cosim import Runtime, Table, check, load, simulate

GAIN, MIXED = "CosimGain.fmu", "CosimMixed.fmu"
UNITS = f"rad rad=1; deg rad=1 factor={math.pi / 180!r}; K K=1; degC K=1 offset=273.15"


def started(path, **loading):
    """Return what the system starts with, by `component.variable`, and its warnings."""
    with load(path, **loading) as loaded:
        values = {f"{c.name}.{s.variable.name}": s.value for c in loaded.components for s in c.start_values}
        return values, [w.split(" (")[0] for w in loaded.warnings]


def of_gain(folder, inside, gain=GAIN):
    return write(folder, system([component("g", gain)], inside=inside))


def in_kelvin(folder):
    return edit_fmu(folder / GAIN, folder / "kelvin.fmu", variables={"k": {"unit": "K"}}, definitions=UNITS).name


def test_a_mapping_applies_only_what_it_names_by_the_name_it_gives(folder, loop):
    entries = parameter_mapping([("gain", "g.k"), ("gain", "g.u"), ("missing", "g.z")])
    path = of_gain(folder, bind({"gain": ("Real", 3), "g.k": ("Real", 7)}, mapped=entries))
    assert started(path) == ({"g.k": 3.0, "g.u": 3.0}, ["the parameter set has no missing to map"])
    with load(path) as loaded:
        table = Table(loaded.channels)
        simulate(loaded, sinks=[table], step_size=0.5, runtime=Runtime(loop=loop))
    assert table["g.y"].tolist() == [9.0] * 3


def test_the_prefix_belongs_to_the_names_that_a_mapping_maps(folder):
    values = {"gain": ("Real", 3)}
    assert started(of_gain(folder, bind(values, prefix="p.", mapped=parameter_mapping([("p.gain", "g.k")]))))[0] == {
        "g.k": 3.0
    }
    assert started(of_gain(folder, bind(values, prefix="p.", mapped=parameter_mapping([("gain", "g.k")])))) == (
        {},
        ["the parameter set has no gain to map"],
    )


@pytest.mark.parametrize(
    ("value", "more", "expected"),
    [
        (("Real", 10, "degC"), (), 283.15),
        (("Real", 10, "degC"), (linear(2, 1),), 2 * 283.15 + 1),
        (("Real", 10, "degC"), (linear(2, 1), ' suppressUnitConversion="true"'), 21.0),
        (("Integer", 10), (linear(2, 1),), 21.0),
    ],
)
def test_units_come_first_then_the_linear_transformation(folder, value, more, expected):
    (folder / "set.ssv").write_text(parameter_set({"t": value}, units(UNITS, "ssv")))
    (folder / "map.ssm").write_text(parameter_mapping([("t", "g.k", *more)]))
    path = of_gain(folder, bind(source="set.ssv", mapped="map.ssm"), in_kelvin(folder))
    # degC to K: two roundings, the transformation two more
    assert started(path)[0]["g.k"] == pytest.approx(expected, rel=4 * 2**-52)


@pytest.mark.parametrize(
    ("target", "written", "transformation", "expected"),
    [
        ("on", ("Boolean", "true"), mapping("Boolean", {"true": "false"}), False),
        ("on", ("Boolean", "false"), mapping("Boolean", {"true": "false"}), False),
        ("n", ("Integer", 2), mapping("Integer", {2: 20}), 20),
        ("n", ("Integer", 5), mapping("Integer", {2: 20}), 5),
        ("mode", ("Enumeration", "low"), "", 1),
        ("mode", ("Enumeration", "slow"), mapping("Enumeration", {"slow": "low"}), 1),
        ("mode", ("Enumeration", "high"), mapping("Enumeration", {"slow": "low"}), 8),
        ("mode", ("Enumeration", "low"), mapping("Integer", {1: 8}), 8),
        ("mode", ("Integer", 40), mapping("Integer", {40: 8}), 8),
        ("mode", ("Integer", 8), mapping("Integer", {40: 1}), 8),
    ],
)
def test_discrete_values_through_a_mapping(folder, target, written, transformation, expected):
    fmu = MIXED
    if target == "mode":
        fmu = edit_fmu(folder / MIXED, folder / "e.fmu", enums={"n": {"low": 1, "high": 8}}).name
    name = "n" if target == "mode" else target
    binding = bind({"p": written}, mapped=parameter_mapping([("p", f"m.{name}", transformation)]))
    assert started(write(folder, system([component("m", fmu)], inside=binding)))[0] == {f"m.{name}": expected}


@pytest.mark.parametrize(
    ("entries", "message"),
    [
        (
            [("p", "g.k", mapping("Boolean", {"true": "false"}))],
            "a boolean mapping needs Boolean values, not Real",
        ),
        ([("p", "g.k"), ("q", "g.k")], "two parameters are mapped to g.k"),
        ([("p", "g.y")], "y cannot be set: it is a continuous output"),
    ],
)
def test_mappings_that_make_no_sense(folder, entries, message):
    path = of_gain(folder, bind({"p": ("Real", 1), "q": ("Real", 2)}, mapped=parameter_mapping(entries)))
    assert [p.split(" (")[0].removeprefix("k: ") for p in check(path)] == [message]


def test_a_large_set_of_which_little_is_used_is_one_warning(folder):
    many = {f"other.p{i}": ("Real", i) for i in range(20_000)}
    values, warnings = started(of_gain(folder, bind({**many, "g.k": ("Real", 3)})))
    assert values == {"g.k": 3.0}
    named = ", ".join(f"other.p{i}" for i in range(10))
    assert warnings == [f"unknown parameters {named} and 19990 more are ignored"]


def test_a_mapping_file_that_is_missing_or_something_else(folder):
    (folder / "map.ssm").write_text("<a/>")
    values = {"g.k": ("Real", 1)}
    assert [p.split(" (")[0] for p in check(of_gain(folder, bind(values, mapped="no.ssm")))] == [
        "no.ssm: No such file or directory"
    ]
    assert check(of_gain(folder, bind(values, mapped="map.ssm"))) == [
        "expected a ParameterMapping, found a (map.ssm line 1)"
    ]
    (folder / "map.ssm").write_text(parameter_mapping([("a", "b")]).replace('target="b"', 'goal="b"'))
    assert "goal" in check(of_gain(folder, bind(values, mapped="map.ssm")))[0]


@pytest.mark.parametrize("unpacked", [False, True])
def test_a_set_and_a_mapping_inside_the_component(folder, unpacked):
    files = {
        "extra/set.ssv": parameter_set({"gain": ("Real", 5)}).encode(),
        "extra/map.ssm": parameter_mapping([("gain", "k")]).encode(),
    }
    fmu = edit_fmu(folder / GAIN, folder / "own.fmu", files=files)
    if unpacked:
        with zipfile.ZipFile(fmu) as archive:
            archive.extractall(folder / "own")
        fmu = folder / "own"
    binding = bind(source="extra/set.ssv", base="component", mapped="x").replace(
        'source="x"', 'source="extra/map.ssm" sourceBase="component"'
    )
    assert started(write(folder, system([component("g", fmu.name, "", binding)])))[0] == {"g.k": 5.0}
    for source in ("../set.ssv", "/set.ssv", "extra/none.ssv", "file:///etc/passwd", "%00", "extra"):
        problems = check(write(folder, system([component("g", fmu.name, "", bind(source=source, base="component"))])))
        assert len(problems) == 1, source
    assert check(of_gain(folder, bind(source="set.ssv", base="component")))[0].startswith(
        "a parameter binding with sourceBase component belongs to a component"
    )


def test_later_bindings_and_higher_systems_win_at_every_level(folder):
    def nested(*levels):
        own = bind({"k": ("Real", 1)}) if "component" in levels else ""
        if "later" in levels:
            later = bind({"k": ("Real", 2)})
            own = own.replace("</ssd:ParameterBindings>", later.replace("<ssd:ParameterBindings>", ""))
        middle = bind({"g.k": ("Real", 3)}) if "inner" in levels else ""
        inner = system([component("g", GAIN, "", own)], inside=middle, name="in")
        top = bind({"in.g.k": ("Real", 4)}) if "top" in levels else ""
        return started(write(folder, system([inner], inside=top)))[0]["in.g.k"]

    assert nested("component") == 1.0
    assert nested("component", "later") == 2.0
    assert nested("component", "later", "inner") == 3.0
    assert nested("component", "later", "inner", "top") == 4.0


def test_a_name_stands_for_every_variable_and_connector_it_fits(folder):
    # connector `g.k` of the system and variable k of component g
    wire = '<ssd:Connection startConnector="g.k" endElement="h" endConnector="k"/>'
    elements = [component("g", GAIN, "k*"), component("h", GAIN, "k*")]
    body = system(elements, [wire], "g.k*:Real", bind({"g.k": ("Real", 9)}))
    assert started(write(folder, body))[0] == {"g.k": 9.0, "h.k": 9.0}


def test_an_output_of_the_system_can_be_given_a_start_value(folder):
    started_output = {"y": {"initial": "exact", "start": "1"}}
    gain = edit_fmu(folder / GAIN, folder / "g.fmu", variables=started_output).name
    wires = [connection("g.y -> w", linear(2, 1))]
    path = write(folder, system([component("g", gain, "y<")], wires, "w<:Real", bind({"w": ("Real", 7)})))
    assert started(path)[0] == {"g.y": 3.0}
    path = write(folder, system([component("g", GAIN, "y<")], wires, "w<:Real", bind({"w": ("Real", 7)})))
    assert [p.split(" (")[0] for p in check(path)] == ["w cannot be set: no settable variable feeds it"]


def test_types_of_version_2_and_their_ranges(folder):
    good = {"g.k": ("Float32", "2.5"), "m.n": ("Int8", "-128"), "m.on": ("Boolean", "1"), "m.held": ("UInt16", 3)}
    elements = [component("g", GAIN), component("m", MIXED)]

    def values(given):
        text = parameter_set(given).replace('version="1.0"', 'version="2.0"')
        (folder / "set.ssv").write_text(text)
        return write(folder, system(elements, inside=bind(source="set.ssv")), version="2.0")

    assert started(values(good))[0] == {"g.k": 2.5, "m.n": -128, "m.on": True, "m.held": 3.0}
    for type_, text in (("Int8", "128"), ("UInt8", "-1"), ("UInt64", str(2**64)), ("Int32", str(2**31))):
        assert len(check(values({"m.n": (type_, text)}))) >= 1
    assert check(values({"m.n": ("Binary", "00")}))[0].startswith("parameter m.n: type Binary is not supported")


@pytest.mark.parametrize("schema", [True, False])
def test_ranges_are_checked_without_the_schemas_too(folder, monkeypatch, schema):
    if not schema:
        monkeypatch.setattr("twip.cosim.ssp.schemas.schema_folder", lambda _: None)
    text = parameter_set({"m.n": ("Int8", "200")}).replace('version="1.0"', 'version="2.0"')
    (folder / "set.ssv").write_text(text)
    path = write(folder, system([component("m", MIXED)], inside=bind(source="set.ssv")), version="2.0")
    problems = check(path)
    assert len(problems) == (2 if schema else 1)  # the schema tells it by attribute and by type
    assert all("200" in p and "set.ssv line 3" in p for p in problems)


def test_a_parameter_of_an_enumeration_that_the_file_defines(folder):
    fmu = edit_fmu(folder / MIXED, folder / "e.fmu", enums={"n": {"low": 1, "high": 8}}).name
    path = write(folder, system([component("m", fmu)], inside=bind(source="set.ssv")))
    text = parameter_set({"m.n": ("Enumeration", "high")}, enumerations("ssv", Mode={"low": 1, "high": 8}))
    (folder / "set.ssv").write_text(text.replace('value="high"/', 'value="high" name="Mode"/'))
    assert started(path)[0] == {"m.n": 8}
    (folder / "set.ssv").write_text(text.replace('value="high"/', 'value="middle" name="Mode"/'))
    assert [p.split(" (")[0] for p in check(path)] == [
        "parameter m.n = 'middle' is no item of enumeration Mode",
        "n = 'middle' must be an item of the enumeration",
    ]
