"""What time series, stuck connections and changed parameters may bring: the checks that start values get, and items of
enumerations by name and number.
"""

import numpy as np
import pytest
from flat_options import grouped
from ssp_writer import component, connection, edit_fmu, enumerations, linear, system, units, write

from twip.cosim import load, simulate
from twip.cosim.scenario.live_inputs import LiveInputs
from twip.errors import TwipError

STEP = 0.25
ITEMS = {"off": 0, "on": 1, "err": 5}
DEFINED = enumerations(Mode=ITEMS) + units("m m=1;cm m=1 factor=0.01")
CSV = "time,{}\n0,{}\n"


@pytest.fixture
def path(fmus, tmp_path):
    """`e.n` and `f.n` are enumerations, `e.n` drives `f.n` by `e.total`; `r.u` is from 0 to 1 m."""
    given = {"total": ITEMS, "n": ITEMS}
    edit_fmu(fmus / "CosimMixed.fmu", tmp_path / "E.fmu", enums=given)
    tuned = {"n": {"causality": "parameter", "variability": "tunable"}}
    edit_fmu(fmus / "CosimMixed.fmu", tmp_path / "P.fmu", enums={"n": ITEMS}, variables=tuned)
    bounds = {"u": {"min": 0, "max": 1, "unit": "m"}}
    edit_fmu(fmus / "CosimGain.fmu", tmp_path / "R.fmu", variables=bounds, definitions="m m=1")
    parts = [
        component("e", "E.fmu", "n>:Mode total<:Mode"),
        component("f", "E.fmu", "n>:Mode"),
        component("p", "P.fmu", "total<:Integer"),
        component("r", "R.fmu", "u>:Real[m]"),
        component("s", "R.fmu", "u>:Real[m] y<"),
        component("t", "R.fmu", "u> y<"),
        component("m", "E.fmu", "n>:Mode"),
    ]
    wires = [
        connection("e.total -> f.n"),
        connection("length -> s.u"),
        connection("s.y -> t.u", linear(factor=10)),
        connection("number -> m.n"),
    ]
    return write(
        tmp_path,
        system(parts, wires, "length>:Real[cm] number>:Integer"),
        tail=DEFINED + '<ssd:DefaultExperiment stopTime="1"/>',
    )


def run(path, text="", csv=None, **options):
    (path.parent / "s.toml").write_text(text, encoding="utf-8")
    if csv is not None:
        (path.parent / "i.csv").write_text(csv, encoding="utf-8")
        options["input_file"] = path.parent / "i.csv"
    given = {"step_size": STEP, "loop": "python", "scenario": path.parent / "s.toml", **options}
    with load(path, start_values={"e.n": 0, "p.n": 0, "m.n": 0}) as loaded:
        return simulate(loaded, **grouped(**given))


def stuck(signal, value):
    return f'[[faults]]\nsignal = "{signal}"\nkind = "stuck"\nvalue = {value}\n'


@pytest.mark.parametrize("value", ["'err'", "5", "5.0"])
def test_items_are_taken_by_name_and_number(path, loop, value):
    parameter = f'[[parameters]]\ntime = 0\nname = "p.n"\nvalue = {value}\n'
    text = f'[inputs]\n"e.n" = [[0, {value}]]\n{parameter}{stuck("f.n", value)}'
    result = run(path, text, CSV.format("m.smooth", 1), loop=loop, stop_time=STEP)
    assert (result["e.n"][-1], result["f.n"][-1], result["p.total"][-1]) == (5.0, 5.0, 5.0)
    assert "fault begins: f.n is stuck at err" in [event.text for event in result.events]
    result = run(path, csv=CSV.format("e.n", value.strip("'")), loop=loop, stop_time=STEP)
    assert result["e.n"][-1] == 5.0


def test_a_stuck_output_is_one_of_its_own_items(path):
    result = run(path, stuck("e.total", '"on"'))
    assert result["f.n"].tolist() == [0.0, 1.0, 1.0, 1.0, 1.0]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            '[inputs]\n"e.n" = [[0, 1], [1, 3]]\n',
            "inputs.e.n[1] = 3 must be an item of the enumeration (s.toml line 2)",
        ),
        ('[inputs]\n"e.n" = [[0, "ON"]]\n', "inputs.e.n[0] = 'ON' must be an item of the enumeration (s.toml line 2)"),
        ('[inputs]\n"e.n" = [[0, 0.5]]\n', "inputs.e.n[0] = 0.5 must be an item of the enumeration (s.toml line 2)"),
        ('[inputs]\n"e.n" = [[0, true]]\n', "inputs.e.n[0] = true must be an item of the enumeration (s.toml line 2)"),
        (
            "[inputs]\nnumber = [[0, 3]]\n",
            "inputs.number[0] = 3 has no value for m.n: it is not mapped (s.toml line 2)",
        ),
        ('[inputs]\n"r.u" = [[0, 5]]\n', "inputs.r.u[0] = 5.0 m must be at most 1.0 m (s.toml line 2)"),
        ('[inputs]\n"r.u" = [[0, -0.1]]\n', "inputs.r.u[0] = -0.1 m must be at least 0.0 m (s.toml line 2)"),
        (
            "[inputs]\nlength = [[0, 99], [1, 500]]\n",
            "inputs.length[1] = 500.0: s.u = 5.0 m must be at most 1.0 m (s.toml line 2)",
        ),
        (stuck("f.n", 3), "faults[0].value = 3 must be an item of the enumeration (s.toml line 4)"),
        (stuck("e.total", "'of'"), "faults[0].value = 'of' must be an item of the enumeration (s.toml line 4)"),
        (stuck("t.u", 2), "faults[0].value = 2.0 m must be at most 1.0 m (s.toml line 4)"),
        (stuck("s.y", 0.2), "faults[0].value = 0.2: t.u = 2.0 m must be at most 1.0 m (s.toml line 4)"),
        (
            stuck("s.y", 1e308),
            "faults[0].value = 1e+308: t.u cannot take inf, which is not finite (s.toml line 4)",
        ),
        (
            '[[parameters]]\ntime = 0\nname = "p.n"\nvalue = 3\n',
            "parameters[0]: p.n = 3 must be an item of the enumeration (s.toml line 4)",
        ),
    ],
)
def test_what_no_input_takes_is_refused_with_its_place(path, text, message):
    with pytest.raises(TwipError) as failure:
        run(path, text)
    assert str(failure.value) == message


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("e.n", "3", "e.n = '3' must be an item of the enumeration"),
        ("e.n", "1_0", "e.n = '1_0' must be an item of the enumeration"),
        ("e.n", "1e999999999", "e.n = '1e999999999' must be an item of the enumeration"),
        ("number", "3", "number = 3 has no value for m.n: it is not mapped"),
        ("r.u", "1.5", "r.u = 1.5 m must be at most 1.0 m"),
        ("length", "-1", "length = -1.0: s.u = -0.01 m must be at least 0.0 m"),
    ],
)
def test_a_file_of_inputs_is_checked_alike(path, name, value, message):
    with pytest.raises(TwipError) as failure:
        run(path, csv=CSV.format(name, value))
    assert str(failure.value) == f"{message} (i.csv line 2)"


def test_live_inputs_are_items_too(path):
    with load(path, start_values={"e.n": 0}) as loaded:
        inputs = LiveInputs(loaded, ["e.n"])
        inputs["e.n"] = 5
        with pytest.raises(TwipError, match=r"e\.n cannot take 3, which is no item of the enumeration"):
            inputs["e.n"] = 3
        assert inputs["e.n"] == 5.0


def mixed(folder, wires, ports="u>"):
    parts = [component("m", "CosimMixed.fmu", "smooth> held>"), component("g", "CosimGain.fmu", "u>")]
    return write(folder, system(parts, [connection(wire) for wire in wires], ports))


def driven(path, rows, loop, **options):
    (path.parent / "i.csv").write_text(f"time,u\n{rows}", encoding="utf-8")
    with load(path) as loaded:
        return simulate(loaded, step_size=STEP, **grouped(input_file=path.parent / "i.csv", loop=loop, **options))


LINE = [0.0, 0.0, 1.0, 2.0, 3.0]
"""What the steps to 1 s take of a line from 0 at 0 s to 4 at 1 s, after initialization with its first value."""


@pytest.mark.parametrize("inner", [False, True])
def test_a_connector_is_held_for_a_discrete_input(folder, loop, inner):
    if inner:
        inside = system([component("m", "CosimMixed.fmu", "held>")], [connection("v -> m.held")], "v>", name="in")
        path, name = write(folder, system([inside], [connection("u -> in.v")], "u>")), "in.m.held"
    else:
        path, name = mixed(folder, ["u -> m.held"]), "m.held"
    result = driven(path, "0,0\n1,4\n", loop)
    assert result["u"].tolist() == result[name].tolist() == [0.0] * 5
    assert result.warnings == ()


def test_a_connector_is_linear_for_continuous_inputs(folder, loop):
    path = mixed(folder, ["u -> m.smooth", "u -> g.u"])
    result = driven(path, "0,0\n1,4\n", loop)
    assert result["m.smooth"].tolist() == result["g.u"].tolist() == LINE
    assert result.warnings == ()


def test_a_connector_to_inputs_of_both_kinds_is_held_with_a_warning(folder, loop):
    path = mixed(folder, ["u -> m.smooth", "u -> m.held"])
    result = driven(path, "0,0\n1,4\n", loop)
    assert result["m.smooth"].tolist() == result["m.held"].tolist() == [0.0] * 5
    assert result.warnings == ("u is held between the rows of its time series, as m.held behind it is discrete",)
    steps = driven(path, "0,0\n0.5,0\n0.5,4\n1,4\n", loop)  # nothing is lost
    assert steps["m.smooth"].tolist() == steps["m.held"].tolist() == [0.0, 0.0, 0.0, 4.0, 4.0]
    assert steps.warnings == ()


def test_a_line_between_the_ends_of_the_range_has_its_values(folder, loop):
    """The difference of its ends is beyond float64."""
    path, end = mixed(folder, ["u -> m.smooth"]), 1.5 * 2.0**1023
    with np.errstate(all="raise"):
        result = driven(path, f"0,{-end}\n1,{end}\n", loop)
    assert result["m.smooth"].tolist() == [-end, -end, -end / 2.0, 0.0, end / 2.0]
