"""FMI 3.0 beside 2.0: every type, arrays, and systems of both, in both loops, against closed forms and fmpy."""

import fmpy
import numpy as np
import pytest
from echo_fmu import NUMBERS, compiled, echo2, echo3
from flat_options import grouped
from ssp_writer import bind, connection, linear, system, write

from twip.cli import main
from twip.cosim import CsvSink, Inputs, Runtime, Table, check, load, simulate
from twip.cosim.log import playback
from twip.cosim.sinks.mcap_log import McapLog
from twip.errors import TwipError

WHOLE = [name for name in NUMBERS if "Int" in name]
LIMITS = {
    name: (-(2 ** (int(name.strip("UInt")) - 1)), 2 ** (int(name.strip("UInt")) - 1) - 1)
    if name[0] == "I"
    else (0, 2 ** int(name.strip("UInt")) - 1)
    for name in WHOLE
}


@pytest.fixture(scope="session")
def libraries(tmp_path_factory):
    folder = tmp_path_factory.mktemp("libraries")
    return {name: compiled(name, folder) for name in ("echo2", "echo3")}


@pytest.fixture
def c_folder(libraries, tmp_path):
    echo2(tmp_path, libraries["echo2"])
    echo3(tmp_path, libraries["echo3"])
    return tmp_path


def run(path, *, loop, start_values=None, step_size=0.125, **options):
    with load(path, start_values=start_values or {}) as loaded:
        table = Table(loaded.channels)
        result = simulate(loaded, sinks=[table], step_size=step_size, **grouped(loop=loop, **options))
    return table, result


def ports(types, arrays=(), kinds="io"):
    """Return the connectors of an echo3 component, as `ssp_writer.connectors` wants them."""
    found = []
    for type_ in types:
        found += [f"in_{type_}>" * ("i" in kinds), f"out_{type_}<" * ("o" in kinds)]
    for type_ in arrays:
        found += [f"ins_{type_}[{i}]>" for i in (1, 2, 3)] + [f"outs_{type_}[{i}]<" for i in (1, 2, 3)]
    return " ".join(found)


def element(name, source, connectors=()):
    """Return a component whose connectors are given as (name, kind): their names may hold brackets."""
    items = "".join(f'<ssd:Connector name="{n}" kind="{k}"/>' for n, k in connectors)
    return f'<ssd:Component name="{name}" source="{source}"><ssd:Connectors>{items}</ssd:Connectors></ssd:Component>'


def echo(name, source="echo3.fmu"):
    """Return a component with every connector of echo3."""
    found = [("u", "input"), ("x", "output")]
    for type_ in NUMBERS:
        found += [(f"in_{type_}", "input"), (f"out_{type_}", "output")]
        found += [(f"ins_{type_}[{i}]", "input") for i in (1, 2, 3)]
        found += [(f"outs_{type_}[{i}]", "output") for i in (1, 2, 3)]
    return element(name, source, found)


def test_a_chain_of_both_versions_integrates_a_polynomial(c_folder, loop):
    """x1' = 2, x2' = x1, x3' = x2 by forward Euler with Jacobi: x_j = h^j * binomial(k, j) * 2."""
    parts = [
        element(n, f, [("u", "input"), ("x", "output")])
        for n, f in zip("abc", ["echo3.fmu", "echo2.fmu", "echo3.fmu"], strict=True)
    ]
    path = write(c_folder, system(parts, [connection("a.x -> b.u"), connection("b.x -> c.u")]))
    table, _ = run(path, loop=loop, start_values={"a.u": 2.0})
    k = np.arange(9.0)
    assert np.array_equal(table["a.x"], 2.0 * 0.125 * k)
    assert np.array_equal(table["b.x"], 2.0 * 0.125**2 * k * (k - 1) / 2)
    assert np.array_equal(table["c.x"], 2.0 * 0.125**3 * k * (k - 1) * (k - 2) / 6)


@pytest.mark.parametrize("coupling", ["jacobi", "gauss-seidel"])
def test_values_of_every_type_pass_three_components(c_folder, loop, coupling):
    """Scalars one by one, arrays element by element; an echo turns arrays round, two of them turn them back."""
    wires = []
    for source, target in ("ab", "bc"):
        for type_ in NUMBERS:
            wires.append(connection(f"{source}.out_{type_} -> {target}.in_{type_}"))
            wires += [connection(f"{source}.outs_{type_}[{i}] -> {target}.ins_{type_}[{i}]") for i in (1, 2, 3)]
    path = write(c_folder, system([echo("a"), echo("b"), echo("c")], wires))
    given = {"Float64": 0.1, "Float32": 0.1, "Boolean": True, "String": 'naïve, "text"\nwith lines'}
    values = {type_: given.get(type_, min(LIMITS.get(type_, (0, 1))[1], 2**53)) for type_ in NUMBERS}
    lists = {type_: [0, 1, 2] for type_ in WHOLE} | {
        "Float64": [1.5, -2.5, 1e300],
        "Float32": [0.1, -2.5, 1e30],
        "Boolean": [True, False, False],
        "String": ["x", "", "zz"],
    }
    start_values = {f"a.in_{type_}": value for type_, value in values.items()}
    start_values |= {f"a.ins_{type_}[{i}]": v for type_, vs in lists.items() for i, v in enumerate(vs, 1)}
    table, _ = run(path, loop=loop, start_values=start_values, coupling=coupling)
    for type_ in NUMBERS:
        rounded = np.float32 if type_ == "Float32" else lambda value: value
        assert table[f"c.out_{type_}"][-1] == rounded(values[type_]), type_
        expected = [rounded(v) for v in lists[type_]]
        assert [table[f"c.outs_{type_}[{i}]"][-1] for i in (3, 2, 1)] == expected, type_
        assert [table[f"b.outs_{type_}[{i}]"][-1] for i in (1, 2, 3)] == expected, type_


def test_both_loops_leave_the_same_bits(c_folder):
    wires = [connection("a.x -> b.u"), connection("b.x -> a.ins_Float64[2]", linear(0.1)), connection("b.x -> a.u")]
    wires += [connection("a.out_Float32 -> b.in_Float32", linear(-1 / 3, 0.7)), connection("b.out_Int8 -> a.in_Int64")]
    wires += [connection(f"a.outs_Int16[{i}] -> b.ins_Int64[{i}]") for i in (1, 2, 3)]
    path = write(c_folder, system([echo("a"), echo("b")], wires))
    (c_folder / "in.csv").write_text(
        "time,a.in_Float32,a.ins_Int16[2],b.in_Int8\n0,0.1,5,1\n0.5,1.7,-3,2\n1,-0.3,7,-7\n"
    )
    tables = [
        run(path, loop=name, step_size=1 / 512, input_file=c_folder / "in.csv")[0] for name in ("python", "compiled")
    ]
    assert tables[0].values.tobytes() == tables[1].values.tobytes()
    for name in ("a.in_Float32", "b.in_Float32"):
        assert np.array_equal(tables[0][name], tables[0][name].astype(np.float32))
        assert len(np.unique(tables[0][name])) > 400
    assert tables[0]["b.ins_Int64[2]"][-1] == -3.0


def test_isolated_fmus_leave_the_same_bits_and_texts(c_folder):
    wires = [connection("a.x -> b.u"), connection("b.x -> a.u", linear(0.3))]
    wires += [connection(f"a.out_{type_} -> b.in_{type_}") for type_ in NUMBERS]
    wires += [connection(f"a.outs_{type_}[{i}] -> b.ins_{type_}[{i}]") for type_ in NUMBERS for i in (1, 2, 3)]
    path = write(c_folder, system([echo("a"), echo("b")], wires))
    start_values = {"a.in_Float32": 0.1, "a.in_Int64": 2**53, "a.in_String": "naïve\n😀", "a.ins_String[2]": "isolated"}
    tables = [
        run(path, loop="python", start_values=start_values, isolate=isolate, step_size=1 / 64)[0]
        for isolate in (False, True)
    ]
    assert tables[0].values.tobytes() == tables[1].values.tobytes()
    assert tables[1]["b.out_String"][-1] == "naïve\n😀"
    assert tables[1]["b.ins_String[2]"][-1] == "isolated"


def test_only_what_changed_is_set(c_folder, loop):
    """Of an array one changed element sets the whole variable, once; nothing else is set."""
    wires = [connection("b.x -> a.ins_Float64[2]"), connection("b.out_String -> a.in_String")]
    path = write(c_folder, system([echo("a"), echo("b")], wires))
    table, _ = run(path, loop=loop, start_values={"b.u": 1.0})
    assert table["a.sets"].tolist() == [0, 0, 1, 2, 3, 4, 5, 6, 7]
    assert [table[f"a.ins_Float64[{i}]"][-1] for i in (1, 2, 3)] == [1.0, 0.875, 3.0]


@pytest.mark.parametrize("type_", WHOLE)
def test_whole_numbers_reach_exactly_to_their_limits(c_folder, loop, type_):
    path = write(c_folder, system([echo("a")]))
    low, high = (max(min(v, 2**53), -(2**53)) for v in LIMITS[type_])
    table, _ = run(path, loop=loop, start_values={f"a.in_{type_}": low, f"a.ins_{type_}[3]": high})
    assert (table[f"a.out_{type_}"][-1], table[f"a.outs_{type_}[1]"][-1]) == (low, high)
    for beyond in (LIMITS[type_][0] - 1, LIMITS[type_][1] + 1):
        with pytest.raises(TwipError, match=rf"in_{type_} = '{beyond}' must be "):
            load(path, start_values={f"a.in_{type_}": beyond})


def test_what_float64_cannot_hold_is_refused_not_rounded(c_folder, loop):
    path = write(c_folder, system([echo("a")]))
    refusals = {
        7: "fmi3GetFloat64 gave out_Float64 = nan, which is not finite",
        8: "fmi3GetInt64 gave out_Int64 = 9007199254740993, which is beyond ±2^53, where float64 no longer",
        9: "fmi3GetUInt64 gave outs_UInt64[2] = 18446744073709551615, which is beyond ±2^53",
        10: "fmi3GetFloat32 gave out_Float32 = inf, which is not finite",
    }
    for mode, text in refusals.items():
        with load(path, start_values={"a.mode": mode, "a.at": 0.5}) as loaded:
            table = Table(loaded.channels)
            with pytest.raises(TwipError) as failure:
                simulate(loaded, sinks=[table], runtime=Runtime(loop=loop), step_size=0.125)
        assert str(failure.value).startswith(f"a failed at t = 0.5 s: {text}")
        assert table.times.tolist() == [0.0, 0.125, 0.25, 0.375]


@pytest.mark.parametrize(("source", "target"), [("Int64", "Int8"), ("Int8", "UInt32"), ("Float64", "Float32")])
def test_a_type_that_does_not_hold_every_value_is_refused(c_folder, source, target):
    path = write(c_folder, system([echo("a"), echo("b")], [connection(f"a.out_{source} -> b.in_{target}")]))
    assert "types differ" in "".join(check(path))


def test_a_value_beyond_float32_fails_in_both_loops_alike(c_folder, loop):
    (c_folder / "in.csv").write_text("time,a.in_Float32\n0,0\n0.5,0\n0.5,2\n")
    path = write(
        c_folder, system([echo("a"), echo("b")], [connection("a.out_Float32 -> b.in_Float32", linear(3e38, -1.0))])
    )
    with pytest.raises(TwipError) as failure:
        run(path, loop=loop, input_file=c_folder / "in.csv")
    assert (
        str(failure.value)
        == "b failed at t = 0.625 s: fmi3SetFloat32 cannot take in_Float32 = inf, which is not finite"
    )


def test_every_status_of_a_step(c_folder, loop):
    path = write(c_folder, system([echo("a"), echo("b", "echo3.fmu")]))
    ends = {
        2: "fmi3DoStep returned discard: 100%s sure: no",
        3: "fmi3DoStep returned error: out of range",
        4: "fmi3DoStep returned fatal: broken",
        6: "fmi3DoStep returned early, at 0.4375 s, which it was not allowed to",
    }
    for mode, text in ends.items():
        with load(path, start_values={"b.mode": mode, "b.at": 0.5}) as loaded:
            table = Table(loaded.channels)
            with pytest.raises(TwipError) as failure:
                simulate(loaded, sinks=[table], runtime=Runtime(loop=loop), step_size=0.125)
        assert str(failure.value) == f"b failed at t = 0.375 s: {text}"
        assert table.times.tolist() == [0.0, 0.125, 0.25, 0.375]


@pytest.mark.parametrize("isolate", [False, True])
def test_an_fmu_that_asks_for_it_ends_the_run(c_folder, loop, isolate):
    path = write(c_folder, system([echo("a"), echo("b", "echo3.fmu")]))
    table, result = run(path, loop=None if isolate else loop, isolate=isolate, start_values={"b.mode": 5, "b.at": 0.5})
    said = "b asked to end the simulation, at t = 0.5 s, in the step from t = 0.375 s"
    assert (result.ended, result.time, result.interrupted) == (said, 0.375, False)
    assert table.times.tolist() == [0.0, 0.125, 0.25, 0.375]
    assert [(e.time, e.level, e.text) for e in table.events] == [(0.375, "info", said)]


def test_warnings_and_events_without_event_mode_do_not_end_a_run(c_folder, loop):
    path = write(c_folder, system([echo("a")]))
    table, result = run(path, loop=loop, start_values={"a.mode": 1, "a.at": 0.9})
    assert result.steps == 8
    assert [(e.time, e.level, e.text) for e in table.events] == [(0.875, "warning", "careful")]
    assert run(path, loop=loop, start_values={"a.mode": 11, "a.at": 0.5})[1].steps == 8


def test_a_saved_run_goes_on_with_the_same_bits(c_folder, loop):
    wires = [
        connection("a.x -> b.u"),
        connection("a.out_String -> b.ins_String[2]"),
        connection("e.x -> b.ins_Float64[2]"),
    ]
    body = system([echo("a"), echo("b"), element("e", "echo2.fmu", [("u", "input"), ("x", "output")])], wires)
    path, file = write(c_folder, body), c_folder / "x.checkpoint"
    (c_folder / "in.csv").write_text("time,a.u,a.in_String,e.u\n0,0.3,one,0.1\n0.4,-0.7,two,0.2\n0.8,0,three,1\n")
    options = {"loop": loop, "step_size": 0.01, "input_file": c_folder / "in.csv"}
    whole, _ = run(path, stop_time=1.0, **options)
    run(path, stop_time=0.6, checkpoint=file, **options)
    rest, _ = run(path, stop_time=1.0, resume=file, **options)
    assert rest.values.tobytes() == whole.values[60:].tobytes()
    assert rest["b.outs_String[2]"].tolist() == whole["b.outs_String[2]"][60:].tolist()
    assert set(rest["b.outs_String[2]"]) == {"two", "three"}


def test_fmpy_gets_the_same(c_folder, loop):
    path = write(c_folder, system([echo("a")]))
    table, _ = run(path, loop=loop, start_values={"a.u": 0.3, "a.in_Int16": -7, "a.in_Float32": 0.1})
    names = ["x", "out_Int16", "out_Float32"]
    expected = fmpy.simulate_fmu(
        c_folder / "echo3.fmu",
        stop_time=1.0,
        output_interval=0.125,
        step_size=0.125,
        start_values={"u": 0.3, "in_Int16": -7, "in_Float32": 0.1},
        output=names,
        fmi_type="CoSimulation",
    )
    for name in names:
        assert np.array_equal(table[f"a.{name}"], expected[name].astype(np.float64)), name


def test_logs_and_csv_keep_every_type(c_folder, loop):
    wires = [connection("a.x -> b.u"), connection("a.out_String -> b.in_String")]
    path = write(c_folder, system([echo("a"), echo("b")], wires, "s>:String o<:String"))
    text = write(
        c_folder,
        system(
            [echo("a"), echo("b")],
            [*wires, connection("s -> a.in_String"), connection("b.out_String -> o")],
            "s>:String o<:String",
        ),
    )
    assert text == path
    (c_folder / "in.csv").write_text('time,s,a.in_Int64,a.in_Float32\n0,"a, b",1,0.1\n0.5,ünï,9007199254740992,0.2\n')
    with load(path) as loaded:
        table = Table(loaded.channels)
        sinks = [table, McapLog(c_folder / "a.mcap", loaded.channels, {}), CsvSink(c_folder / "a.csv", loaded.channels)]
        simulate(
            loaded, sinks=sinks, runtime=Runtime(loop=loop), step_size=1 / 512, inputs=Inputs(file=c_folder / "in.csv")
        )
    log = playback.read(c_folder / "a.mcap")
    assert log.channels == tuple(type(c)(c.component, c.signals) for c in loaded.channels)
    assert log.table().tobytes() == table.values.tobytes()
    assert np.array_equal(log.times, table.times)
    assert log["o"].tolist() == table["o"].tolist()
    assert log["a.in_Int64"].dtype == np.int64
    assert log["a.in_Int64"][-1] == 2**53
    assert set(log["o"].tolist()) == {"", "a, b", "ünï"} - ({""} if log["o"][0] else set())
    lines = (c_folder / "a.csv").read_text(encoding="utf-8").splitlines()
    column = lines[0].split(",").index("s")
    assert lines[-1].split(",")[column] == "ünï"
    assert '"a, b"' in lines[100]


def test_parameters_of_every_type(c_folder, loop):
    values = {
        "table[2,1]": ("Real", "7.5"),
        "mode": ("Integer", "0"),
        "ins_UInt64[2]": ("Integer", "12"),
        "in_String": ("String", "hello"),
        "in_Boolean": ("Boolean", "true"),
        "in_Float32": ("Real", "0.1"),
    }
    inner = bind(values)
    path = write(
        c_folder,
        system([echo("a").replace("</ssd:Component>", inner + "</ssd:Component>")]),
    )
    table, _ = run(path, loop=loop)
    assert table["a.out_String"][-1] == "hello"
    assert table["a.outs_UInt64[2]"][-1] == 12
    assert table["a.out_Boolean"][-1] == 1.0
    assert table["a.out_Float32"][-1] == np.float32(0.1)
    assert table["a.outs_Float64[3]"][-1] == 1.0


def test_scenarios_of_every_type(c_folder, loop):
    wires = [
        connection("a.out_String -> b.ins_String[2]"),
        connection("a.out_Int64 -> b.in_Int64"),
        connection("a.out_Float32 -> b.in_Float32"),
    ]
    path = write(c_folder, system([echo("a"), echo("b")], wires))
    faults = {"b.ins_String[2]": '"ünï"', "b.in_Int64": "-9007199254740992", "b.in_Float32": "0.5"}
    text = '[inputs]\n"a.in_String" = [[0, "one"], [0.25, "two"]]\n"a.in_Int64" = [[0, 7]]\n'
    text += '[[faults]]\nsignal = "a.out_String"\nkind = "dropout"\nstart = 0.25\n'
    for signal, value in faults.items():
        text += f'[[faults]]\nsignal = "{signal}"\nkind = "stuck"\nvalue = {value}\nstart = 0.5\nstop = 0.75\n'
    (c_folder / "s.toml").write_text(text, encoding="utf-8")
    options = {"loop": loop, "scenario": c_folder / "s.toml", "coupling": "gauss-seidel"}
    table, _ = run(path, **options)
    stuck = slice(5, 7)
    assert table["b.ins_String[2]"][stuck].tolist() == ["ünï"] * 2
    assert table["b.ins_String[2]"][7:].tolist() == ["one"] * 2
    assert table["b.in_Int64"].tolist() == [7.0] * 5 + [-(2.0**53)] * 2 + [7.0] * 2
    assert table["b.in_Float32"][stuck].tolist() == [0.5] * 2
    assert "fault begins: b.ins_String[2] is stuck at 'ünï'" in [e.text for e in table.events]
    file = c_folder / "x.checkpoint"
    run(path, **options, stop_time=0.625, checkpoint=file)
    rest, _ = run(path, **options, stop_time=1.0, resume=file)
    assert rest.values.tobytes() == table.values[5:].tobytes()
    (c_folder / "s.toml").write_text('[[faults]]\nsignal = "b.ins_String[2]"\nkind = "delay"\ndelay = 0.25\n')
    with pytest.raises(TwipError, match="a String cannot be delayed"):
        run(path, **options)


def test_a_text_with_a_nul_is_refused_wherever_it_comes_from(c_folder):
    """In C it would end there, while the log showed all of it."""
    path = write(c_folder, system([echo("a"), echo("b")], [connection("a.out_String -> b.ins_String[2]")]))
    (c_folder / "s.toml").write_text(
        '[inputs]\n"a.in_String" = [[0, "x\\u0000y"]]\n'
        '[[faults]]\nsignal = "b.ins_String[2]"\nkind = "stuck"\nvalue = "x\\u0000y"\n'
    )
    (c_folder / "in.csv").write_text("time,b.in_String\n0,x\0y\n")
    rule = r"'x\x00y' must be a String of Unicode characters without NUL"
    with pytest.raises(TwipError) as refused:
        run(path, loop="python", scenario=c_folder / "s.toml", input_file=c_folder / "in.csv")
    assert str(refused.value).splitlines() == [
        f"b.in_String = {rule} (in.csv line 2)",
        f"inputs.a.in_String[0] = {rule} (s.toml line 2)",
        f"faults[0].value = {rule} (s.toml line 6)",
    ]
    with pytest.raises(TwipError, match=r"in_String = .* without NUL"):
        run(path, loop="python", start_values={"a.in_String": "x\0y"})


def test_check_tells_versions(c_folder, capsys):
    path = write(c_folder, system([echo("a"), element("e", "echo2.fmu", [("u", "input"), ("x", "output")])]))
    assert main(["check", str(path), "--step-size", "0.5"]) == 0
    said = capsys.readouterr().out
    assert "echo3.fmu, FMI 3.0, " in said
    assert "echo2.fmu, FMI 2.0, " in said
    assert main(["check", str(c_folder / "echo3.fmu")]) == 0
    assert "echo3.fmu, FMI 3.0 co-simulation" in capsys.readouterr().out
