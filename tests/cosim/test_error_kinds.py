"""What a caller catches: kinds of errors with attributes, and problems with a place and a rule."""

import pickle

import pytest
from c_fmu import chain, demand
from mcap.writer import Writer
from ssp_writer import component, line_of, proposing, system, write

from twip.cosim import (
    AbsentFileError,
    Algorithm,
    ComponentError,
    ForeignLogError,
    LiveInputs,
    Place,
    Problem,
    Runtime,
    TwipError,
    UnknownNameError,
    load,
    read_log,
    simulate,
)


@pytest.mark.parametrize("isolate", [False, True])
@pytest.mark.parametrize(("what", "repeatable"), [("discard", True), ("error", False)])
def test_a_failed_step_names_component_time_and_call(faulty_folder, isolate, what, repeatable):
    said = r"^bad failed at t = 0\.5 s: fmi2DoStep returned"
    loaded = load(chain(faulty_folder), start_values=demand("step", what, 0.5))
    with loaded, pytest.raises(ComponentError, match=said) as error:
        simulate(loaded, step_size=0.1, algorithm=Algorithm(coupling="gauss-seidel"), runtime=Runtime(isolate=isolate))
    failure = error.value
    assert (failure.component, failure.call, failure.repeatable) == ("bad", "fmi2DoStep", repeatable)
    assert failure.time == pytest.approx(0.5)
    assert len(failure.problems) == 1
    again = pickle.loads(pickle.dumps(failure))
    assert (str(again), again.component, again.time) == (str(failure), "bad", failure.time)


def test_a_crash_names_what_was_being_done(faulty_folder):
    loaded = load(chain(faulty_folder), start_values=demand("step", "crash", 0.5))
    with loaded, pytest.raises(ComponentError) as error:
        simulate(loaded, step_size=0.1, algorithm=Algorithm(coupling="gauss-seidel"), runtime=Runtime(isolate=True))
    assert (error.value.component, error.value.call, error.value.repeatable) == ("bad", "doStep", False)
    assert error.value.time == pytest.approx(0.5)


def test_a_file_that_is_not_there_has_a_kind_of_its_own(tmp_path):
    for read, name in ((load, "none.ssp"), (read_log, "none.mcap")):
        with pytest.raises(AbsentFileError, match="none") as error:
            read(tmp_path / name)
        assert error.value.path == tmp_path / name


def test_with_more_problems_than_an_absent_system_all_are_told(tmp_path):
    with pytest.raises(TwipError) as error:
        load(tmp_path / "none.ssp", parameters=[tmp_path / "none.ssv"])
    assert len(error.value.problems) == 2
    assert type(error.value) is TwipError


def test_a_name_that_is_not_there_comes_with_near_ones(folder):
    with load(write(folder, system([component("a", "CosimGain.fmu", "u> y<")]))) as loaded:
        result = simulate(loaded, step_size=0.1)
        for ask in (lambda: result["a.yy"], lambda: LiveInputs(loaded, []).__setitem__("a.yy", 1.0)):
            with pytest.raises(UnknownNameError) as error:
                ask()
            assert error.value.name == "a.yy"
        with pytest.raises(UnknownNameError) as error:
            result["a.yy"]
        assert error.value.near[0] == "a.y"


def test_a_log_of_another_program_says_which(tmp_path):
    path = tmp_path / "other.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start(library="another 1.0")
        writer.register_channel("/x", "json", 0)
        writer.finish()
    with pytest.raises(ForeignLogError) as error:
        read_log(path)
    assert error.value.path == path
    assert "another 1.0" in error.value.library


def test_a_problem_has_its_place_and_the_rule_that_was_broken(folder):
    attributes = 'coupling="iterated" maximumIterations="1.5"'
    path = write(folder, system([component("a", "CosimGain.fmu", "u> y<")]), tail=proposing(attributes))
    with pytest.raises(TwipError) as error:
        load(path)
    place = Place("SystemStructure.ssd", line_of(path, attributes))
    assert error.value.problems == (Problem("maximumIterations = 1.5", place, "must be a whole number"),)
    assert str(error.value) == f"maximumIterations = 1.5 must be a whole number ({place})"
