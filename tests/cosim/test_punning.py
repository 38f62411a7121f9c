"""Two elements with one dotted name, the example of SSP 2.0 section 5.2.3: a value for the name reaches both."""

from mcap.reader import make_reader
from ssp_writer import bind, component, connection, line_of, parameter_set, system, write

from twip.cli import main
from twip.cosim import Runtime, check, load, simulate

GAIN = "CosimGain.fmu"


def values(path, **options):
    """Return the start values by column, and what is warned of."""
    loaded = load(path, **options)
    return {f"{c.name}.{s.variable.name}": s.value for c in loaded.components for s in c.start_values}


def beside(inside="", of_b="", of_c="", of_bc=""):
    """Return a system with `C` in `B` (y = 2 u of 3) beside `B.C`; values are bindings."""
    b = system([component("C", GAIN, "u> y<", of_c)], [connection("C.y -> y")], "y<", of_b, "B")
    wires = [connection("B.y -> B.C.u"), connection("B.C.y -> y")]
    return system([b, component("B.C", GAIN, "u> y<", of_bc)], wires, "y<", inside)


def test_a_value_for_the_common_name_reaches_both(folder, loop):
    path = write(folder, beside(bind({"B.C.k": ("Real", 3.0)})))
    assert values(path) == {"B.C.k": 3.0, "B.C_2.k": 3.0}
    assert load(path).warnings == (
        "B.C is the name of two elements, this one has B.C_2 in results"
        f" (SystemStructure.ssd line {line_of(path, 'Component name=')})",
    )
    result = simulate(load(path, start_values={"B.C_2.u": 2.0}), step_size=0.5, runtime=Runtime(loop=loop))
    # the element of B is B.C_2: y = 3 * 2, then the other one: 3 * 6
    assert [result[name][-1] for name in ("B.C_2.y", "B.C.u", "B.C.y", "y")] == [6.0, 6.0, 18.0, 18.0]


def test_a_value_within_an_element_reaches_what_is_in_it(folder):
    assert values(write(folder, beside(of_b=bind({"C.k": ("Real", 3.0)})))) == {"B.C_2.k": 3.0}
    assert values(write(folder, beside(of_c=bind({"k": ("Real", 3.0)})))) == {"B.C_2.k": 3.0}
    assert values(write(folder, beside(of_bc=bind({"k": ("Real", 3.0)})))) == {"B.C.k": 3.0}
    path = write(folder, beside(of_bc=bind({"k": ("Real", 3.0)}), inside=bind({"C.k": ("Real", 5.0)}, prefix="B.")))
    assert values(path) == {"B.C.k": 5.0, "B.C_2.k": 5.0}


def test_the_caller_has_the_common_name_and_one_for_each(folder):
    path = write(folder, beside())
    (folder / "set.ssv").write_text(parameter_set({"B.C.k": ("Real", 3)}))
    assert values(path, parameters=folder / "set.ssv") == {"B.C.k": 3.0, "B.C_2.k": 3.0}
    assert values(path, start_values={"B.C.k": 3.0, "B.C_2.k": 4.0}) == {"B.C.k": 3.0, "B.C_2.k": 4.0}
    assert check(path, swap={"B.C_2": folder / "CosimMixed.fmu"}) != []
    assert check(path, swap={"B.C_2": folder / GAIN}) == []


def test_systems_share_a_name_too(folder):
    deep = system([system([component("D", GAIN)], name="C")], name="B")
    other = system([component("D", GAIN)], inside=bind({"D.k": ("Real", 7.0)}), name="B.C")
    path = write(folder, system([deep, other], inside=bind({"B.C.D.u": ("Real", 1.0)})))
    assert values(path) == {"B.C.D.k": 7.0, "B.C.D.u": 1.0, "B.C_2.D.u": 1.0}
    third = system([component("C.D", GAIN)], name="B")
    around = system([system([deep, other], name="A"), system([component("x", GAIN)], name="E")])
    assert sorted(values(write(folder, around))) == ["A.B.C.D.k"]
    assert "element B is there twice" in check(write(folder, system([deep, third])))[0]


def test_both_are_recorded(folder):
    path, log, rows = write(folder, beside()), folder / "out.mcap", folder / "out.csv"
    words = ["--step-size", "0.5", "--log", str(log), "--output-file", str(rows), "--start-values", "B.C_2.u", "2"]
    assert main(["run", str(path), *words]) == 0
    assert {"B.C_2.y", "B.C.y", "y"} < set(rows.read_text().splitlines()[0].split(","))
    with log.open("rb") as stream:
        topics = {channel.topic for channel in make_reader(stream).get_summary().channels.values()}
    assert {"/B/C", "/B/C_2"} < topics
