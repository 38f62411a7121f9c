"""Mistakes are logged and fail the next step; the host survives, and so does the instance."""

import pytest
from fmi_host import DISCARD, ERROR, OK, WARNING, Instance


def errors(instance):
    return [text for status, category, text in instance.log if status == ERROR and category == "logStatusError"]


def refused(instance):
    """Try a step that must fail, and return the errors logged until then."""
    assert instance.step(0.0, instance.fmu.step_size) == DISCARD
    assert [c for s, c, _ in instance.log if s == DISCARD] == ["logStatusDiscard"]
    return errors(instance)


def test_an_exception_in_a_step_is_logged_with_traceback(instance):
    one = instance("raising").begin()
    assert one.step(0.0, 1e-3) == OK
    one.set(divisor=0.0)
    assert one.step(1e-3, 1e-3) == DISCARD
    (text,) = errors(one)
    assert "ZeroDivisionError" in text
    assert "v.result = v.dividend / v.divisor" in text
    assert "0.001 s" in text


def test_an_exception_leaves_the_instance_usable(instance):
    one = instance("raising").begin()
    one.set(divisor=0.0)
    assert one.step(0.0, 1e-3) == DISCARD
    one.set(divisor=4.0)
    assert one.step(0.0, 1e-3) == DISCARD  # the failed step may have left its work half done
    assert one.get("divisor") == 4.0
    one.check("Reset")
    assert one.begin(dividend=1.0, divisor=4.0).step(0.0, 1e-3) == OK
    assert one.get("result") == 0.25


def test_a_step_that_yields_no_number_fails(instance):
    one = instance("raising").begin()
    one.set(overflow=True)
    assert one.step(0.0, 1e-3) == DISCARD
    assert errors(one) == ["result = nan after the step from 0 s by 0.001 s must be finite"]


def test_an_exception_in_initialization_fails_the_first_step(instance):
    (text,) = refused(instance("raising").begin(divisor=0.0))
    assert text.startswith("initialization failed\nTraceback")
    assert "ZeroDivisionError" in text


def test_a_passing_mistake_during_initialization_is_forgiven(instance):
    one = instance("raising")
    one.enter()
    one.set(divisor=0.0)
    one.get("result")
    one.set(divisor=8.0)
    assert one.get("result") == 0.125
    one.check("ExitInitializationMode")
    assert one.step(0.0, 1e-3) == OK
    assert one.log == []


@pytest.mark.parametrize("value", [float("nan"), float("inf"), float("-inf")])
@pytest.mark.parametrize("late", [False, True])
def test_an_input_must_be_finite(instance, value, late):
    one = instance("walker")
    if late:
        one.begin()
    else:
        one.enter()
    one.set(pull=value)
    assert one.get("pull") == 0.25
    if not late:
        one.check("ExitInitializationMode")
    assert refused(one) == [f"pull = {value:g} m must be finite"]


def test_every_input_of_every_block_must_be_finite(instance, name):
    for variable in instance(name).fmu.of("input"):
        one = instance(name).begin()
        one.set(**{variable.replace(".", "__"): float("nan")})
        assert any(e.startswith(f"{variable} = nan") and e.endswith("must be finite") for e in refused(one))


@pytest.mark.parametrize(
    ("block", "parameter", "value", "text"),
    [
        ("walker", "gain", -0.5, "gain = -0.5 1/s must be at least 0 1/s"),
        ("walker", "gain", 11.0, "gain = 11 1/s must be at most 10 1/s"),
        ("typed", "count", -6, "count = -6 must be at least -5"),
    ],
)
def test_a_parameter_out_of_bounds_is_refused_in_the_call_that_sets_it(instance, block, parameter, value, text):
    one = instance(block)
    before = one.get(parameter)
    one.enter()
    one.set(**{parameter: value})
    assert errors(one) == [text]
    assert one.get(parameter) == before
    one.check("ExitInitializationMode")
    assert refused(one) == [text]


def test_a_tunable_parameter_out_of_bounds_is_refused_during_the_run(instance):
    one = instance("walker").begin(gain=3.0)
    assert one.step(0.0, 0.01) == OK
    one.set(gain=11.0)
    assert errors(one) == ["gain = 11 1/s must be at most 10 1/s"]
    assert one.get("gain") == 3.0
    assert one.step(0.01, 0.01) == DISCARD


def test_a_parameter_out_of_bounds_fails_the_first_step(instance):
    one = instance("walker").begin(gain=-0.5)
    assert refused(one) == ["gain = -0.5 1/s must be at least 0 1/s"]
    assert refused(instance("walker").begin(gain=11.0)) == ["gain = 11 1/s must be at most 10 1/s"]
    assert refused(instance("typed").begin(count=-6)) == ["count = -6 must be at least -5"]


def test_bounds_of_every_parameter_are_kept(instance, declared, name):
    for p in (p for p in declared(name).variables if p.causality == "parameter" and p.minimum is not None):
        one = instance(name).begin(**{p.name.replace(".", "__"): int(p.minimum) - 1})
        assert any(e.startswith(f"{p.name} = ") and "must be at least" in e for e in refused(one))


def test_rules_between_parameters_are_checked(instance):
    assert refused(instance("raising").begin(lower=3.0)) == ["lower = 3 must be below upper = 2"]


def test_a_fixed_parameter_stays_after_initialization(instance):
    one = instance("walker").begin()
    one.set(position_start=1.0)
    assert one.get("position_start") == 0.0
    assert refused(one) == ["position_start is a fixed parameter: it cannot be set after initialization"]


def test_a_tunable_parameter_acts_from_the_next_step(instance):
    one, still = instance("walker").begin(pull=0.5), instance("walker").begin(pull=0.5)
    assert one.step(0.0, 0.01) == still.step(0.0, 0.01) == OK
    one.set(gain=3.0)
    assert one.get("position") == still.get("position")
    assert one.step(0.01, 0.01) == still.step(0.01, 0.01) == OK
    # two more 1/s of gain pull for 10 ms over 0.5 m; the sum is rounded in another order
    assert one.get("position") - still.get("position") == pytest.approx(2.0 * 0.01 * 0.5, rel=1e-12)


def test_a_tunable_parameter_is_checked_when_it_changes(instance):
    one = instance("raising").begin()
    one.set(lower=2.5)
    assert refused(one) == ["lower = 2.5 must be below upper = 2"]


@pytest.mark.parametrize(("variable", "causality"), [("position", "output"), ("steps", "local")])
def test_what_the_block_computes_cannot_be_set(instance, variable, causality):
    assert refused(instance("walker").begin(**{variable: 1.0})) == [
        f"{variable} cannot be set: its causality is {causality}"
    ]


def test_an_unknown_reference_and_a_wrong_type_are_told(instance):
    one = instance("typed").begin()
    one.fmu.references["nobody"], one.fmu.types["nobody"] = 2**31 + 5, "Real"
    one.get("nobody")
    del one.fmu.references["nobody"], one.fmu.types["nobody"]
    one.fmu.types["factor"] = "Integer"
    one.get("factor")
    one.set(factor=1)
    one.fmu.types["factor"] = "Real"
    texts = refused(one)
    assert len(texts) == 3
    assert "is no Real variable of block typed" in texts[0]
    assert texts[1] == texts[2] == "value reference 2 is no Integer variable of block typed"


@pytest.mark.parametrize("size", [0.0, -0.01, float("nan"), float("inf")])
def test_a_step_has_a_positive_finite_length(instance, size):
    one = instance("walker").begin()
    assert one.step(0.0, size) == DISCARD
    assert "needs a finite begin and a positive length" in errors(one)[0]


def test_no_step_before_or_after_the_run(instance):
    early, late = instance("walker"), instance("walker").begin()
    early.enter()
    late.check("Terminate")
    late.set(pull=1.0)
    for one in (early, late):
        assert "a step is possible only between initialization and termination" in refused(one)
    assert "pull cannot be set after termination" in errors(late)


def test_outputs_follow_parameters_and_inputs_in_initialization_mode(instance):
    one = instance("walker")
    one.enter(start=2.5)
    assert one.get("position", "pulled", "begun") == [0.0, 0.25, 2.5]
    one.set(position_start=1.0)
    assert one.get("position", "pulled") == [1.0, 1.25]
    one.set(pull=2.0)
    assert one.get("pulled") == 3.0
    one.check("ExitInitializationMode")
    assert one.get("position", "pulled", "begun") == [1.0, 3.0, 2.5]


def test_types(instance):
    one = instance("typed").begin(count=7, flag=False, factor=0.25)
    assert one.get("product", "next_count", "opposite") == [1.75, 8, 1]
    assert one.get("count", "flag", "factor") == [7, 0, 0.25]


def test_a_sample_time_between_steps_is_warned_of_once(instance):
    one = instance("walker").begin(sample_time=0.025)
    for k in range(5):
        assert one.step(k * 0.01, 0.01) == OK
    ((status, category, text),) = one.log
    assert (status, category) == (WARNING, "logStatusWarning")
    assert text.startswith("sample_time = 0.025 s is not a multiple of the step 0.01 s")


def test_a_sample_time_of_many_steps_is_silent(instance):
    one = instance("walker").begin(sample_time=0.07)  # 7.000000000000001 steps
    assert one.step(0.0, 0.01) == OK
    assert one.log == []


def test_nothing_is_logged_when_all_is_well(instance, name):
    one = instance(name).begin()
    one.run(0, 20)
    assert one.log == []


def test_errors_are_kept_in_bounds(instance):
    one = instance("walker").begin()
    for _ in range(1000):
        one.set(pull=float("nan"))
    state = one.save()
    assert len(one.serialize(state)) < 5000
    one.release(state)


def test_without_logging_a_failure_is_still_a_failure(loaded):
    one = Instance(loaded("raising"), logging=False).begin(divisor=0.0)
    assert one.step(0.0, 1e-3) == DISCARD
    assert one.log == []
    one.free()


def test_a_step_may_be_tiny(instance, name):
    """Some masters end a run with what rounding left of the last step."""
    one = instance(name).begin()
    one.run(0, 5)
    time = 5 * one.fmu.step_size
    assert one.step(time, 1e-13) == OK, one.log
    assert one.step(time + 1e-13, one.fmu.step_size) == OK, one.log


def test_steps_may_differ_in_length(instance, name):
    one, time = instance(name).begin(), 0.0
    for share in (1.0, 0.3, 2.0, 0.7, 1.0):
        assert one.step(time, share * one.fmu.step_size) == OK, one.log
        time += share * one.fmu.step_size
