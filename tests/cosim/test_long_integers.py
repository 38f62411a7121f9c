"""Integers that float64 does not hold: a parameter gets them digit by digit, what travels in the vector is refused."""

import pytest
from echo_fmu import compiled, echo3_description, pack
from flat_options import grouped
from fmpy import platform_tuple
from ssp_writer import bind, component, connection, connectors, mapping, parameter_set, system, write

from twip.cosim import Inputs, Runtime, check, load, simulate
from twip.errors import TwipError

LONG = 2**53 + 1
WHY = "which is beyond ±2^53, where float64 no longer holds every integer"
LOW = '<UInt8 name="low" valueReference="8" causality="output"/>'
KNOWN = '<Output valueReference="8"/>'


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    return compiled("echo3", tmp_path_factory.mktemp("library"))


@pytest.fixture
def place(library, tmp_path):
    """A folder with `input.fmu`, whose in_Int64 is an input, and `tunable.fmu`, where it is a tunable parameter that is
    seen through its last 8 bits alone.
    """
    text = echo3_description(variables=LOW, structure=f'{KNOWN}<InitialUnknown valueReference="8"/>')
    pack(tmp_path / "input.fmu", library, text, platform_tuple)
    text = text.replace('valueReference="901" causality="input"', 'valueReference="901" causality="parameter"')
    text = text.replace('valueReference="911" causality="output"', 'valueReference="911" causality="local"')
    text = text.replace('<Output valueReference="911" dependencies="901"/>', "")
    text = text.replace('<InitialUnknown valueReference="911" dependencies="901"/>', "")
    text = text.replace('name="in_Int64" value', 'name="in_Int64" variability="tunable" value')
    pack(tmp_path / "tunable.fmu", library, text, platform_tuple)
    return tmp_path


@pytest.fixture
def driven(place):
    return write(place, system([component("a", "input.fmu")]))


@pytest.fixture
def tuned(place):
    return write(place, system([component("a", "tunable.fmu")]))


def wrong(path, name="", text="", **options):
    """Return what a run refuses, after writing a file that the options name."""
    if name:
        (path.parent / name).write_text(text)
    with pytest.raises(TwipError) as raised, load(path, **options.pop("load", {})) as model:
        simulate(model, step_size=0.25, **grouped(**options))
    return str(raised.value).splitlines()


@pytest.mark.parametrize("written", ["9007199254740993", "-9007199254740993.0", "9.007199254740993e15"])
def test_a_row_of_a_file_is_refused_with_its_place(driven, written):
    lines = wrong(driven, "u.csv", f"time,a.in_Int64\n0,1\n1,{written}\n", input_file=driven.parent / "u.csv")
    assert lines == [f"a.in_Int64 cannot take {written}, {WHY} (u.csv line 3)"]


@pytest.mark.parametrize("written", ["9007199254740993", "9_007_199_254_740_993.0"])
def test_a_row_of_a_scenario_is_refused_with_its_place(driven, written):
    text = f'[inputs]\n"a.in_Int64" = [[0.0, 1], [1.0, {written}]]\n'
    lines = wrong(driven, "s.toml", text, scenario=driven.parent / "s.toml")
    assert lines == [f"inputs.a.in_Int64[1] cannot take {written.replace('_', '')}, {WHY} (s.toml line 2)"]


def test_a_fault_is_refused_with_its_place(place):
    parts = [component("a", "input.fmu"), component("b", "input.fmu")]
    both = [c.replace("</ssd:Component>", f"{connectors('in_Int64> out_Int64<')}</ssd:Component>") for c in parts]
    path = write(place, system(both, [connection("a.out_Int64 -> b.in_Int64")]))
    text = f'[[faults]]\nsignal = "b.in_Int64"\nkind = "stuck"\nvalue = {LONG}\n'
    lines = wrong(path, "s.toml", text, scenario=place / "s.toml")
    assert lines == [f"faults[0].value: {LONG} cannot be taken, {WHY} (s.toml line 4)"]


@pytest.mark.parametrize("value", [LONG, str(LONG), f"{LONG}.0"])
def test_a_start_value_of_an_input_is_refused(driven, value):
    said = f"in_Int64 cannot be set: {LONG} is a value {WHY} (component a, start values)"
    assert check(driven, start_values={"a.in_Int64": value}) == [said]


def test_a_start_value_of_an_input_in_a_file_is_refused(place):
    path = write(place, system([component("a", "input.fmu", inside=bind({"in_Int64": ("Integer", 7)}))]))
    text = path.read_text().replace('version="1.0"', 'version="2.0"')
    path.write_text(text.replace('<ssv:Integer value="7"/>', f'<ssv:Int64 value="{LONG}"/>'))
    assert [line.partition(" (")[0] for line in check(path)] == [f"in_Int64 cannot be set: {LONG} is a value {WHY}"]


def test_a_connector_of_the_system_is_refused(place):
    part = component("a", "input.fmu", "in_Int64>")
    path = write(place, system([part], [connection("n -> a.in_Int64")], "n>"))
    assert check(path, start_values={"n": LONG}) == [f"n cannot be set: {LONG} is a value {WHY} (start values)"]


def test_the_fmus_own_start_value_is_refused_before_anything_runs(place, library):
    before = 'valueReference="901" causality="input" start='
    text = echo3_description().replace(f'{before}"0"', f'{before}"{LONG}"')
    pack(place / "own.fmu", library, text, platform_tuple)
    path = write(place, system([component("a", "own.fmu")]))
    assert check(path) == [f"a.in_Int64 begins with {LONG} in own.fmu, {WHY}"]


def test_a_mapping_on_a_connection_is_refused(place):
    parts = [component("a", "input.fmu", "out_Int8<"), component("b", "input.fmu", "in_Int64>")]
    table = mapping("Integer", {1: LONG, 2: 2**53})
    path = write(place, system(parts, [connection("a.out_Int8 -> b.in_Int64", table)]), version="2.0")
    assert [line.partition(" (")[0] for line in check(path)] == [
        f"a.out_Int8 → b.in_Int64: {LONG} cannot travel, {WHY}"
    ]


@pytest.mark.parametrize("value", [LONG, str(LONG), f"{LONG}.0", "9.007199254740993e15"])
def test_a_parameter_gets_every_digit(tuned, loop, value):
    with load(tuned, start_values={"a.in_Int64": value}) as model:
        assert simulate(model, step_size=0.25, runtime=Runtime(loop=loop))["a.low"].tolist() == [1] * 5


def test_a_parameter_set_gives_every_digit(tuned):
    text = parameter_set({"a.in_Int64": ("Int64", LONG)}).replace('version="1.0"', 'version="2.0"')
    (tuned.parent / "p.ssv").write_text(text)
    with load(tuned, parameters=[tuned.parent / "p.ssv"]) as model:
        assert simulate(model, step_size=0.25)["a.low"][-1] == 1


@pytest.mark.parametrize("entries", [None, {5: LONG}])
def test_a_parameter_of_the_system_keeps_every_digit_on_its_way(place, entries):
    part = component("a", "tunable.fmu", "in_Int64*")
    table = "" if entries is None else mapping("Integer", entries)
    path = write(place, system([part], [connection("k -> a.in_Int64", table)], "k*"), version="2.0")
    if entries is not None:
        assert f"{LONG} cannot travel" in "".join(check(path))
        return
    with load(path, start_values={"k": LONG}) as model:
        assert simulate(model, step_size=0.25)["a.low"][-1] == 1


@pytest.mark.parametrize("written", [str(LONG), f"{LONG}.0"])
def test_a_change_of_a_parameter_keeps_every_digit(tuned, loop, written):
    text = f'[[parameters]]\ntime = 0.5\nname = "a.in_Int64"\nvalue = {written}\n'
    (tuned.parent / "s.toml").write_text(text)
    with load(tuned) as model:
        result = simulate(
            model, step_size=0.25, runtime=Runtime(loop=loop), inputs=Inputs(scenario=tuned.parent / "s.toml")
        )
    assert result["a.low"].tolist() == [0, 0, 0, 1, 1]


def test_bounds_of_long_integers_are_exact(place, library):
    text = echo3_description().replace('name="in_Int64" ', f'name="in_Int64" min="-{LONG}" max="{LONG}" ')
    text = text.replace('valueReference="901" causality="input"', 'valueReference="901" causality="parameter"')
    pack(place / "bounded.fmu", library, text, platform_tuple)
    path = write(place, system([component("a", "bounded.fmu")]))
    assert check(path, start_values={"a.in_Int64": LONG}) == []
    said = f"in_Int64 = {LONG + 1} must be at most {LONG} (component a, start values)"
    assert check(path, start_values={"a.in_Int64": LONG + 1}) == [said]
