"""What a swap makes of array connectors, constants, names with a dot, and of enumerations that count otherwise."""

import re
import shutil

import fmpy
import pytest
from echo_fmu import compiled, echo3_description, pack
from ssp_writer import bind, component, connection, edit_fmu, line_of, system, write

from twip.cosim import Runtime, check, load, simulate

B = '<ssd:Component name="b"'
OLD, NEW = {"off": 0, "on": 1, "fast": 2}, {"on": 0, "off": 1}


@pytest.fixture(scope="session")
def library(tmp_path_factory):
    return compiled("echo3", tmp_path_factory.mktemp("swap"))


def array(name, kind, *sizes):
    dimensions = "".join("<ssc:Dimension/>" if n is None else f'<ssc:Dimension size="{n}"/>' for n in sizes)
    return f'<ssd:Connector name="{name}" kind="{kind}"><ssc:Float64/>{dimensions}</ssd:Connector>'


def two(folder, source, output, input_, *sizes):
    """Write a system of `a` whose array feeds that of `b`."""
    ports = f"<ssd:Connectors>{array(input_, 'input', *sizes)}{array(output, 'output', *sizes)}</ssd:Connectors>"
    parts = [component(name, source, inside=ports) for name in ("a", "b")]
    return write(folder, system(parts, [connection(f"a.{output} -> b.{input_}")]), version="2.0")


def last(path, **options):
    return simulate(load(path, **options), step_size=0.5, runtime=Runtime(loop="python")).values


@pytest.mark.parametrize("sizes", [(3,), (None,)])
def test_an_array_is_swapped_with_its_elements(tmp_path, library, sizes):
    text = echo3_description()
    pack(tmp_path / "echo3.fmu", library, text, fmpy.platform_tuple)
    aliased = re.sub(r'(<Float64 name="ins_Float64" .*?)(</Float64>)', r'\1<Alias name="other"/>\2', text)
    renamed = aliased.replace('"ins_Float64"', '"taken"').replace('"outs_Float64"', '"given"')
    new = pack(tmp_path / "new.fmu", library, renamed, fmpy.platform_tuple)
    path = two(tmp_path, "echo3.fmu", "outs_Float64", "ins_Float64", *sizes)
    values = {f"a.ins_Float64[{i}]": float(i) for i in (1, 2, 3)}
    shutil.copy(tmp_path / "echo3.fmu", tmp_path / "copy.fmu")
    before = last(path, start_values=values)
    assert [before[f"b.outs_Float64[{i}]"] for i in (1, 2, 3)] == [1.0, 2.0, 3.0]  # turned round twice
    assert last(path, start_values=values, swap={"b": tmp_path / "copy.fmu"}) == before
    (tmp_path / "map.toml").write_text('[names]\nins_Float64 = "taken"\nouts_Float64 = "given"\n')
    swapped = {"swap": {"b": new}, "swap_map": {"b": tmp_path / "map.toml"}}
    assert last(path, start_values=values, **swapped) == before
    place = f"SystemStructure.ssd line {line_of(path, B)}"
    assert check(path, swap={"b": new}) == [
        f"swap b: {new} has no input array ins_Float64 (there is in_Float64), which a.outs_Float64 feeds ({place})"
    ]


@pytest.mark.parametrize("sizes", [(2, 3), (None, None)])
def test_an_array_of_another_shape_or_unit_is_told_once(folder, sizes):
    path = two(folder, "CosimArray.fmu", "y", "u", *sizes)
    array_fmu = folder / "CosimArray.fmu"
    less = edit_fmu(array_fmu, folder / "less.fmu", rename={"u[1,3]": "v", "u[2,3]": "w"})
    place = f"SystemStructure.ssd line {line_of(path, B)}"
    (line,) = check(path, swap={"b": less})
    assert line == f"swap b: u is 2 x 2 in {less}, 2 x 3 in the system, which a.y feeds ({place})"
    odd = edit_fmu(array_fmu, folder / "odd.fmu", rename={"u[1,2]": "v"})
    (line,) = check(path, swap={"b": odd})
    assert line.startswith(f"swap b: {odd} has no input u[1,2] (there is ")
    units = {f"u[{i},{j}]": {"unit": "m"} for i in (1, 2) for j in (1, 2, 3)}
    metres = edit_fmu(array_fmu, folder / "m.fmu", variables=units, definitions="m m=1; s s=1")
    seconds = edit_fmu(array_fmu, folder / "s.fmu", variables={"u[1,3]": {"unit": "s"}}, definitions="m m=1; s s=1")
    path = two(folder, metres.name, "y", "u", *sizes)
    (line,) = check(path, swap={"b": seconds})
    assert line.startswith(f"swap b: u[1,3] is in s in {seconds}, in m in the system: units differ, which a.y feeds")
    assert load(path, swap={"b": array_fmu}).warnings == (
        f"swap b: u has no unit in {array_fmu}, it is taken to be in m",
    )


def test_a_name_with_a_dot_in_it(folder):
    inner = system(
        [component("my.ctrl", "CosimGain.fmu", "u> y<")], [connection("u -> my.ctrl.u")], "u>", name="in.ner"
    )
    path = write(folder, system([component("b", "CosimGain.fmu", "y<"), inner], [connection("b.y -> in.ner.u")]))
    assert check(path, swap={"in.ner.my.ctrl": folder / "CosimGain.fmu"}) == []
    (line,) = check(path, swap={"in.ner.my.ctrl": folder / "CosimMixed.fmu"})
    assert "has no input u, which u feeds" in line


def test_a_constant_is_swapped_for_a_constant(folder):
    constant = {"k": {"causality": "output", "variability": "constant"}}
    fmu = edit_fmu(folder / "CosimGain.fmu", folder / "c.fmu", variables=constant)
    ports = '<ssd:Connectors><ssd:Connector name="k" kind="constant"><ssc:Real/></ssd:Connector></ssd:Connectors>'
    parts = [component("a", fmu.name, inside=ports), component("b", "CosimGain.fmu", "k* u> y<")]
    path = write(folder, system(parts, [connection("a.k -> b.k")]), version="2.0")
    assert check(path, swap={"a": shutil.copy(fmu, folder / "copy.fmu")}) == []
    varying = {"k": {"causality": "output", "variability": "discrete"}}
    varying = edit_fmu(folder / "CosimGain.fmu", folder / "v.fmu", variables=varying)
    (line,) = check(path, swap={"a": varying})
    assert line.startswith(f"swap a: {varying} has no constant k (it is output there), which b.k feeds")


def test_a_number_of_an_enumeration_means_the_item_that_it_meant(folder):
    edit_fmu(folder / "CosimMixed.fmu", folder / "old.fmu", enums={"n": OLD})
    new = edit_fmu(folder / "CosimMixed.fmu", folder / "new.fmu", enums={"n": NEW})

    def path(kind, value):
        return write(folder, system([component("b", "old.fmu", "n>", bind({"n": (kind, value)}))]))

    def start(path, **more):
        (value,) = load(path, swap={"b": new}, **more).components[0].start_values
        return value.value

    assert start(path("Integer", 1)) == start(path("Enumeration", "on")) == NEW["on"]
    assert start(path("Integer", 0)) == start(path("Enumeration", "off")) == NEW["off"]
    assert start(path("Integer", 1), start_values={"b.n": 1}) == 1  # the caller knows the new one
    (line,) = check(path("Integer", 2), swap={"b": new})
    assert line.startswith("n = '2': the enumeration has no item fast now (component b, SystemStructure.ssd line ")
    ramp = component("a", "CosimMixed.fmu", "total<")
    fed = write(folder, system([component("b", "old.fmu", "n>"), ramp], [connection("a.total -> b.n")]))
    assert load(fed, swap={"b": new}).warnings == (
        f"swap b: n has other items in {new}: numbers mean what they mean there",
    )
