"""A parameter set against what it is applied to: shapes, and units and enumerations that one side does not know."""

import pytest
from ssp_writer import bind, component, connector, edit_fmu, enumerations, line_of, parameter_set, system, units, write

from twip.cli import main
from twip.cosim import check, load

TAIL = '<ssd:DefaultExperiment stopTime="1"/>'
N, ON = 'name="n"', 'value="on"'
SIX = "1 2 3 4 5 6"


def write_set(folder, values, dimensions=""):
    text = parameter_set(values).replace('version="1.0"', 'version="2.0"')
    (folder / "set.ssv").write_text(text.replace("</ssv:Parameter>", f"{dimensions}</ssv:Parameter>", 1))
    return folder / "set.ssv"


def bound(folder, ports="", more="", tail=TAIL, fmu="CosimGain.fmu"):
    return write(folder, system([component("a", fmu, ports, bind(source="set.ssv"))], inside=more), tail=tail)


@pytest.mark.parametrize(
    ("name", "text", "sizes", "said"),
    [
        ("u", SIX, (3, 2), "3 x 2, but a.u is 2 x 3"),
        ("u", "1 2 3 4", (2, 2), "2 x 2, but a.u is 2 x 3"),
        ("u", SIX, (6,), "6, but a.u is 2 x 3"),
        ("u", "1", (), "a scalar, but a.u is 2 x 3"),
        ("u[1,1]", "1 2", (2,), "2, but a.u[1,1] is a scalar"),
        ("u", SIX, (2, 3), None),
        ("u[1,1]", "1", (), None),
    ],
)
def test_an_array_parameter_has_the_shape_of_its_variable(folder, name, text, sizes, said):
    dimensions = "".join(f'<ssc:Dimension size="{n}"/>' for n in sizes)
    file = write_set(folder, {name: ("Float64", text)}, dimensions)
    path = write(folder, system([component("a", "CosimArray.fmu", "", bind(source="set.ssv"))]), version="2.0")
    place = f"set.ssv line {line_of(file, 'Float64')}"
    assert check(path) == ([] if said is None else [f"parameter {name} is {said} ({place})"])
    alone = write(folder, system([component("a", "CosimArray.fmu")]), version="2.0")
    file.write_text(file.read_text().replace(f'name="{name}"', f'name="a.{name}"'))
    assert check(alone, parameters=file) == ([] if said is None else [f"parameter a.{name} is {said} ({place})"])


def test_an_array_parameter_of_a_system_has_the_shape_of_its_connector(folder):
    port = connector("v", "parameter").replace("/></", '/><ssc:Dimension size="2"/></')
    bindings = bind(source="set.ssv")
    body = system([component("a", "CosimGain.fmu")], inside=f"<ssd:Connectors>{port}</ssd:Connectors>{bindings}")
    path = write(folder, body, version="2.0")
    file = write_set(folder, {"v": ("Real", "1 2 3")}, '<ssc:Dimension size="3"/>')
    assert check(path) == [f"parameter v is 3, but v is 2 (set.ssv line {line_of(file, 'ssv:Real')})"]


def test_a_unit_on_the_side_of_the_value_only_is_warned_of(folder):
    file = write_set(folder, {"k": ("Real", 3, "m"), "u": ("Real", 1, "m"), "n": ("Real", 1, "m")})
    file.write_text(file.read_text().replace("</ssv:ParameterSet>", f"{units('m m=1', 'ssv')}</ssv:ParameterSet>"))
    assert load(bound(folder)).warnings == (
        f"unknown parameter n is ignored (component a, set.ssv line {line_of(file, N) + 1})",
        "a variable without unit takes the value as it is: a.k [m], a.u [m] (component a, set.ssv line 3)",
    )
    # the unit of its connector counts as the variable's
    path = bound(folder, "u>:Real[mm]", tail=units("mm m=1 factor=0.001") + TAIL)
    (value,) = [s.value for s in load(path).components[0].start_values if s.variable.name == "u"]
    assert value == 1000.0
    assert "a.u" not in "".join(load(path).warnings)


def test_a_unit_or_enumeration_without_definition_is_named_in_the_file_itself(folder, capsys):
    file = write_set(folder, {"k": ("Real", 3, "ell"), "mode": ("Enumeration", "on")})
    text = file.read_text().replace('value="on"', 'value="on" name="Mode"')
    file.write_text(text)
    told = f"parameter mode: enumeration Mode has no definition (set.ssv line {line_of(file, ON)})"
    assert check(bound(folder)) == [told]
    file.write_text(text.replace("</ssv:ParameterSet>", enumerations("ssv", Mode={"on": 1}) + "</ssv:ParameterSet>"))
    warned = f"unit ell has no definition in the file (set.ssv line {line_of(file, 'ell')})"
    assert warned in load(bound(folder)).warnings
    assert main(["check", str(file)]) == 0
    assert warned in capsys.readouterr().out


def test_a_set_inside_a_description_may_use_its_units_and_enumerations(folder):
    mode = {"off": 0, "on": 1}
    edit_fmu(folder / "CosimMixed.fmu", folder / "e.fmu", enums={"n": mode})
    values = bind({"n": ("Enumeration", "on"), "smooth": ("Real", 2, "ell")})
    body = system([component("a", "e.fmu", "", values.replace('value="on"', 'value="on" name="Mode"'))])
    path = write(folder, body, tail=enumerations(Mode=mode) + units("ell m=1") + TAIL)
    assert [w for w in load(path).warnings if "definition" in w] == []
    assert len(check(write(folder, body))) == 1
