"""Inputs that are set while a system runs."""

import numpy as np
import pytest
from ssp_writer import component, system, write

from twip.cosim import Table, load, simulate
from twip.cosim.live_inputs import LiveInputs, open_inputs
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

        simulate(model, stop_time=0.6, step_size=0.001, sinks=[table], loop=loop, live=inputs, progress=progress)
    u = table["a.u"]  # a row holds the input of the step that ended there
    np.testing.assert_array_equal(u[:201], np.full(201, u[0]))
    np.testing.assert_array_equal(u[201:], np.full(400, 3.0))


def test_start_values_stay_until_somebody_sets_an_input(path):
    with load(path, start_values={"a.u": 2.5}) as model:
        assert open_inputs(model) == ["a.u"]
        inputs = LiveInputs(model, ["a.u"])
        assert inputs["a.u"] == 2.5
        table = Table(model.channels)
        simulate(model, stop_time=0.01, step_size=0.001, sinks=[table], live=inputs)
        plain = Table(model.channels)
        simulate(model, stop_time=0.01, step_size=0.001, sinks=[plain])
    np.testing.assert_array_equal(table.values, plain.values)


def test_what_a_file_drives_is_left_to_it(path):
    file = path.parent / "u.csv"
    file.write_text("time,a.u\n0,7\n")
    with load(path) as model:
        inputs = LiveInputs(model, ["a.u"])
        table = Table(model.channels)
        simulate(model, stop_time=0.01, step_size=0.001, input_file=file, sinks=[table], live=inputs)
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
            simulate(model, stop_time=0.01, step_size=0.001, sinks=[], live=inputs, checkpoint=path.parent / "kept")


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
        with pytest.raises(TwipError, match="must be a list of inputs"):
            LiveInputs(model, "m.n")
