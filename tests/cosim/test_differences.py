"""Differences (`relativeQuantity`): 10 °C more is 10 K more, not 283.15 K, wherever a unit is converted."""

import zipfile

import fmpy
import pytest
from echo_fmu import compiled, echo3_description
from lxml import etree
from ssp_writer import bind, component, connection, edit_fmu, linear, parameter_set, system, units, write

from twip.cli import main
from twip.cosim import Inputs, Runtime, check, load, simulate
from twip.cosim.fmus.description import read_fmu
from twip.cosim.reading.problems import Place, Problems

CELSIUS = "degC K=1 offset=273.15"
FAHRENHEIT = "degF K=1 factor=0.5555555555555556 offset=255.3722222222222"
KNOWN = f"{CELSIUS}; {FAHRENHEIT}; K K=1"
TAIL = f'{units(f"{CELSIUS}; K K=1")}<ssd:DefaultExperiment startTime="0" stopTime="1"/>'


def gain(folder, name, unit, relative=True):
    """Write an FMU `y = k u`, all of them in `unit`."""
    about = {"unit": unit, **({"relativeQuantity": "true"} if relative else {})}
    variables = dict.fromkeys(("u", "k", "y"), about)
    return edit_fmu(folder / "CosimGain.fmu", folder / name, variables=variables, definitions=KNOWN).name


@pytest.fixture
def gains(folder):
    """The folder with a gain for each unit: differences in `dC.fmu` …, others in `C.fmu` …"""
    for name, unit in (("C", "degC"), ("F", "degF"), ("K", "K")):
        gain(folder, f"d{name}.fmu", unit)
        gain(folder, f"{name}.fmu", unit, relative=False)
    return folder


def place(path, text):
    line = next(i for i, line in enumerate(path.read_text().splitlines(), 1) if text in line)
    return f"(SystemStructure.ssd line {line})"


@pytest.mark.parametrize(
    ("source", "target", "expected"),
    [("dC", "dK", 10.0), ("dK", "dC", 10.0), ("dC", "dF", 18.0), ("C", "K", 283.15), ("C", "F", 50.0)],
)
def test_a_connection_converts_a_difference_without_offset(gains, source, target, expected, loop):
    parts = [component("a", f"{source}.fmu", "y<", bind({"k": ("Real", 2), "u": ("Real", 5)}))]
    parts.append(component("b", f"{target}.fmu", "u>"))
    path = write(gains, system(parts, [connection("a.y -> b.u")]))
    result = simulate(load(path), step_size=0.5, runtime=Runtime(loop=loop))
    assert result["b.u"].tolist() == pytest.approx([expected] * 3, rel=1e-15)
    assert result.warnings == ()


def test_values_and_time_series_in_another_unit(gains):
    """A set in °C, a connector in °C with a start value, and a table over time for it."""
    (gains / "set.ssv").write_text(parameter_set({"a.k": ("Real", 10, "degC")}, units(CELSIUS, "ssv")))
    inner = system([component("b", "dK.fmu", "u>")], [connection("w -> b.u")], "w>:Real[degC]", name="inner")
    body = system([component("a", "dK.fmu", "u>"), inner], [connection("v -> inner.w"), connection("t -> a.u")],
                  "v>:Real[K] t>:Real[degC]", bind(source="set.ssv"))  # fmt: skip
    path = write(gains, body, tail=TAIL)
    (gains / "in.csv").write_text("time,t\n0,10\n1,20\n")
    system_ = load(path, start_values={"v": 7.0})
    assert [(s.variable.name, s.value) for s in system_.components[0].start_values] == [("k", 10.0)]
    result = simulate(system_, step_size=0.5, runtime=Runtime(loop="python"), inputs=Inputs(file=gains / "in.csv"))
    assert result["a.u"].tolist() == [10.0, 10.0, 15.0]
    assert result["inner.w"].tolist() == [7.0] * 3
    assert result["inner.b.u"].tolist() == [7.0] * 3


def test_a_value_given_to_what_a_component_feeds(folder):
    about = {"unit": "K", "relativeQuantity": "true"}
    edit_fmu(folder / "CosimGain.fmu", folder / "g.fmu", definitions="K K=1",
             variables={"y": {"initial": "exact", "start": "0", **about}})  # fmt: skip
    body = system([component("a", "g.fmu", "y<")], [connection("a.y -> o")], "o<:Real[degC]", bind({"o": ("Real", 3)}))
    (start,) = load(write(folder, body, tail=TAIL)).components[0].start_values
    assert (start.variable.name, start.value) == ("y", 3.0)


def test_one_end_a_difference_is_refused_where_offsets_count(gains):
    wires = [connection("a.y -> b.u"), connection("c.y -> o"), connection("o2 -> d.u")]
    parts = [component("a", "dC.fmu", "y<"), component("b", "K.fmu", "u>"), component("c", "dC.fmu", "y<")]
    parts.append(component("d", "K.fmu", "u>"))
    path = write(gains, system(parts, wires, "o<:Real[K] o2>:Real[degC]"), tail=TAIL)
    assert check(path) == [
        "a.y [degC] → b.u [K]: a.y is a difference (relativeQuantity), b.u is not, and the units have offsets "
        + place(path, 'startElement="a"')
    ]
    through = [connection("a.y -> inner.v")]
    inner = system([component("b", "C.fmu", "u>")], [connection("v -> b.u")], "v>:Real[K]", name="inner")
    path = write(gains, system([component("a", "dK.fmu", "y<"), inner], through), tail=TAIL)
    assert check(path) == [
        "inner.v [K] → inner.b.u [degC]: a.y is a difference (relativeQuantity), inner.b.u is not, and the units have"
        f" offsets {place(path, 'startConnector=' + chr(34) + 'v')}"
    ]


def test_one_end_a_difference_is_warned_of_where_the_value_is_the_same(gains):
    """Many tools leave the attribute out."""
    parts = [component("a", "K.fmu", "y<"), component("b", "dK.fmu", "u>"), component("c", "dC.fmu", "y<")]
    parts.append(component("d", "K.fmu", "u>"))
    moved = connection("c.y -> d.u", linear(offset=293.15), suppressUnitConversion="true")
    path = write(gains, system(parts, [connection("a.y -> b.u"), moved]), tail=TAIL)
    first = place(path, 'startElement="a')
    assert load(path).warnings == (
        f"a.y [K] → b.u [K]: b.u is a difference (relativeQuantity), a.y is not {first}",
        f"c.y [degC] → d.u [K]: c.y is a difference (relativeQuantity), d.u is not {place(path, 'suppress')}",
    )  # fmt: skip


def test_a_connector_for_differences_and_others_is_warned_of(gains):
    parts = [component("a", "K.fmu", "u>"), component("b", "dK.fmu", "u>")]
    path = write(gains, system(parts, [connection("t -> a.u"), connection("t -> b.u")], "t>:Real[degC]"), tail=TAIL)
    loaded = load(path, start_values={"t": 10.0})
    second = place(path, 'endElement="b')
    assert loaded.warnings == (
        f"t feeds b.u, a difference (relativeQuantity), and a.u, which is none {second}",
    )  # fmt: skip
    assert simulate(loaded, step_size=0.5, runtime=Runtime(loop="python"))["b.u"].tolist() == [10.0] * 3


def test_swaps(gains):
    parts = [component("a", "dC.fmu", "y<"), component("b", "dC.fmu", "u> y<"), component("c", "dC.fmu", "u>")]
    path = write(gains, system(parts, [connection("a.y -> b.u"), connection("b.y -> c.u")]), tail=TAIL)
    assert check(path, swap={"b": gains / "dK.fmu"}) == []
    result = simulate(
        load(path, start_values={"a.u": 5.0}, swap={"b": gains / "dK.fmu"}),
        step_size=0.5,
        runtime=Runtime(loop="python"),
    )
    assert result["b.u"].tolist() == [10.0] * 3
    told = [line.split(", which ")[0] for line in check(path, swap={"b": gains / "K.fmu"})]
    said = "is a difference (relativeQuantity) in the system, not in"
    assert told == [f"swap b: {name} {said} {gains / 'K.fmu'}, and the units have offsets" for name in "uy"]
    warned = load(path, swap={"b": gains / "C.fmu"}).warnings
    assert warned[:2] == tuple(f"swap b: {name} {said} {gains / 'C.fmu'}" for name in "uy")


def test_fmi_3_says_it_of_a_type_or_of_a_variable(tmp_path, capsys):
    library = compiled("echo3", tmp_path)
    types = '<Float64Type name="dT" unit="degC" relativeQuantity="true"/><Float32Type name="d" relativeQuantity="1"/>'
    text = echo3_description().replace("<TypeDefinitions>", f"<TypeDefinitions>{types}")
    text = text.replace('name="u"', 'name="u" declaredType="dT"')
    text = text.replace('name="in_Float64"', 'name="in_Float64" unit="K" relativeQuantity="true"')
    text = text.replace('name="out_Float64"', 'name="out_Float64" declaredType="dT" relativeQuantity="false"')
    text = text.replace('name="ins_Float32"', 'name="ins_Float32" declaredType="d"')
    with zipfile.ZipFile(tmp_path / "e.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", text)
        archive.write(library, f"binaries/{fmpy.platform_tuple}/{library.name}")
    fmu = read_fmu(tmp_path / "e.fmu", "e.fmu", Problems(), Place("test"))
    relative = [name for name, variable in fmu.variables.items() if variable.relative]
    assert relative == ["u", "in_Float64", "ins_Float32[1]", "ins_Float32[2]", "ins_Float32[3]"]
    path = write(tmp_path, system([component("a", "e.fmu", "u>")], [connection("t -> a.u")], "t>:Real[K]"), tail=TAIL)
    result = simulate(load(path, start_values={"t": 10.0}), step_size=0.5, runtime=Runtime(loop="python"))
    assert result["a.u"].tolist() == [10.0] * 3
    assert main(["check", str(tmp_path / "e.fmu")]) == 0
    assert "0 degC, Real, continuous, a difference" in capsys.readouterr().out


def test_fmi_2_says_it_of_a_type_or_of_a_variable(folder):
    gain(folder, "g.fmu", "degC")
    with zipfile.ZipFile(folder / "g.fmu") as archive:
        root = etree.fromstring(archive.read("modelDescription.xml"))
        contents = {name: archive.read(name) for name in archive.namelist()}
    types = etree.fromstring(
        '<TypeDefinitions><SimpleType name="dT"><Real unit="degC" relativeQuantity="true"/></SimpleType>'
        "</TypeDefinitions>"
    )
    root.insert(2, types)
    for name, given in (("u", {"declaredType": "dT"}), ("k", {"declaredType": "dT", "relativeQuantity": "0"})):
        (real,) = root.xpath(f"//ScalarVariable[@name='{name}']/Real")
        real.attrib.clear()
        real.attrib.update({"start": "1", **given})
    contents["modelDescription.xml"] = etree.tostring(root)
    with zipfile.ZipFile(folder / "h.fmu", "w") as archive:
        for name, data in contents.items():
            archive.writestr(name, data)
    problems = Problems()
    fmu = read_fmu(folder / "h.fmu", "h.fmu", problems, Place("test"))
    assert problems.lines == []
    assert {name: (v.unit.name if v.unit else None, v.relative) for name, v in fmu.variables.items()} == {
        "u": ("degC", True), "k": ("degC", False), "y": ("degC", True), "z": (None, False),
    }  # fmt: skip
