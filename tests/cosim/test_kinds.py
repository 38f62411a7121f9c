"""Which connectors may be connected, and what flows between the kinds other than input and output."""

import itertools

import pytest
from ssp_writer import bind, component, connection, connector, edit_fmu, linear, mapping, system, write

from twip.cosim import Algorithm, Runtime, Table, check, load, simulate
from twip.cosim.ssp.kinds import ALLOWED, gives, refusal

GAIN, MIXED = "CosimGain.fmu", "CosimMixed.fmu"


def run(path, loop="python", **loading):
    with load(path, **loading) as loaded:
        table = Table(loaded.channels)
        simulate(
            loaded,
            sinks=[table],
            step_size=0.5,
            algorithm=Algorithm(coupling="gauss-seidel"),
            runtime=Runtime(loop=loop),
        )
    return table


def with_kind(folder, name, kind, variable="y", **attributes):
    """Return a gain one of whose variables is of another kind."""
    more = {variable: {"causality": kind, **attributes}}
    if kind == "calculatedParameter":
        more[variable]["variability"] = "fixed"
    return edit_fmu(folder / GAIN, folder / name, variables=more, no_output=[variable]).name


def test_the_table_of_the_standard():
    ends = [
        (owner, kind)
        for owner in (True, False)
        for kind in ("input", "output", "parameter", "calculatedParameter", "structuralParameter", "constant", "local")
    ]
    assert len(ALLOWED) == 42
    for a, b in itertools.product([*ends, (False, "inout")], repeat=2):
        assert not ((a, b) in ALLOWED and (b, a) in ALLOWED)  # the direction is never in doubt
        assert bool(refusal(a, b)) == ((a, b) not in ALLOWED and (b, a) not in ALLOWED)
        if (a, b) in ALLOWED and "inout" not in (a[1], b[1]):
            assert gives(a)
            assert not gives(b)


def test_a_local_variable_feeds_an_input_like_an_output(folder, loop):
    local = with_kind(folder, "local.fmu", "local")
    body = system([component("a", local, "u> y!"), component("b", GAIN, "u> y<")], [connection("a.y -> b.u")])
    table = run(write(folder, body, version="2.0"), loop, start_values={"a.u": 3.0})
    assert table["a.y"].tolist() == table["b.u"].tolist() == [6.0] * 3
    assert table["b.y"].tolist() == [12.0] * 3


def test_a_local_variable_that_is_not_connected_is_not_recorded(folder):
    local = with_kind(folder, "local.fmu", "local")
    with load(write(folder, system([component("a", local, "u> y!")]), version="2.0")) as loaded:
        assert "a.y" not in loaded.columns


def test_a_calculated_parameter_feeds_a_parameter_before_the_first_step(folder, loop):
    source = with_kind(folder, "source.fmu", "calculatedParameter")
    wire = connection("a.y -> b.k", linear(10, 1))
    body = system([component("a", source, "y="), component("b", GAIN, "k* y<")], [wire])
    table = run(write(folder, body), loop, start_values={"a.u": 3.0})
    assert table["a.y"].tolist() == [6.0] * 3
    assert table["b.y"].tolist() == [61 * 0.5] * 3


def test_a_parameter_that_another_component_calculates_takes_no_value_from_the_caller(folder):
    source = with_kind(folder, "source.fmu", "calculatedParameter")
    body = system([component("a", source, "y="), component("b", GAIN, "k*")], [connection("a.y -> b.k")])
    assert check(write(folder, body), start_values={"b.k": 1.0}) == [
        "b.k is connected inside the system and cannot be given a start value (start values)"
    ]


def test_a_calculated_parameter_through_a_chain_of_systems_and_to_an_input(folder, loop):
    source = with_kind(folder, "source.fmu", "calculatedParameter")
    inner = system([component("a", source, "y=")], [connection("a.y -> p")], "p=:Real", name="in")
    wires = [connection("in.p -> b.k"), connection("in.p -> c.u")]
    body = system([inner, component("b", GAIN, "k* y<"), component("c", GAIN, "u>")], wires)
    table = run(write(folder, body), loop)
    assert table["b.y"].tolist() == [1.0 * 0.5] * 3
    assert table["c.u"].tolist() == [1.0] * 3


def test_a_constant_gives_parameters_its_value_when_the_system_is_loaded(folder, loop):
    variables = {"z": {"variability": "constant", "initial": "exact", "start": "4"}}
    fmu = edit_fmu(folder / GAIN, folder / "c.fmu", variables=variables).name
    ports = f"<ssd:Connectors>{connector('z', 'constant')}</ssd:Connectors>"
    body = system(
        [component("a", fmu, inside=ports), component("b", GAIN, "k* y<", bind({"k": ("Real", 1)}))],
        [connection("a.z -> b.k", linear(2))],
    )
    path = write(folder, body, version="2.0")
    with load(path) as loaded:
        assert [s.value for s in loaded.components[1].start_values] == [8.0]
    assert run(path, loop)["b.y"].tolist() == [4.0] * 3


def test_a_parameter_of_the_system_feeds_parameters_and_inputs(folder, loop):
    body = system(
        [component("a", GAIN, "u> k* y<"), component("m", MIXED, "n> total<")],
        [connection("p -> a.k"), connection("p -> a.u", linear(2)), connection("q -> m.n", mapping("Integer", {5: 7}))],
        "p*:Real q*:Integer",
        bind({"p": ("Real", 3), "q": ("Integer", 5)}),
    )
    table = run(write(folder, body), loop)
    assert table["a.y"].tolist() == [18.0] * 3
    assert table["m.total"].tolist() == [0.0, 7.0, 14.0]


def test_a_structural_parameter_of_the_system_feeds_parameters_and_inputs(folder, loop):
    ports = f"<ssd:Connectors>{connector('p', 'structuralParameter')}</ssd:Connectors>"
    wires = [connection("p -> a.k"), connection("p -> a.u", linear(2))]
    body = system([component("a", GAIN, "u> k* y<")], wires, "", ports + bind({"p": ("Real", 3)}))
    assert run(write(folder, body, version="2.0"), loop)["a.y"].tolist() == [18.0] * 3


def test_an_output_of_the_system_that_shows_a_parameter_is_told_and_not_recorded(folder):
    body = system([component("a", GAIN)], [connection("p -> w")], "p*:Real w<:Real", bind({"p": ("Real", 3)}))
    with load(write(folder, body)) as loaded:
        assert loaded.warnings == ("connector w of the system shows a parameter and is not recorded",)


@pytest.mark.parametrize(
    ("kind", "version", "message"),
    [
        ("inout", "1.0", "connector a.u: kind inout is not supported"),
        ("unspecified", "2.0", "connector a.u: kind unspecified is not supported"),
        ("structuralParameter", "2.0", "connector a.u: is structuralParameter, but input in CosimGain.fmu"),
        ("constant", "2.0", "connector a.u: is constant, but input in CosimGain.fmu"),
    ],
)
def test_kinds_that_a_component_cannot_have(folder, kind, version, message):
    ports = f"<ssd:Connectors>{connector('u', kind)}</ssd:Connectors>"
    path = write(folder, system([component("a", GAIN, inside=ports)]), version=version)
    assert [p.split(" (")[0] for p in check(path)] == [message]


@pytest.mark.parametrize(
    ("type_", "element"),
    [("Binary", "<ssc:Binary/>"), ("Clock", '<ssc:Clock intervalVariability="constant" intervalDecimal="1"/>')],
)
def test_types_that_are_not_supported(folder, type_, element):
    ports = f'<ssd:Connectors><ssd:Connector name="u" kind="input">{element}</ssd:Connector></ssd:Connectors>'
    path = write(folder, system([component("a", GAIN, inside=ports)]), version="2.0")
    assert [p.split(" (")[0] for p in check(path)] == [f"connector a.u: type {type_} is not supported"]
