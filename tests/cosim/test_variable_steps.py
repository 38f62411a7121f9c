"""Variable steps: errors that follow the tolerance, events hit exactly, what is taken back, and what is refused."""

import math
import zipfile

import numpy as np
import pytest
from flat_options import grouped
from ssp_writer import algorithm, bind, component, connection, edit_fmu, linear, system, write

from twip.cosim import Algorithm, Runtime, Table, load, simulate
from twip.errors import TwipError

TAIL = '<ssd:DefaultExperiment startTime="0" stopTime="1"/>'
MID = ["a.u", "b.u"]


@pytest.fixture
def parts(fmus, tmp_path):
    """FMUs that can save their state and say what depends on what."""
    depends = {
        "CosimIntegrator": {"x": []}, "CosimGain": {"y": ["u"], "z": ["u"]}, "CosimStage": {"x": [], "i": ["u"]},
        "CosimReluctant": {"x": []}, "CosimSum": {"y": ["u", "v"]}, "CosimFaulty": {"y": []},
    }  # fmt: skip
    for name, dependencies in depends.items():
        edit_fmu(fmus / f"{name}.fmu", tmp_path / f"{name}.fmu", dependencies=dependencies, state=True)
    edit_fmu(fmus / "CosimIntegrator.fmu", tmp_path / "stateless.fmu", dependencies={"x": []})
    return tmp_path


def reals(**values):
    return bind({name: ("Real", value) for name, value in values.items()})


def run(path, **options):
    with load(path) as loaded:
        table = Table(loaded.channels)
        result = simulate(loaded, sinks=[table], **grouped(**{"step_size": 0.01, **options}))
    return table, result


def oscillator(folder, b="CosimIntegrator.fmu"):
    """a' = b, b' = -a: with a(0) = 0, b(0) = 1 that is sine and cosine."""
    a = component("a", "CosimIntegrator.fmu", "u> x<")
    b = component("b", b, "u> x<", reals(x_start=1.0))
    return write(folder, system([a, b], [connection("a.x -> b.u", linear(factor=-1)), connection("b.x -> a.u")]))


@pytest.mark.parametrize(
    ("coupling", "mid_step", "order"),
    [("jacobi", (), 1), ("gauss-seidel", (), 1), ("iterated", (), 1), ("jacobi", MID, 2), ("iterated", MID, 2)],
)
def test_the_error_follows_the_tolerance_with_the_order(parts, coupling, mid_step, order):
    """Local errors T per step make a global error of about T / h with h ~ T^(1 / (order + 1))."""
    path, errors, counts = oscillator(parts), [], []
    tolerances = (4e-4, 4e-5, 4e-6)
    for tolerance in tolerances:
        table, result = run(path, coupling=coupling, mid_step=mid_step, tolerance=tolerance)
        wrong = np.abs(table["a.x"] - np.sin(table.times)) + np.abs(table["b.x"] - np.cos(table.times))
        assert (wrong <= 2.0 * tolerance * (len(table.times) - 1)).all()  # both variables, no step worse than allowed
        errors.append(wrong[-1])
        counts.append(result.steps)
        assert table.times[-1] == 1.0
        assert (np.diff(table.times) > 0).all()
        assert result.variable.smallest <= np.diff(table.times).min() * (1 + 1e-12)
    slopes = np.diff(np.log10(counts))
    # ten times the tolerance, 10^(1 / (order + 1)) times the steps; start and end of the run blur that by a few steps
    np.testing.assert_allclose(slopes, 1.0 / (order + 1), atol=0.1)
    assert errors[0] > errors[1] > errors[2]


def test_steps_follow_a_fast_part_and_then_a_slow_one(parts):
    """An RC stage on 1 V, and one behind it 100 times slower: steps grow once the fast one has settled."""
    fast = component("fast", "CosimStage.fmu", "u> load> x< i<", reals(capacity=0.01, u=1.0))
    slow = component("slow", "CosimStage.fmu", "u> load> x< i<")
    path = write(parts, system([fast, slow], [connection("fast.x -> slow.u"), connection("slow.i -> fast.load")]))
    table, result = run(path, coupling="iterated", tolerance=1e-5, step_size=1e-4)
    steps = np.diff(table.times)
    assert steps[:20].max() < 0.1 * steps.max()
    # x' = 100 (1 - 2 x + y), y' = x - y, both 1 in the end
    a = np.array([[-200.0, 100.0], [1.0, -1.0]])
    values, vectors = np.linalg.eig(a)
    modes = np.linalg.solve(vectors, [-1.0, -1.0])
    exact = 1.0 + (np.exp(np.outer(table.times, values)) * modes) @ vectors.T
    assert np.abs(np.column_stack([table["fast.x"], table["slow.x"]]) - exact).max() <= 2e-5 * result.steps
    assert result.steps < 0.05 / result.variable.smallest  # equal steps of the smallest size would be 20 times as many


def test_jumps_of_time_series_are_hit_exactly(parts):
    """x' = u with a u that jumps: without error only if no step goes across a jump."""
    path = write(parts, system([component("a", "CosimIntegrator.fmu", "u> x<")]))
    file = parts / "in.csv"
    file.write_text("time,a.u\n0,1\n0.3,1\n0.3,-2\n0.7123,-2\n0.7123,5\n1,5\n")
    table, result = run(path, tolerance=1e-3, step_size=0.25, input_file=file)
    assert {0.3, 0.7123, 1.0} <= set(table.times.tolist())
    assert table["a.x"][-1] == pytest.approx(0.3 - 2 * 0.4123 + 5 * 0.2877, abs=1e-14)  # roundings only
    assert table["a.u"][table.times == 0.3] == 1.0  # what the step that ended there used
    assert table["a.u"][table.times > 0.3][0] == -2.0
    assert result.steps <= 20


@pytest.mark.parametrize("tolerance", [1e-2, 1e-8])
def test_no_step_goes_across_a_pulse_that_is_linear_between_rows(parts, tolerance):
    """x' = u with a trapezoid of area 0.1: corners are events as jumps are; a straight line of many rows has none."""
    path = write(parts, system([component("a", "CosimIntegrator.fmu", "u> x<")]))
    rows = [(t, 0.1 * t) for t in range(5)] + [(5, 0.5), (5.05, 1.5), (5.1, 1.5), (5.15, 0.5), (10, 0.5), (20, 0.5)]
    (parts / "in.csv").write_text("time,a.u\n" + "".join(f"{t},{u}\n" for t, u in rows))
    table, result = run(path, tolerance=tolerance, step_size=0.1, input_file=parts / "in.csv", stop_time=20.0)
    assert {5.0, 5.05, 5.1, 5.15} <= set(table.times.tolist())
    assert table["a.x"][-1] == pytest.approx(1.25 + 7.5 + 0.1, abs=2 * tolerance * result.steps)
    assert 2.0 not in table.times
    assert 10.0 not in table.times


def test_a_parameter_may_change_twice_within_what_would_be_one_step(parts):
    gain = edit_fmu(parts / "CosimGain.fmu", parts / "g.fmu", variables={"k": {"variability": "tunable"}}, state=True)
    elements = [component("g", gain.name, "u> y<", reals(u=1.0)), component("a", "CosimIntegrator.fmu", "u> x<")]
    path = write(parts, system(elements, [connection("g.y -> a.u")]))
    change = '[[parameters]]\ntime = {}\nname = "g.k"\nvalue = {}\n'
    (parts / "s.toml").write_text(change.format(0.11, 1) + change.format(0.15, 5))
    given = {"coupling": "gauss-seidel", "tolerance": 1e-3, "step_size": 2.0, "scenario": parts / "s.toml"}
    table, _ = run(path, **given)  # the first step may be longer than the run
    assert table["a.x"][-1] == pytest.approx(2 * 0.11 + 1 * 0.04 + 5 * 0.85, abs=1e-14)  # roundings only
    (parts / "s.toml").write_text(change.format(0.11, 1) * 2)
    with pytest.raises(TwipError, match="follows another value at the same point"):
        run(path, **given)


def test_parameter_changes_are_hit_exactly_and_faults_refused(parts):
    """x' = k u: 1 before and 2 after the change."""
    gain = edit_fmu(parts / "CosimGain.fmu", parts / "g.fmu", variables={"k": {"variability": "tunable"}}, state=True)
    elements = [component("g", gain.name, "u> y<"), component("a", "CosimIntegrator.fmu", "u> x<")]
    path = write(parts, system(elements, [connection("g.y -> a.u")]))
    file = parts / "s.toml"
    file.write_text('[[parameters]]\ntime = 0.6172\nname = "g.k"\nvalue = 4\n')
    given = {"coupling": "gauss-seidel", "tolerance": 1e-3, "step_size": 0.3, "scenario": file}
    table, _ = run(path, **given)
    assert 0.6172 in table.times
    assert table["a.x"][-1] == pytest.approx(0.6172 + 2 * (1 - 0.6172), abs=1e-14)  # roundings only
    file.write_text('[[faults]]\nsignal = "g.y"\nkind = "stuck"\nstart = 0.5\n')
    with pytest.raises(TwipError, match="faults of the scenario need equal steps, but with a tolerance they vary"):
        run(path, **given)


@pytest.mark.parametrize(("jump", "change"), [(0.3, 0.1 * 3), (0.1 * 3, 0.3)])
def test_events_an_ulp_apart_are_one(parts, jump, change):
    """y = k u: both take effect in the step that begins at the later one, and no step has the length 0."""
    gain = edit_fmu(parts / "CosimGain.fmu", parts / "g.fmu", variables={"k": {"variability": "tunable"}}, state=True)
    elements = [component("g", gain.name, "u> y<"), component("a", "CosimIntegrator.fmu", "u> x<")]
    path = write(parts, system(elements, [connection("g.y -> a.u")]))
    (parts / "s.toml").write_text(
        f'[[parameters]]\ntime = {change!r}\nname = "g.k"\nvalue = 4\n'
        '[[parameters]]\ntime = 5e-324\nname = "g.k"\nvalue = 3\n'
        '[[parameters]]\ntime = 0.9999999999999999\nname = "g.k"\nvalue = 5\n'
    )
    (parts / "in.csv").write_text(f"time,g.u\n0,1\n{jump!r},1\n{jump!r},-2\n1,-2\n")
    given = {
        "coupling": "gauss-seidel",
        "tolerance": 1e-3,
        "step_size": 0.3,
        "scenario": parts / "s.toml",
        "input_file": parts / "in.csv",
    }
    table, result = run(path, **given)
    assert result.variable.smallest > 0.01
    assert max(jump, change) in table.times
    assert min(jump, change) not in table.times
    assert table["a.x"][-1] == pytest.approx(3 * 0.3 - 8 * 0.7, abs=1e-14)  # roundings only


def test_a_step_that_an_event_cuts_short_does_not_make_the_next_ones_short(parts):
    path = write(parts, system([component("a", "CosimIntegrator.fmu", "u> x<")]))
    (parts / "in.csv").write_text("time,a.u\n0,1\n0.501,1\n0.501,-2\n1,-2\n")
    table, _ = run(path, tolerance=1e-3, step_size=0.25, input_file=parts / "in.csv")
    assert np.diff(table.times)[table.times[1:] > 0.502].min() > 0.05


@pytest.mark.parametrize("isolate", [False, True])
def test_a_step_that_an_fmu_discards_is_done_in_smaller_ones(parts, isolate):
    path = write(parts, system([component("a", "CosimReluctant.fmu", "u> x<", reals(longest=0.03))]))
    table, result = run(path, tolerance=1e-3, step_size=0.5, isolate=isolate)
    assert np.diff(table.times).max() <= 0.03
    assert result.variable.taken_back > 0
    np.testing.assert_allclose(table["a.x"], table.times, atol=1e-14)
    assert not [e for e in table.events if e.level == "warning"]


def test_a_step_that_does_not_converge_is_done_in_smaller_ones(parts):
    path = oscillator(parts)
    given = {"coupling": "iterated", "options": {"maximum_iterations": 2, "iteration_tolerance": 1e-6}}
    with pytest.raises(TwipError, match="does not converge within 2 iterations"):
        run(path, step_size=0.25, **given)
    table, result = run(path, step_size=0.25, tolerance=1e-2, **given)
    assert result.variable.taken_back > 0
    assert abs(table["a.x"][-1] - math.sin(1.0)) < 1e-2


def test_limits_of_the_step_are_kept(parts):
    table, result = run(oscillator(parts), tolerance=1e-1, maximum_step=0.05)
    assert np.diff(table.times).max() <= 0.5 * 0.05 * (1 + 1e-12)  # two halves of a step
    assert result.variable.largest == pytest.approx(0.025)


def test_a_tolerance_that_cannot_be_kept_is_a_failure_with_the_rows_before_it(parts):
    with load(oscillator(parts)) as loaded:
        table = Table(loaded.channels)
        with pytest.raises(TwipError) as failure:
            simulate(loaded, sinks=[table], step_size=0.01, algorithm=Algorithm(tolerance=1e-9, minimum_step=0.005))
    assert str(failure.value).startswith(
        "the step from t = 0 s cannot keep the tolerance 1e-09: with the smallest step, 0.005 s, the error is "
    )
    assert table.times.tolist() == [0.0]


def test_an_fmu_that_fails_for_good_ends_the_run_with_the_rows_before_it(parts):
    bad = component("a", "CosimFaulty.fmu", "u> y<", bind({"fault": ("String", "raise"), "fault_time": ("Real", 0.5)}))
    clock = component("c", "CosimIntegrator.fmu", "u> x<", reals(u=1.0))
    with load(write(parts, system([bad, clock], [connection("c.x -> a.u")]))) as loaded:
        table = Table(loaded.channels)
        with pytest.raises(TwipError, match="a failed at t = "):
            simulate(loaded, sinks=[table], step_size=0.125, algorithm=Algorithm(tolerance=2.0, maximum_step=0.125))
    assert 0.3 < table.times[-1] <= 0.5


def test_the_same_run_twice_gives_the_same_bytes(parts):
    first, second = (run(oscillator(parts), tolerance=1e-4)[0] for _ in range(2))
    assert first.times.tobytes() == second.times.tobytes()
    assert first.values.tobytes() == second.values.tobytes()


def test_outputs_that_follow_inputs_at_once_do_not_count(parts):
    """The gain's output is a step old under Jacobi: an error of order one in it would ask for tiny steps."""
    path = oscillator(parts)
    plain = run(path, tolerance=1e-4)[1]
    text = path.read_text().replace("</ssd:Elements>", component("g", "CosimGain.fmu", "u> y<") + "</ssd:Elements>")
    path.write_text(text.replace("</ssd:Connections>", connection("a.x -> g.u") + "</ssd:Connections>"))
    assert run(path, tolerance=1e-4)[1].steps == plain.steps


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        ({"loop": "compiled"}, "loop 'compiled' cannot repeat steps, as variable steps do: take loop 'python'"),
        ({"checkpoint": "x"}, "checkpoint needs equal steps, but with a tolerance they vary"),
        ({"real_time": 1.0}, "real time needs equal steps, but with a tolerance they vary"),
        (
            {"own_steps": {"a": 0.2}},
            "own step of a: with a tolerance the steps vary",
        ),
        ({"tolerance": -1.0}, "tolerance -1.0 must be a positive number, or 0 for equal steps"),
        ({"minimum_step": 0.02}, "minimum step 0.02 s is above the first step 0.01 s"),
        ({"maximum_step": 0.002}, "maximum step 0.002 s is below the first step 0.01 s"),
        (
            {"tolerance": 0.0, "minimum_step": 0.1},
            "minimum step has a meaning with a tolerance only",
        ),
    ],
)
def test_what_does_not_go_together_is_refused(parts, options, problem):
    with load(oscillator(parts)) as loaded, pytest.raises(TwipError) as failure:
        simulate(loaded, **grouped(**{"tolerance": 1e-3, "step_size": 0.01, **options}))
    assert str(failure.value).startswith(problem)


def test_fmus_that_cannot_save_their_state_are_named_before_the_run(parts):
    with load(oscillator(parts, b="stateless.fmu")) as loaded, pytest.raises(TwipError) as failure:
        simulate(loaded, algorithm=Algorithm(tolerance=1e-3), step_size=0.01)
    assert str(failure.value) == (
        "b: FMU stateless.fmu cannot save its state (canGetAndSetFMUstate), which variable steps need"
    )


def test_fmus_whose_steps_must_be_equal_are_named_before_the_run(parts):
    """FMI 2.0.4 section 4.3.1: false unless the FMU says that it can."""
    with zipfile.ZipFile(parts / "CosimIntegrator.fmu") as archive:
        contents = {name: archive.read(name) for name in archive.namelist()}
    attribute, text = b'canHandleVariableCommunicationStepSize="true"', contents["modelDescription.xml"]
    assert attribute in text
    for said in (b'canHandleVariableCommunicationStepSize="false"', b""):
        contents["modelDescription.xml"] = text.replace(attribute, said)
        with zipfile.ZipFile(parts / "equal.fmu", "w") as archive:
            for name, content in contents.items():
                archive.writestr(name, content)
        with load(oscillator(parts, b="equal.fmu")) as loaded:
            with pytest.raises(TwipError) as failure:
                simulate(loaded, algorithm=Algorithm(tolerance=1e-3), step_size=0.01)
            assert simulate(loaded, step_size=0.5, runtime=Runtime(loop="python")).steps == 2
        assert str(failure.value) == (
            "b: FMU equal.fmu does not take steps of different sizes (canHandleVariableCommunicationStepSize),"
            " which variable steps need"
        )


def test_a_file_proposes_the_tolerance_and_the_caller_wins(parts):
    path = oscillator(parts)
    said = algorithm('stepSize="0.03" tolerance="1e-3" maximumStep="0.05"')
    proposal = f'<ssd:DefaultExperiment stopTime="1">{said}</ssd:DefaultExperiment>'
    path.write_text(path.read_text().replace(TAIL, proposal))
    proposed = run(path, step_size=None)[0]
    given = run(oscillator(parts), step_size=0.03, tolerance=1e-3, maximum_step=0.05)[0]
    np.testing.assert_array_equal(proposed.values, given.values)
    path.write_text(path.read_text().replace(TAIL, proposal))
    equal = run(path, step_size=0.1, tolerance=0.0, loop="python")
    assert equal[1].variable is None
    assert equal[1].steps == 10
