"""Input CSV files: values over time, and every mistake with its line."""

import numpy as np
import pytest
from flat_options import grouped
from ssp_writer import component, connection, system, write

from twip.cosim import Inputs, Table, load, simulate
from twip.errors import TwipError


@pytest.fixture
def path(folder):
    parts = [
        component("m", "CosimMixed.fmu"),
        component("a", "CosimGain.fmu", "u> y<"),
        component("b", "CosimGain.fmu", "u> y<"),
    ]
    return write(folder, system(parts, [connection("a.y -> b.u")]))


def run(path, text, **options):
    (path.parent / "in.csv").write_text(text, encoding="utf-8")
    with load(path) as loaded:
        table = Table(loaded.channels)
        simulate(loaded, sinks=[table], **grouped(input_file=path.parent / "in.csv", **options))
    return table


def test_continuous_inputs_are_linear_and_others_held(path, loop):
    table = run(path, 'time,"m.smooth",m.held,m.n,m.on\n0.2,1,1,1,false\n0.6,3,3,3,true\n', step_size=0.1, loop=loop)
    used = np.array([0.0, *(0.1 * k for k in range(10))])  # the step that ends at row k begins at row k - 1
    # roundings of the interpolation
    np.testing.assert_allclose(table["m.smooth"], np.interp(used, [0.2, 0.6], [1.0, 3.0]), rtol=1e-15, atol=1e-15)
    held = [1.0] * 7 + [3.0] * 4
    assert table["m.held"].tolist() == held
    assert table["m.n"].tolist() == held
    assert table["m.on"].tolist() == [0.0] * 7 + [1.0] * 4


def test_rows_are_reached_although_times_are_rounded(path, loop):
    # 0.001 * 1001 is less than 1.001
    rows = "".join(f"{k / 1000!r},{k}\n" for k in range(1200))
    table = run(path, f"time,m.held\n{rows}", step_size=0.001, stop_time=1.2, loop=loop)
    assert table["m.seen"].tolist() == [0.0, *range(1200)]


def test_two_rows_at_one_time_are_a_jump(path, loop):
    table = run(path, "time,m.smooth\n0,1\n0.5,1\n0.5,4\n1,4\n", step_size=0.25, loop=loop)
    assert table["m.smooth"].tolist() == [1.0, 1.0, 1.0, 4.0, 4.0]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "in.csv: the file is empty"),
        ("time,m.n\n", "in.csv: there are no rows below the header"),
        ("t,m.n\n0,1\n", "the first column must be time, not t (in.csv line 1)"),
        ("time,m.smoth\n0,1\n", "there is no input m.smoth, did you mean m.smooth? (in.csv line 1)"),
        ("time,a.y\n0,1\n", "a.y is not an input (in.csv line 1)"),
        ("time,b.u\n0,1\n", "b.u is connected inside the system and cannot be driven (in.csv line 1)"),
        ("time,a.u,a.u\n0,1,1\n", "column a.u is there twice (in.csv line 1)"),
        ("time,a.u\n0,nan\n", "a.u = 'nan' must be a finite number (in.csv line 2)"),
        ("time,a.u\n0,1\n1,-inf\n", "a.u = '-inf' must be a finite number (in.csv line 3)"),
        ("time,a.u\n0,x\n", "a.u = 'x' must be a finite number (in.csv line 2)"),
        ("time,m.n\n0,1.5\n", "m.n = '1.5' must be an Integer of 32 bits (in.csv line 2)"),
        ("time,m.on\n0,2\n", "m.on = '2' must be true, false, 1 or 0 (in.csv line 2)"),
        ("time,a.u\n0,1\n\n1,1\n0.5,1\n", "time 0.5 follows 1.0: time must increase (in.csv line 5)"),
        ('time,a.u\n0,1\n1,"2\n2,3\n', "not readable as CSV: a quote is not closed (in.csv line 3)"),
        ('time,a.u\n0,"1"2\n', "not readable as CSV: ',' expected after '\"' (in.csv line 2)"),
        ("time,a.u\n0,1,2\n", "3 cells where the header has 2 (in.csv line 2)"),
    ],
)
def test_mistakes_are_named_with_their_line(path, text, message):
    with pytest.raises(TwipError) as failure:
        run(path, text, step_size=0.5)
    assert str(failure.value).removeprefix(f"{path.parent}/") == message


def test_all_mistakes_of_a_file_are_told_together(path):
    with pytest.raises(TwipError) as failure:
        run(path, "time,a.u,m.n\n0,x,1\n1,1,y\n", step_size=0.5)
    assert len(str(failure.value).splitlines()) == 2


def test_a_missing_file_is_named(path):
    with (
        load(path) as loaded,
        pytest.raises(TwipError, match=r"none.csv: cannot be read \(No such file or directory\)"),
    ):
        simulate(loaded, step_size=0.5, inputs=Inputs(file=path.parent / "none.csv"))
