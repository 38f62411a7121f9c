"""Scenario files: faults, parameter changes and time series with closed-form answers."""

import numpy as np
import pytest
from flat_options import grouped
from scenario_system import DEPENDS, EVERYTHING, STEP, fault, run, wired
from ssp_writer import component, connection, edit_fmu, linear, system, write

from twip.cosim import Inputs, Table, load, simulate
from twip.cosim.coupling.coupling import Coupling
from twip.cosim.coupling.scheduling import make_schedule
from twip.cosim.scenario.failing import Faults
from twip.cosim.scenario.faults.base import Amount
from twip.cosim.scenario.faults.stuck import Stuck
from twip.cosim.values.conversion import Conversion
from twip.errors import TwipError


@pytest.fixture
def path(fmus, tmp_path):
    return wired(fmus, tmp_path)


TIMES = np.arange(33) * STEP
DURING = (TIMES > 1.0) & (TIMES <= 2.0)  # rows of the steps that begin from 1 s on, before 2 s
ONE_TO_TWO = {"start": 1.0, "stop": 2.0}


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (fault("stuck", value=7.5, **ONE_TO_TWO), np.where(DURING, 7.5, TIMES)),
        (fault("stuck", **ONE_TO_TWO), np.where(DURING, 1.0, TIMES)),
        (fault("dropout", **ONE_TO_TWO), np.where(DURING, 1.0, TIMES)),
        (fault("bias", value=-3, **ONE_TO_TWO), np.where(DURING, TIMES - 3.0, TIMES)),
        (fault("delay", delay=0.375, **ONE_TO_TWO), np.where(DURING, TIMES - 0.375, TIMES)),
        (fault("delay", delay=0.5), np.maximum(TIMES - 0.5, 0.0)),
        (fault("delay", delay=3.875), np.maximum(TIMES - 3.875, 0.0)),
        # one after the other, in the order of the file: what is delayed is the biased value, and not the reverse
        (
            fault("bias", value=1, **ONE_TO_TWO) + fault("delay", delay=0.5),
            np.where((TIMES > 1.5) & (TIMES <= 2.5), TIMES + 0.5, np.maximum(TIMES - 0.5, 0.0)),
        ),
        (
            fault("delay", delay=0.5) + fault("bias", value=1, **ONE_TO_TWO),
            np.maximum(TIMES - 0.5, 0.0) + np.where(DURING, 1.0, 0.0),
        ),
    ],
)
def test_faults_have_their_closed_form(path, loop, text, expected):
    table, _ = run(path, text, loop=loop)
    assert table.times.tolist() == TIMES.tolist()
    expected[0] = 0.0  # row 0 is the initialized system
    assert table["g.u"].tolist() == expected.tolist()
    assert table["g.y"].tolist() == (2.0 * expected).tolist()
    assert table["out"].tolist() == (2.0 * expected).tolist()
    assert table["h.u"].tolist() == (2.0 * TIMES).tolist()  # another connection of the same output


def test_a_fault_of_an_output_is_one_of_all_its_connections_in_its_unit(path, loop):
    table, _ = run(
        path, fault("bias", "a.x", value=1, **ONE_TO_TWO) + fault("stuck", "a.x", value=5, start=3), loop=loop
    )
    expected = np.where(TIMES > 3.0, 5.0, np.where(DURING, TIMES + 1.0, TIMES))
    assert table["g.u"].tolist() == expected.tolist()
    assert table["h.u"].tolist() == (2.0 * expected).tolist()
    assert table["a.x"].tolist() == TIMES.tolist()  # the output itself stays


def test_with_jacobi_the_value_at_the_beginning_of_the_step_arrives(path, loop):
    table, _ = run(path, fault("delay", delay=0.25), loop=loop, coupling="jacobi")
    assert table["g.u"].tolist() == np.maximum(TIMES - 0.375, 0.0).tolist()


def test_faults_of_integers_and_booleans(path, loop):
    text = fault("stuck", "n.n", value=-4, **ONE_TO_TWO) + fault("stuck", "n.on", value="false", **ONE_TO_TWO)
    table, _ = run(path, text + fault("delay", "n.n", delay=0.25), loop=loop)
    total = np.where(DURING, -4, 3 * np.arange(33))
    assert table["n.n"].tolist() == np.concatenate([[0, 0, 0], total[1:-2]]).tolist()
    assert table["n.on"].tolist() == np.where(DURING, 0.0, 1.0).tolist()


def test_an_extrapolated_input_gets_no_other_jump_than_the_faults(path, loop):
    # at the middle of the step the ramp is half a step lower than at its end
    text = fault("bias", value=1, **ONE_TO_TWO) + fault("stuck", start=3)
    table, _ = run(path, text, loop=loop, mid_step=["g.u"])
    middle = TIMES - STEP / 2
    expected = np.where(TIMES > 3.0, 3.0 - STEP / 2, np.where(DURING, middle + 1.0, middle))
    assert table["g.u"][2:].tolist() == expected[2:].tolist()


def test_times_between_points_count_from_the_next_point(path, loop):
    table, _ = run(path, fault("bias", value=1, start=1.001, stop=1.25 + 1e-12), loop=loop)
    assert table.times[table["g.u"] != TIMES].tolist() == [1.25]


def test_noise_is_seeded_and_has_its_deviation(path):
    text = fault("noise", deviation=0.5, seed=7)
    runs = {}
    for loop in ("compiled", "python"):
        table, _ = run(path, text, stop_time=256.0, loop=loop)
        runs[loop] = (table["g.u"] - table["a.x"])[1:]
    assert runs["compiled"].tolist() == runs["python"].tolist()
    noise = runs["python"]
    # 2048 values; 4 standard errors of the mean, of the variance and of the correlation of neighbours
    assert abs(noise.mean()) < 4 * 0.5 / np.sqrt(2048)
    assert abs(noise.var() / 0.25 - 1.0) < 4 * np.sqrt(2 / 2048)
    assert abs(np.corrcoef(noise[1:], noise[:-1])[0, 1]) < 4 / np.sqrt(2048)
    other, _ = run(path, fault("noise", deviation=0.5, seed=8), stop_time=256.0, loop="python")
    assert not np.isin((other["g.u"] - other["a.x"])[1:], noise).any()


def test_two_random_faults_of_one_signal_with_one_seed_are_independent(path):
    """Twice the same noise would have twice its deviation, not the square root of two times."""
    twice = fault("noise", deviation=0.5) + fault("noise", deviation=0.5)
    table, _ = run(path, twice, stop_time=256.0, loop="python")
    noise = (table["g.u"] - table["a.x"])[1:]
    assert abs(noise.var() / 0.5 - 1.0) < 4 * np.sqrt(2 / 2048)
    lost = fault("noise", deviation=0.5) + fault("dropout", probability=0.5)
    table, _ = run(path, lost, stop_time=256.0, loop="python")
    kept = (table["g.u"] - table["a.x"])[1:][np.diff(table["g.u"]) != 0.0]
    assert abs(kept.var() / 0.25 - 1.0) < 4 * np.sqrt(2 / 1024)


def test_a_random_dropout_loses_its_share_and_holds_the_last_value(path, loop):
    table, _ = run(path, fault("dropout", probability=0.25, seed=1), stop_time=128.0, loop=loop)
    got, sent = table["g.u"], table["a.x"]
    lost = got != sent
    assert got[lost].tolist() == got[np.flatnonzero(lost) - 1].tolist()
    assert abs(lost[1:].mean() - 0.25) < 4 * np.sqrt(0.25 * 0.75 / 1024)  # 4 standard errors


def test_parameters_change_at_their_time(path, loop):
    text = '[[parameters]]\ntime = 2.0\nname = "g.k"\nvalue = -1\n[[parameters]]\ntime = 0\nname = "h.k"\nvalue = 3.5\n'
    table, _ = run(path, text, loop=loop)
    assert table["g.y"].tolist() == (TIMES * np.where(TIMES > 2.0, -1.0, 2.0)).tolist()
    assert table["h.y"].tolist() == (7.0 * TIMES).tolist()
    told = [(e.time, e.level, e.text) for e in table.events]
    assert told == [(0.0, "info", "parameter h.k = 3.5"), (2.0, "info", "parameter g.k = -1.0")]


def test_time_series_inline_and_from_a_file(path, loop):
    (path.parent / "in.csv").write_text("time,m.held\n0,1\n1,2\n")
    (path.parent / "own.csv").write_text("time,m.on\n0,0\n2,1\n")
    text = (
        'input_file = "in.csv"\n[inputs]\n"m.smooth" = [[0.0, 0.0], [4.0, 8]]\n"a.u" = [[0, 1.0], [1, 1.0], [1, -1.0]]'
    )
    table, _ = run(path, text, loop=loop, input_file=path.parent / "own.csv")
    begins = np.maximum(TIMES - STEP, 0.0)
    assert table["m.smooth"].tolist() == (2.0 * begins).tolist()
    assert table["m.held"].tolist() == np.where(begins < 1.0, 1.0, 2.0).tolist()
    assert table["m.on"].tolist() == np.where(begins < 2.0, 0.0, 1.0).tolist()
    assert table["a.x"].tolist() == np.where(TIMES <= 1.0, TIMES, 2.0 - TIMES).tolist()


def test_what_happens_is_told_with_its_time(path):
    text = fault("bias", "a.x", value=1.5, start=1.01, stop=2) + fault("stuck", start=9)
    table, result = run(path, text)
    assert [(e.time, e.level, e.text) for e in table.events] == [
        (0.0, "warning", "faults[1]: 9 s is not before the stop time, the fault does not occur"),
        (1.125, "info", "fault begins: a.x is biased by 1.5"),
        (2.0, "info", "fault ends: a.x is biased by 1.5"),
    ]
    assert result.warnings == ("faults[1]: 9 s is not before the stop time, the fault does not occur",)


def test_isolated_components_get_the_same(path):
    text = EVERYTHING.replace('kind = "noise"', 'kind = "bias"').replace("deviation", "value")
    tables = [run(path, text, isolate=isolate, loop="python")[0] for isolate in (False, True)]
    assert tables[0].values.tobytes() == tables[1].values.tobytes()
    assert tables[0].events == tables[1].events


@pytest.mark.parametrize("at", [0.125, 1.5, 2.0])
def test_a_resumed_run_is_the_uninterrupted_one(path, loop, at):
    file, saved_by = path.parent / "half", "python" if loop == "compiled" else "compiled"
    whole, _ = run(path, EVERYTHING, loop="python", mid_step=["g.u"])
    first, _ = run(path, EVERYTHING, loop=saved_by, mid_step=["g.u"], stop_time=at, checkpoint=file)
    second, _ = run(path, EVERYTHING, loop=loop, mid_step=["g.u"], resume=file)
    assert np.concatenate([first.values, second.values[1:]]).tobytes() == whole.values.tobytes()
    told = [e for e in first.events + second.events if not e.text.startswith("resumed") and e.level == "info"]
    assert told == whole.events


def test_a_run_with_another_scenario_does_not_go_on(path):
    file = path.parent / "half"
    run(path, fault("bias", value=1), stop_time=1.0, checkpoint=file)
    with pytest.raises(
        TwipError, match=r"faults\[0\] differs: g.u is biased by 2.0 from start to end here, g.u is biased by 1.0 from"
    ):
        run(path, fault("bias", value=2), resume=file)


def test_a_connector_without_time_series_carries_nothing_that_could_fail(folder):
    parts = [component("a", "CosimIntegrator.fmu", "u> x<")]
    path = write(folder, system(parts, [connection("drive -> a.u")], "drive>"))
    with load(path) as loaded:
        (folder / "s.toml").write_text(fault("bias", "drive", value=1))
        with pytest.raises(TwipError, match="no time series drives drive, its connections carry nothing"):
            simulate(loaded, step_size=STEP, inputs=Inputs(scenario=folder / "s.toml"))
        (folder / "s.toml").write_text("[inputs]\ndrive = [[0, 2]]\n" + fault("bias", "drive", value=1, start=0.5))
        table = Table(loaded.channels)
        simulate(loaded, step_size=STEP, sinks=[table], inputs=Inputs(scenario=folder / "s.toml"))
    assert table["a.x"][-1] == 0.5 * 2.0 + 0.5 * 3.0


def test_a_loop_with_a_fault_is_solved(fmus, tmp_path):
    """a.y = 2 (b.y / 8 + bias) and b.y = 2 (a.y / 8 + 1), so that b.y (1 - 1/16) = 2 + bias / 2."""
    gain = edit_fmu(fmus / "CosimGain.fmu", tmp_path / "g.fmu", dependencies=DEPENDS["CosimGain"], state=True).name
    parts = [component(name, gain, "u> y<") for name in "ab"]
    wires = [connection("b.y -> a.u", linear(factor=0.125)), connection("a.y -> b.u", linear(factor=0.125, offset=1))]
    (tmp_path / "s.toml").write_text(fault("bias", "a.u", value=3, start=0.5))
    options = {"step_size": 0.25, "coupling": "iterated", "scenario": tmp_path / "s.toml"}
    result = simulate(load(write(tmp_path, system(parts, wires))), **grouped(**options))
    expected = np.array([2.0, 2.0, 2.0, 3.5, 3.5]) / 0.9375
    np.testing.assert_allclose(result["b.y"], expected, rtol=1e-8)  # the iteration's tolerance
    wires[0] = connection("b.y -> a.u", linear(factor=3))
    (tmp_path / "s.toml").write_text(fault("noise", "a.u", deviation=3, start=0.5))
    with pytest.raises(TwipError, match="does not converge"):
        simulate(load(write(tmp_path, system(parts, wires))), **grouped(**options, options={"maximum_iterations": 1}))


def test_components_with_steps_of_their_own_take_faults_at_their_turn(path):
    # g takes part in every second step: the delay of two steps is one of its own
    text = fault("delay", delay=0.25) + fault("bias", "h.u", value=8, **ONE_TO_TWO)
    table, _ = run(path, text, own_steps={"g": 0.25}, loop="python")
    compiled, _ = run(path, text, own_steps={"g": 0.25}, loop="compiled")
    assert table.values.tobytes() == compiled.values.tobytes()
    turns = TIMES[::2]
    assert table["g.u"][::2].tolist() == np.maximum(turns - 0.25, 0.0).tolist()
    assert table["h.u"].tolist() == (2.0 * TIMES + np.where(DURING, 8.0, 0.0)).tolist()


def test_an_input_behind_a_connector_without_time_series_cannot_fail(folder):
    """Its connection is not there to fail, and no other one may fail in its place."""
    parts = [component(name, "CosimGain.fmu", "u> y<") for name in "ab"]
    path = write(folder, system(parts, [connection("cmd -> a.u"), connection("a.y -> b.u")], "cmd>"))
    with load(path) as loaded:
        (folder / "s.toml").write_text(fault("stuck", "a.u", value=1))
        with pytest.raises(
            TwipError, match=r"^faults\[0\]: no time series drives cmd, its connection to a.u carries no"
        ):
            simulate(loaded, step_size=STEP, inputs=Inputs(scenario=folder / "s.toml"))
        (folder / "s.toml").write_text("[inputs]\ncmd = [[0, 2]]\n" + fault("bias", "a.u", value=1))
        table = Table(loaded.channels)
        simulate(loaded, step_size=STEP, sinks=[table], inputs=Inputs(scenario=folder / "s.toml"))
        assert table["a.u"][-1] == 3.0
        target = loaded.columns.index("a.u")
        value = {"value": Amount(1.0, "1.0")}
        planned = Stuck("faults[0]", "a.u", ((target, Conversion()),), (None, None), 0, 1, value)
        with pytest.raises(TwipError, match=r"nothing is copied to a.u, it cannot fail"):
            Faults([planned], make_schedule(loaded, Coupling()))
