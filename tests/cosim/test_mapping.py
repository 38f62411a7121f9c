"""Boolean, Integer and Enumeration values on connections: what becomes of them by the mapping transformations."""

import pytest
from flat_options import grouped
from ssp_writer import component, connection, edit_fmu, enumerations, linear, mapping, system, write

from twip.cosim import Algorithm, Checkpoints, Runtime, Table, check, load, simulate
from twip.cosim.values.transformation import Mapping
from twip.errors import TwipError

MIXED = "CosimMixed.fmu"
GEARS = {"park": 0, "first": 3, "second": 6}
STAGES = {"idle": 1, "slow": 2, "fast": 4}
TAIL = '<ssd:DefaultExperiment startTime="0" stopTime="1"/>'


def run(path, coupling="gauss-seidel", **options):
    with load(path) as loaded:
        table = Table(loaded.channels)
        simulate(loaded, sinks=[table], step_size=0.5, **grouped(coupling=coupling, **options))
    return table


def two(folder, a=None, b=None, a_ports="n> on> total< inverted<", b_ports="n> on> total< inverted<", wires=()):
    """Return a system of two counters: `a.total` is 0, 3, 6, as `n` is 3, and `a.inverted` is true throughout."""
    names = [
        MIXED if enums is None else edit_fmu(folder / MIXED, folder / f"{name}.fmu", enums=enums).name
        for name, enums in (("a", a), ("b", b))
    ]
    return system([component("a", names[0], a_ports), component("b", names[1], b_ports)], wires)


@pytest.mark.parametrize(
    ("entries", "received"),
    [({"true": "false"}, 0.0), ({"true": "false", "false": "true"}, 0.0), ({"false": "true"}, 1.0), ({"1": "1"}, 1.0)],
)
def test_a_boolean_mapping_keeps_what_it_does_not_name(folder, loop, entries, received):
    wire = connection("a.inverted -> b.on", mapping("Boolean", entries))
    assert run(write(folder, two(folder, wires=[wire])), loop=loop)["b.on"].tolist() == [received] * 3


def test_an_integer_mapping_keeps_what_it_does_not_name(folder, loop):
    wire = connection("a.total -> b.n", mapping("Integer", {3: -7, 6: 2147483647, 9: 1}))
    table = run(write(folder, two(folder, wires=[wire])), loop=loop)
    assert table["a.total"].tolist() == [0.0, 3.0, 6.0]
    assert table["b.n"].tolist() == [0.0, -7.0, 2147483647.0]


def test_under_jacobi_a_value_is_mapped_one_step_later(folder, loop):
    wire = connection("a.total -> b.n", mapping("Integer", {3: -7, 0: 5}))
    table = run(write(folder, two(folder, wires=[wire])), coupling="jacobi", loop=loop)
    assert table["a.total"].tolist() == [0.0, 3.0, 6.0]
    assert table["b.n"].tolist() == [5.0, 5.0, -7.0]


def test_mappings_on_the_way_through_systems_are_done_one_after_the_other(folder, loop):
    inner = system(
        [component("b", MIXED, "n> total<")],
        [connection("v -> b.n", mapping("Integer", {30: 1, 6: 2}))],
        "v>:Integer",
        name="inner",
    )
    wire = connection("a.total -> inner.v", mapping("Integer", {3: 30, 0: 6}))
    table = run(write(folder, system([component("a", MIXED, "n> total<"), inner], [wire])), loop=loop)
    assert table["inner.v"].tolist() == [6.0, 30.0, 6.0]
    assert table["inner.b.n"].tolist() == [2.0, 1.0, 2.0]


@pytest.mark.parametrize("declared", [True, False])
def test_an_enumeration_travels_to_one_with_the_same_items(folder, loop, declared):
    name = ":Gear" if declared else ""
    body = two(folder, {"total": GEARS}, {"n": GEARS}, f"total<{name}", f"n>{name}", [connection("a.total -> b.n")])
    table = run(write(folder, body, tail=(enumerations(Gear=GEARS) if declared else "") + TAIL), loop=loop)
    assert table["b.n"].tolist() == [0.0, 3.0, 6.0]


def test_an_enumeration_mapping_goes_by_the_names_of_items(folder, loop):
    wire = connection("a.total -> b.n", mapping("Enumeration", {"park": "idle", "first": "slow", "second": "fast"}))
    body = two(folder, {"total": GEARS}, {"n": STAGES}, "total<", "n>", [wire])
    assert run(write(folder, body), loop=loop)["b.n"].tolist() == [1.0, 2.0, 4.0]


def test_an_enumeration_mapping_keeps_names_that_both_sides_have(folder, loop):
    stages = {"park": 5, "first": 6, "drive": 7}
    wire = connection("a.total -> b.n", mapping("Enumeration", {"second": "drive"}))
    body = two(folder, {"total": GEARS}, {"n": stages}, "total<", "n>", [wire])
    assert run(write(folder, body), loop=loop)["b.n"].tolist() == [5.0, 6.0, 7.0]


def test_an_integer_mapping_between_enumerations_goes_by_their_values(folder, loop):
    wire = connection("a.total -> b.n", mapping("Integer", {0: 1, 3: 2, 6: 4}))
    body = two(folder, {"total": GEARS}, {"n": STAGES}, "total<", "n>", [wire])
    assert run(write(folder, body), loop=loop)["b.n"].tolist() == [1.0, 2.0, 4.0]


def test_an_enumeration_is_an_integer_for_an_integer(folder, loop):
    body = two(folder, {"total": GEARS}, None, "total<", "n>", [connection("a.total -> b.n")])
    assert run(write(folder, body), loop=loop)["b.n"].tolist() == [0.0, 3.0, 6.0]


@pytest.mark.parametrize(
    ("items", "entries", "rows"),
    [({"none": 0, "three": 3}, None, 2), ({"none": 0, "three": 3}, {9: 0}, 2), ({"none": 0}, {9: 0}, 1)],
)
def test_a_value_that_is_no_item_is_a_failure_at_its_time(folder, loop, items, entries, rows):
    inside = "" if entries is None else mapping("Integer", entries)
    body = two(folder, None, {"n": items}, "total<", "n>", [connection("a.total -> b.n", inside)])
    with load(write(folder, body)) as loaded:
        table = Table(loaded.channels)
        with pytest.raises(TwipError) as failure:
            simulate(
                loaded,
                sinks=[table],
                step_size=0.5,
                algorithm=Algorithm(coupling="gauss-seidel"),
                runtime=Runtime(loop=loop),
            )
    value, time = (6, 1.0) if rows == 2 else (3, 0.5)
    assert str(failure.value) == (
        f"a.total → b.n failed at t = {time:g} s: {value} is no item of the enumeration, and not mapped"
    )
    assert len(table.times) == rows


def test_a_value_that_is_no_item_at_the_start_is_a_failure_before_the_run(folder, loop):
    body = two(folder, None, {"n": {"three": 3}}, "total<", "n>", [connection("a.total -> b.n")])
    with load(write(folder, body)) as loaded, pytest.raises(TwipError) as failure:
        simulate(loaded, step_size=0.5, runtime=Runtime(loop=loop))
    assert str(failure.value) == "a.total → b.n failed at t = 0 s: 0 is no item of the enumeration, and not mapped"


def test_a_run_with_mappings_is_resumed_bit_for_bit_and_only_with_the_same_tables(folder, loop):
    fmu = edit_fmu(folder / MIXED, folder / "s.fmu", state=True).name
    parts = [component("a", fmu, "n> total<"), component("b", fmu, "n> total<")]

    def with_table(table):
        return write(folder, system(parts, [connection("a.total -> b.n", mapping("Integer", table))]))

    file = folder / "c"
    path = with_table({3: -7, 6: 5})
    with load(path) as loaded:
        simulate(loaded, stop_time=1.0, step_size=0.5, checkpoints=Checkpoints(file=file), runtime=Runtime(loop=loop))
        resumed = simulate(
            loaded, stop_time=2.0, step_size=0.5, checkpoints=Checkpoints(resume=file), runtime=Runtime(loop=loop)
        )
        whole = simulate(loaded, stop_time=2.0, step_size=0.5, runtime=Runtime(loop=loop))
    assert resumed.values == whole.values
    with load(with_table({3: -7, 6: 4})) as loaded, pytest.raises(TwipError, match=r"connection to b\.n differs"):
        simulate(loaded, stop_time=2.0, step_size=0.5, checkpoints=Checkpoints(resume=file), runtime=Runtime(loop=loop))


def problems_of(folder, wire, **options):
    return [p.split(" (Sys")[0] for p in check(write(folder, two(folder, wires=[wire], **options)))]


@pytest.mark.parametrize(
    ("wire", "message"),
    [
        (
            ("a.total -> b.n", mapping("Boolean", {"true": "false"})),
            "a boolean mapping needs Boolean values, not Integer",
        ),
        (
            ("a.inverted -> b.on", mapping("Integer", {1: 2})),
            "an integer mapping needs Integer or Enumeration values, not Boolean",
        ),
        (
            ("a.total -> b.n", mapping("Enumeration", {"x": "y"})),
            "an enumeration mapping needs Enumeration values, not Integer",
        ),
        (("a.inverted -> b.on", linear(2)), "a linear transformation needs Real values, not Boolean"),
        (("a.inverted -> b.n", ""), "types differ (Boolean, Integer)"),
    ],
)
def test_transformations_that_do_not_fit_the_types(folder, wire, message):
    assert problems_of(folder, connection(*wire)) == [f"{wire[0].replace('->', '→')}: {message}"]


def test_tables_that_make_no_sense(folder):
    ends = {"a_ports": "total<", "b_ports": "n>", "a": {"total": GEARS}, "b": {"n": STAGES}}
    assert problems_of(folder, connection("a.total -> b.n"), **ends) == [
        "a.total → b.n: enumerations differ, and there is no mapping"
    ]
    wire = connection("a.total -> b.n", mapping("Enumeration", {"third": "idle", "park": "gone"}))
    assert problems_of(folder, wire, **ends) == [
        "third is no item of the enumeration",
        "gone is no item of the enumeration",
    ]
    wire = connection("a.total -> b.n", mapping("Integer", {5: 1, 3: 7}))
    assert problems_of(folder, wire, **ends) == [
        "7 is no item of the enumeration",
        "5 is no item of the enumeration",
    ]
    twice = mapping("Integer", {3: 1}).replace("</ssc:I", '<ssc:MapEntry source="3" target="2"/></ssc:I')
    assert problems_of(folder, connection("a.total -> b.n", twice)) == ["the mapping has two entries for 3"]


def test_an_enumeration_of_the_file_must_be_that_of_the_variable(folder):
    body = two(folder, {"total": GEARS}, None, "total<:Gear", "n>", [])
    path = write(folder, body, tail=enumerations(Gear={**GEARS, "second": 5}) + TAIL)
    assert [p.split(" (")[0] for p in check(path)] == [
        "connector a.total: enumeration Gear has other items than that of the variable"
    ]
    assert [p.split(" (")[0] for p in check(write(folder, body))] == [
        "connector total: enumeration Gear has no definition"
    ]


def test_mappings_one_after_the_other_are_one_mapping():
    for first in (Mapping({1: 2, 3: 4}), Mapping({1: 2, 3: 4}, False)):
        for second in (Mapping({2: 1, 5: 6, 4: 4}), Mapping({2: 1, 5: 6}, False)):
            both = first.then(second)
            for value in range(8):
                between = first(value)
                assert both(value) == (None if between is None else second(between))


def test_a_fault_of_a_mapped_connection_is_mapped_with_it(folder, loop):
    wires = [
        connection("a.total -> b.n", mapping("Integer", {3: -7, 6: 5})),
        connection("a.inverted -> b.on", mapping("Boolean", {"true": "false"})),
    ]
    path = write(folder, two(folder, wires=wires))
    text = '[[faults]]\nsignal = "{}"\nkind = "stuck"\nvalue = 3\nstart = 0.5\n'
    for signal, received in (("a.total", [0.0, -7.0, -7.0]), ("b.n", [0.0, -7.0, 3.0])):
        (folder / "s.toml").write_text(text.format(signal))
        table = run(path, loop=loop, scenario=folder / "s.toml")
        assert table["b.n"].tolist() == received
        assert table["b.on"].tolist() == [0.0] * 3
