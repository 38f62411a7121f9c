"""Inputs that are set while a system runs."""

import numpy as np
import pytest
from ssp_writer import component, connection, edit_fmu, linear, system, write

from twip.cosim import Algorithm, Checkpoints, Inputs, Observer, Runtime, Table, load, simulate
from twip.cosim.scenario.live_inputs import LiveInputs, limits, open_inputs
from twip.errors import TwipError


@pytest.fixture
def path(folder):
    return write(folder, system([component("a", "CosimGain.fmu", "u> y<")]))


def test_a_value_counts_from_the_next_chunk_on_and_holds(path, loop):
    with load(path) as model:
        inputs = LiveInputs(model, ["a.u"])
        table = Table(model.channels)

        def progress(time):
            if time == pytest.approx(0.2):
                inputs["a.u"] = 3.0

        simulate(
            model,
            stop_time=0.6,
            step_size=0.001,
            sinks=[table],
            runtime=Runtime(loop=loop),
            inputs=Inputs(live=inputs),
            observer=Observer(progress=progress),
        )
    u = table["a.u"]  # a row holds the input of the step that ended there
    np.testing.assert_array_equal(u[:201], np.full(201, u[0]))
    np.testing.assert_array_equal(u[201:], np.full(400, 3.0))


def test_start_values_stay_until_somebody_sets_an_input(path):
    with load(path, start_values={"a.u": 2.5}) as model:
        assert open_inputs(model) == ["a.u"]
        inputs = LiveInputs(model, ["a.u"])
        assert inputs["a.u"] == 2.5
        table = Table(model.channels)
        simulate(model, stop_time=0.01, step_size=0.001, sinks=[table], inputs=Inputs(live=inputs))
        plain = Table(model.channels)
        simulate(model, stop_time=0.01, step_size=0.001, sinks=[plain])
    np.testing.assert_array_equal(table.values, plain.values)


def test_what_a_file_drives_is_left_to_it(path):
    file = path.parent / "u.csv"
    file.write_text("time,a.u\n0,7\n")
    with load(path) as model:
        inputs = LiveInputs(model, ["a.u"])
        table = Table(model.channels)
        simulate(model, stop_time=0.01, step_size=0.001, inputs=Inputs(file=file, live=inputs), sinks=[table])
        assert inputs.names == ()
        with pytest.raises(TwipError, match=r"there is no input a\.u to set"):
            inputs["a.u"] = 1.0
    assert table["a.u"][-1] == 7.0


def test_mistakes_are_told(path):
    with load(path) as model:
        with pytest.raises(TwipError) as raised:
            LiveInputs(model, ["a.y", "b.u"])
        assert len(str(raised.value).splitlines()) == 2
        inputs = LiveInputs(model, ["a.u"])
        with pytest.raises(TwipError, match=r"a\.u cannot take nan, which is not finite"):
            inputs["a.u"] = float("nan")
        with pytest.raises(TwipError, match="a checkpoint cannot hold inputs"):
            simulate(
                model,
                stop_time=0.01,
                step_size=0.001,
                sinks=[],
                inputs=Inputs(live=inputs),
                checkpoints=Checkpoints(file=path.parent / "kept"),
            )


def test_values_that_do_not_fit_the_input_are_refused(folder):
    with load(write(folder, system([component("m", "CosimMixed.fmu")]))) as model:
        inputs = LiveInputs(model, ["m.n", "m.on"])
        inputs["m.n"], inputs["m.on"] = 3, True
        for name, value, why in (
            ("m.n", 1.5, "not a whole number"),
            ("m.n", 2**53 + 1, "2^53"),
            ("m.on", 2, "0 nor 1"),
        ):
            with pytest.raises(TwipError) as raised:
                inputs[name] = value
            assert why in str(raised.value)
        assert (inputs["m.n"], inputs["m.on"]) == (3.0, 1.0)
        for value in (True, "3"):
            with pytest.raises(TwipError, match="which is no number"):
                inputs["m.n"] = value
        assert LiveInputs(model, "m.n").names == ("m.n",)


@pytest.mark.parametrize(
    ("value", "why"),
    [
        (float("nan"), "not finite"),
        (float("inf"), "not finite"),
        (1e308, "above 1e+12"),
        (-1e13, "below -1e+12"),
        (True, "no number"),
        ("3", "no number"),
        (None, "no number"),
    ],
)
def test_what_an_input_cannot_take_is_refused_and_the_run_goes_on(path, loop, value, why):
    with load(path) as model:
        inputs = LiveInputs(model, ["a.u"])
        table = Table(model.channels)

        def progress(time):
            if time == pytest.approx(0.2):
                assert inputs.offer("a.u", 3.0)
                assert not inputs.offer("a.u", value)
                assert not inputs.offer("a.u", value)
            if time == pytest.approx(0.4):
                assert not inputs.offer("b.u", 1.0)

        result = simulate(
            model,
            stop_time=0.6,
            step_size=0.001,
            sinks=[table],
            runtime=Runtime(loop=loop),
            inputs=Inputs(live=inputs),
            observer=Observer(progress=progress),
        )
    assert result.time == 0.6
    assert table["a.u"][-1] == 3.0
    first, second = ((event.time, event.level, event.text) for event in table.events if event.level == "warning")
    told = f"refused, and left as it was: a.u cannot take {value!r}, which is {why}"
    assert first == (0.4, "warning", told)  # once, with the next rows
    assert second[2] == "refused, and left as it was: there is no input b.u to set, only a.u"


def test_refusals_are_told_with_variable_steps_too(fmus, tmp_path):
    edit_fmu(fmus / "CosimIntegrator.fmu", tmp_path / "a.fmu", dependencies={"x": []}, state=True)
    with load(write(tmp_path, system([component("a", "a.fmu", "u> x<")]))) as model:
        inputs = LiveInputs(model, ["a.u"])
        result = simulate(
            model,
            stop_time=0.5,
            step_size=0.01,
            algorithm=Algorithm(tolerance=1e-3),
            inputs=Inputs(live=inputs),
            observer=Observer(progress=lambda _: inputs.offer("a.u", True)),
        )
    told = "refused, and left as it was: a.u cannot take True, which is no number"
    assert told in [event.text for event in result.events]


def test_bounds_of_a_connector_are_in_its_unit_and_those_of_all_that_it_feeds(built, tmp_path):
    ssd = write(
        tmp_path,
        system(
            [component("p", str(built / "fmus" / "plant.fmu"), "push_force>")],
            [connection("push -> p.push_force", linear(factor=-10.0, offset=50.0))],
            ports="push>",
        ),
    )
    with load(ssd) as model:
        (column,) = [connector.column for connector in model.open_connectors]
        assert limits(model, column) == (-95.0, 105.0)  # -1000 = 50 - 10 * 105, 1000 = 50 + 10 * 95


def test_bounds_are_those_that_the_variable_declares(built):
    with load(built / "ssp" / "twip.ssp") as model:
        inputs = LiveInputs(model, ["controller.enable", "plant.slope", "controller.yaw_reference"])
        found = {name: limits(model, column) for name, column in zip(inputs.names, inputs._columns, strict=True)}
    assert found == {
        "controller.enable": (0.0, 1.0),
        "plant.slope": (-1.5, 1.5),
        "controller.yaw_reference": (-1e12, 1e12),  # none declared, and no nominal value
    }
