"""Signals that travel through signal dictionaries, from one reference to another, across systems and units."""

import math

import pytest
from ssp_writer import component, connection, dictionary, enumerations, linear, mapping, signals, system, units, write

from twip.cosim import Algorithm, Runtime, Table, check, load, simulate

GAIN, MIXED = "CosimGain.fmu", "CosimMixed.fmu"
REAL = "<ssc:Real/>"
UNITS = f"rad rad=1; deg rad=1 factor={math.pi / 180!r}"
TAIL = '<ssd:DefaultExperiment startTime="0" stopTime="1"/>'


def run(path, loop, **loading):
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


def said(path):
    return [p.split(" (Sys")[0] for p in check(path)]


@pytest.mark.parametrize("kinds", ["< >", "~ ~"])
@pytest.mark.parametrize("outside", [False, True])
def test_a_signal_goes_from_one_reference_to_another(folder, loop, kinds, outside):
    """Both references are to one dictionary of the outermost system, one of them in an inner system."""
    into, out = kinds.split()[::-1]
    inner = system(
        [component("b", GAIN, "u> y<"), signals("bus", "bus", f"speed{out}")],
        [connection("bus.speed -> b.u", linear(10))],
        name="inner",
    )
    content = dictionary({"speed": REAL, "unused": REAL})
    (folder / "bus.ssb").write_text(content)
    body = system(
        [component("a", GAIN, "u> y<"), inner, signals("bus", "bus", f"speed{into}")],
        [connection("a.y -> bus.speed")],
        dictionaries={"bus": "bus.ssb" if outside else content},
    )
    table = run(write(folder, body), loop, start_values={"a.u": 3.0})
    assert table["inner.b.u"].tolist() == [60.0] * 3
    assert [name for name in table.columns if "bus" in name] == []


def test_one_reference_gives_and_takes(folder, loop):
    body = system(
        [component("a", GAIN, "y<"), component("b", GAIN, "u>"), component("c", GAIN, "u>"), signals("r", "bus", "s~")],
        [connection("a.y -> r.s"), connection("r.s -> b.u"), connection("c.u -> r.s", linear(3))],
        dictionaries={"bus": dictionary({"s": REAL})},
    )
    table = run(write(folder, body), loop)
    assert table["b.u"].tolist() == [1.0] * 3
    assert table["c.u"].tolist() == [3.0] * 3


def test_units_are_converted_into_the_dictionary_and_out_of_it(folder, loop):
    content = dictionary({"angle": '<ssc:Real unit="turn"/>'}, units(f"turn rad=1 factor={2 * math.pi!r}", "ssb"))
    body = system(
        [
            component("a", GAIN, "u> y<[deg]"),
            component("b", GAIN, "u>[rad]"),
            signals("in", "bus", "angle>[deg]"),
            signals("out", "bus", "angle<[rad]"),
        ],
        [connection("a.y -> in.angle"), connection("out.angle -> b.u")],
        dictionaries={"bus": content},
    )
    table = run(write(folder, body, tail=units(UNITS) + TAIL), loop, start_values={"a.u": 90.0})
    # two conversions of two roundings each
    assert table["b.u"] == pytest.approx([math.pi] * 3, rel=8 * 2**-52)


def test_an_enumeration_through_a_dictionary_is_mapped_on_the_way_in(folder, loop):
    stages = {"idle": 10, "slow": 20, "fast": 30}
    content = dictionary({"stage": '<ssc:Enumeration name="Stage"/>'}, enumerations("ssb", Stage=stages))
    body = system(
        [component("a", MIXED, "n> total<"), component("b", MIXED, "n> total<"), signals("r", "bus", "stage~")],
        [connection("a.total -> r.stage", mapping("Integer", {0: 10, 3: 20, 6: 30})), connection("r.stage -> b.n")],
        dictionaries={"bus": content},
    )
    assert run(write(folder, body), loop)["b.n"].tolist() == [10.0, 20.0, 30.0]


def test_the_nearest_dictionary_of_a_name_counts(folder, loop):
    inner = system(
        [
            component("b", GAIN, "y<"), component("c", GAIN, "u>"), signals("r", "bus", "s~"),
        ],
        [connection("b.y -> r.s", linear(5)), connection("r.s -> c.u")],
        name="inner",
        dictionaries={"bus": dictionary({"s": REAL})},
    )  # fmt: skip
    body = system(
        [component("a", GAIN, "y<"), component("d", GAIN, "u>"), signals("r", "bus", "s~"), inner],
        [connection("a.y -> r.s"), connection("r.s -> d.u")],
        dictionaries={"bus": dictionary({"s": REAL})},
    )
    table = run(write(folder, body), loop)
    assert table["inner.c.u"].tolist() == [5.0] * 3
    assert table["d.u"].tolist() == [1.0] * 3


def broken(folder, wires, ports="s~", content=None, of="bus", more=()):
    elements = [component("a", GAIN, "y<"), component("b", GAIN, "u> y<"), signals("r", of, ports), *more]
    return said(
        write(folder, system(elements, wires, dictionaries={"bus": content or dictionary({"s": REAL})}), version="2.0")
    )


def test_what_makes_no_sense(folder):
    assert broken(folder, [], of="train") == ["r: there is no signal dictionary train"]
    assert broken(folder, [connection("r.t -> b.u")], "t~") == [
        "connector r.t: dictionary bus has no such entry",
        "r.t → b.u: nothing feeds r.t",
    ]
    assert broken(folder, [connection("r.s -> b.u")]) == ["dictionary bus.s → r.s: nothing feeds dictionary bus.s"]
    second = [connection("a.y -> r.s"), connection("b.y -> q.s")]
    assert broken(folder, second, more=[signals("q", "bus", "s~")]) == [
        "dictionary bus.s is connected twice: to r.s (line 6) and q.s"
    ]
    assert broken(folder, [connection("a.y -> r.s")], "s<") == ["a.y → r.s: both ends give a value (output to output)"]
    assert broken(folder, [], content=dictionary({"s": REAL}).replace("SignalDictionary ", "Bus ", 1)) != []
    assert broken(folder, [], content=dictionary({"s": "<ssc:Binary/>"})) == [
        "dictionary entry s: type Binary is not supported"
    ]
    assert broken(folder, [], content=dictionary({"s": '<ssc:Real/><ssc:Dimension size="3"/>'}, version="2.0")) == [
        "dictionary entry s: arrays are not supported"
    ]
    assert broken(folder, [], content="none.ssb") == ["none.ssb: No such file or directory"]
