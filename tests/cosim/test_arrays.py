"""Array connectors and array parameters of SSP 2.0: one connector, one value per element."""

import re

import fmpy
import pytest
from echo_fmu import compiled, echo3, echo3_description, pack
from ssp_writer import bind, component, connection, linear, parameter_set, system, write

from twip.cosim import Runtime, Table, check, load, simulate

DIMS = '<ssc:Dimension size="3"/></ssv:Parameter>'


@pytest.fixture(scope="session")
def libraries(tmp_path_factory):
    return {"echo3": compiled("echo3", tmp_path_factory.mktemp("arrays"))}


@pytest.fixture
def array_fmu(folder):
    """An FMU that shows arrays as FMI 3 names their elements: `y = 2 u` (2 x 3), and a parameter k (2)."""
    return "CosimArray.fmu"


def dimension(*sizes):
    return "".join("<ssc:Dimension/>" if n is None else f'<ssc:Dimension size="{n}"/>' for n in sizes)


def port(name, kind, *sizes, type_="Float64"):
    return f'<ssd:Connector name="{name}" kind="{kind}"><ssc:{type_}/>{dimension(*sizes)}</ssd:Connector>'


def ports(*items):
    return f"<ssd:Connectors>{''.join(items)}</ssd:Connectors>" if items else ""


def element(name, fmu, *items, inside=""):
    return component(name, fmu, inside=ports(*items) + inside)


def said(path):
    return [p.split(" (Sys")[0] for p in check(path)]


@pytest.mark.parametrize("sizes", [(2, 3), (None, None), (2, None)])
def test_arrays_are_connected_element_by_element(folder, array_fmu, loop, sizes):
    inner = system(
        [element("b", array_fmu, port("u", "input", *sizes))],
        [connection("v -> b.u", linear(10))],
        inside=ports(port("v", "input", 2, 3)),
        name="inner",
    )
    body = system(
        [element("a", array_fmu, port("u", "input", *sizes), port("y", "output", *sizes)), inner],
        [connection("a.y -> inner.v")],
    )
    starts = {f"a.u[{i},{j}]": 10.0 * i + j for i in (1, 2) for j in (1, 2, 3)}
    with load(write(folder, body, version="2.0"), start_values=starts) as loaded:
        table = Table(loaded.channels)
        simulate(loaded, sinks=[table], step_size=0.5, runtime=Runtime(loop=loop))
    for i in (1, 2):
        for j in (1, 2, 3):
            assert table[f"inner.b.u[{i},{j}]"][-1] == 20.0 * (10 * i + j)
            assert table[f"inner.v[{i},{j}]"][-1] == 2.0 * (10 * i + j)


@pytest.mark.parametrize(
    ("source", "target", "text", "expected"),
    [
        ("Float64", "Float64", "1.5 -2 1e300", [1.5, -2.0, 1e300]),
        ("Float32", "Float64", "0.5 -2 4", [0.5, -2.0, 4.0]),
        ("Int8", "Int32", "-128 0 127", [-128, 0, 127]),
        ("UInt16", "Int64", "65535 0 1", [65535, 0, 1]),
        ("Boolean", "Boolean", "true false 1", [1, 0, 1]),
    ],
)
def test_arrays_of_fmi_3_are_set_and_connected_whole(tmp_path, libraries, loop, source, target, text, expected):
    """An echo turns an array round; a second one turns it back."""
    echo3(tmp_path, libraries["echo3"])
    values = parameter_set({f"ins_{source}": (source, text)}).replace('version="1.0"', 'version="2.0"')
    (tmp_path / "set.ssv").write_text(values.replace("</ssv:Parameter>", DIMS))
    a = element("a", "echo3.fmu", port(f"outs_{source}", "output", 3, type_=source), inside=bind(source="set.ssv"))
    b = element("b", "echo3.fmu", port(f"ins_{target}", "input", None, type_=target))
    path = write(tmp_path, system([a, b], [connection(f"a.outs_{source} -> b.ins_{target}")]), version="2.0")
    with load(path) as loaded:
        table = Table(loaded.channels)
        simulate(loaded, sinks=[table], step_size=0.5, runtime=Runtime(loop=loop))
    assert [table[f"b.outs_{target}[{i}]"][-1] for i in (1, 2, 3)] == expected


@pytest.mark.parametrize(
    ("source", "target"), [("Float64", "Float32"), ("Int32", "Int16"), ("Int8", "UInt8"), ("Int64", "Float64")]
)
def test_types_that_lose_something_are_refused(tmp_path, libraries, source, target):
    echo3(tmp_path, libraries["echo3"])
    a = element("a", "echo3.fmu", port(f"outs_{source}", "output", 3, type_=source))
    b = element("b", "echo3.fmu", port(f"ins_{target}", "input", 3, type_=target))
    path = write(tmp_path, system([a, b], [connection(f"a.outs_{source} -> b.ins_{target}")]), version="2.0")
    names = [{"Float64": "Real", "Int32": "Integer"}.get(t, t) for t in (source, target)]
    assert said(path) == [
        f"a.outs_{source}[{i}] → b.ins_{target}[{i}]: types differ ({names[0]}, {names[1]})" for i in (1, 2, 3)
    ]


def test_other_names_of_a_variable_are_connected_as_the_variable(tmp_path, libraries, loop):
    text = echo3_description()
    for name in ("in_Float64", "out_Float64", "ins_Float64", "outs_Float64"):
        text = re.sub(rf'(<Float64 name="{name}" .*?)(</Float64>)', rf'\1<Alias name="other_{name}"/>\2', text)
    pack(tmp_path / "alias.fmu", libraries["echo3"], text, fmpy.platform_tuple)
    a = element("a", "alias.fmu", port("other_out_Float64", "output"), port("other_outs_Float64", "output", 3))
    b = element("b", "alias.fmu", port("other_in_Float64", "input"), port("other_ins_Float64", "input", 3))
    wires = ["a.other_out_Float64 -> b.other_in_Float64", "a.other_outs_Float64 -> b.other_ins_Float64"]
    path = write(tmp_path, system([a, b], [connection(w) for w in wires]), version="2.0")
    values = {"a.in_Float64": 7.0} | {f"a.ins_Float64[{i}]": float(i) for i in (1, 2, 3)}
    with load(path, start_values=values) as loaded:
        last = simulate(loaded, step_size=0.5, runtime=Runtime(loop=loop)).values
    assert last["b.out_Float64"] == 7.0
    assert [last[f"b.outs_Float64[{i}]"] for i in (1, 2, 3)] == [1.0, 2.0, 3.0]
    assert len(check(path, start_values={"b.in_Float64": 1.0, "b.ins_Float64[2]": 1.0})) == 2  # they are connected


def test_an_array_of_strings_has_one_element_per_value(tmp_path, libraries, loop):
    echo3(tmp_path, libraries["echo3"])
    inner = "".join(f'<ssv:Value value="{text}"/>' for text in ("x", "", "two words"))
    values = parameter_set({"ins_String": ("String", "")}).replace('version="1.0"', 'version="2.0"')
    values = values.replace('<ssv:String value=""/></ssv:Parameter>', f"<ssv:String>{inner}</ssv:String>{DIMS}")
    (tmp_path / "set.ssv").write_text(values)
    path = write(tmp_path, system([element("a", "echo3.fmu", inside=bind(source="set.ssv"))]), version="2.0")
    with load(path) as loaded:
        values = simulate(loaded, step_size=0.5, runtime=Runtime(loop=loop)).values
    assert [values[f"a.outs_String[{i}]"] for i in (1, 2, 3)] == ["two words", "", "x"]


def test_an_array_parameter_has_its_values_in_row_major_order(folder, array_fmu):
    def started(text, dims):
        values = parameter_set({"u": ("Float64", text)}).replace('version="1.0"', 'version="2.0"')
        (folder / "set.ssv").write_text(values.replace("</ssv:Parameter>", f"{dims}</ssv:Parameter>", 1))
        return write(folder, system([component("a", array_fmu, "", bind(source="set.ssv"))]), version="2.0")

    dims = '<ssc:Dimension size="2"/><ssc:Dimension size="3"/>'
    with load(started("1 2 3 4 5 6", dims)) as loaded:
        values = {s.variable.name: s.value for s in loaded.components[0].start_values}
    assert values == {"u[1,1]": 1, "u[1,2]": 2, "u[1,3]": 3, "u[2,1]": 4, "u[2,2]": 5, "u[2,3]": 6}
    assert check(started("1 2 3 4 5", dims)) == ["parameter u has 5 values where its size is 2 x 3 (set.ssv line 3)"]


@pytest.mark.parametrize(
    ("items", "wires", "message"),
    [
        ([port("u", "input", 3, 2)], [], "connector a.u: is 3 x 2, but 2 x 3 in the FMU"),
        ([port("k", "parameter", 3)], [], "connector a.k: is 3, but 2 in the FMU"),
        (
            [port("u", "input").replace("/></", '/><ssc:Dimension sizeConnector="n"/><ssc:Dimension size="3"/></')],
            [],
            "connector a.u: there is no connector n for its size",
        ),
        ([port("q", "input", None)], [], "connector a.q: the size of the array is not known"),
        ([port("q", "input", 10**6)], [], "connector a.q: more than 100000 elements"),
        (
            [port("y", "output", 2, 3), port("u[1,1]", "input")],
            ["a.y -> a.u[1,1]"],
            "a.y → a.u[1,1]: sizes differ (2 x 3, a scalar)",
        ),
    ],
)
def test_arrays_that_do_not_fit(folder, array_fmu, items, wires, message):
    body = system([element("a", array_fmu, *items)], [connection(w) for w in wires])
    assert message in said(write(folder, body, version="2.0"))


def test_indices_of_connections_are_refused_by_name(folder, array_fmu):
    wire = connection("a.y -> a.u", startIndices="1 1", endIndices="1 2")
    items = [port("u", "input", 2, 3), port("y", "output", 2, 3)]
    path = write(folder, system([element("a", array_fmu, *items)], [wire]), version="2.0")
    assert said(path) == [
        f"{side}Indices of Connection is not supported: the standard leaves open where indices begin"
        for side in ("start", "end")
    ]


def test_arrays_are_no_part_of_version_1(folder, array_fmu):
    path = write(folder, system([element("a", array_fmu, port("u", "input", 2, 3, type_="Real"))]))
    assert "Element 'Dimension': This element is not expected." in said(path)[0]
