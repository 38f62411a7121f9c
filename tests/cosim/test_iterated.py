"""Iterated coupling: known fixed points, measured orders, stiff systems, and what is refused."""

import math

import numpy as np
import pytest
from echo_fmu import compiled, echo2, echo3
from flat_options import grouped
from ssp_writer import algorithm, bind, component, connection, edit_fmu, linear, system, write

from twip.cosim import Algorithm, Table, load, simulate
from twip.errors import TwipError

MID = ("a.u", "b.u")
TAIL = '<ssd:DefaultExperiment startTime="0" stopTime="1"/>'


@pytest.fixture
def parts(fmus, tmp_path):
    """FMUs that can save their state and say what depends on what."""
    depends = {
        "CosimIntegrator": {"x": []}, "CosimSum": {"y": ["u", "v"]}, "CosimStage": {"x": [], "i": ["u"]},
        "CosimGain": {"y": ["u"], "z": ["u"]},
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
        result = simulate(loaded, sinks=[table], **grouped(**{"coupling": "iterated", **options}))
    return table, result


def algebraic(folder, gain, more=(), wires=()):
    """A ramp t into p.y = gain * q.y + t and q.y = p.y: p.y = t / (1 - gain)."""
    ramp = component("ramp", "CosimIntegrator.fmu", "u> x<", reals(u=1.0))
    p = component("p", "CosimSum.fmu", "u> v> y<", reals(k=gain))
    q = component("q", "CosimGain.fmu", "u> y<", reals(k=1.0, u=0.0))
    connections = [connection("q.y -> p.u"), connection("ramp.x -> p.v"), connection("p.y -> q.u")]
    return write(folder, system([q, p, ramp, *more], [*connections, *wires]))


@pytest.mark.parametrize("gain", [0.5, -0.9, -2.0, 5.0])  # repeated substitution diverges for the last two
def test_an_algebraic_loop_is_solved_at_every_step(parts, gain):
    table, result = run(algebraic(parts, gain), step_size=0.1)
    # the residual of p.y is (1 - gain) times its error; the tolerance is 1e-8 of at least 1
    np.testing.assert_allclose(table["p.y"], table.times / (1.0 - gain), atol=1e-8 / abs(1.0 - gain) + 1e-15)
    assert not [w for w in result.warnings if "algebraic" in w]
    assert result.iterations <= 4 * result.steps  # one unknown of a linear problem: three, and one for the rounding


def test_isolated_fmus_go_back_too(parts):
    path = algebraic(parts, -2.0)
    (here, _), (isolated, _) = run(path, step_size=0.1), run(path, step_size=0.1, isolate=True)
    assert isolated.values.tobytes() == here.values.tobytes()


def test_the_tolerance_is_kept(parts):
    errors = []
    for tolerance in (1e-3, 1e-6, 1e-10):
        table, _ = run(algebraic(parts, 0.5), step_size=0.1, options={"iteration_tolerance": tolerance})
        errors.append(np.abs(table["p.y"] - 2.0 * table.times).max())
        assert errors[-1] <= 2.0 * tolerance * 2.0  # relative to the largest value, 2


def test_under_gauss_seidel_the_loop_is_named_with_what_to_do(parts):
    _, result = run(algebraic(parts, 0.5), step_size=0.1, coupling="gauss-seidel")
    assert result.warnings == (
        "algebraic loop: p.y → q.u → q.y → p.u; under gauss-seidel a value in it is a step old (iterated coupling"
        " solves it; an output that does not follow an input at once should say so by its dependencies)",
    )
    assert result.iterations == 0


def test_a_loop_without_solution_is_a_failure_that_names_its_signals_and_leaves_the_rows_before_it(parts):
    with load(algebraic(parts, 1.0)) as loaded:  # p.y = p.y + t: none but at t = 0
        table = Table(loaded.channels)
        with pytest.raises(TwipError) as failure:
            simulate(
                loaded,
                sinks=[table],
                algorithm=Algorithm(coupling="iterated", options={"maximum_iterations": 7}),
                step_size=0.25,
            )
    assert str(failure.value).startswith("the step from t = 0 s does not converge within 7 iterations to 1e-08: ")
    assert "q.y → p.u still changes by " in str(failure.value) or "p.y → q.u still changes by " in str(failure.value)
    assert table.times.tolist() == [0.0]


@pytest.mark.parametrize("added", [3.0, 0.1, 1e-7])
def test_a_loop_without_solution_does_not_run_away_to_where_its_residual_is_lost_in_rounding(parts, added):
    """y = y + 3: residuals differ by nothing but rounding, of which an acceleration would make a step of 1e16."""
    p = component("p", "CosimSum.fmu", "u> v> y<", reals(v=added))
    q = component("q", "CosimGain.fmu", "u> y<", reals(k=1.0, u=0.0))
    path = write(parts, system([p, q], [connection("q.y -> p.u"), connection("p.y -> q.u")]))
    with load(path) as loaded:
        table = Table(loaded.channels)
        with pytest.raises(TwipError, match=f"still changes by {added:g}"):
            simulate(loaded, sinks=[table], algorithm=Algorithm(coupling="iterated"), step_size=0.25)
        _, result = run(path, coupling="gauss-seidel", step_size=0.5)
    assert any("initial values do not settle" in w and "q.u" in w for w in result.warnings)
    assert np.abs(table.values).max() <= 1000 * added


def oscillator(folder, extra=()):
    """a' = b, b' = -a: with a(0) = 0, b(0) = 1 that is sine and cosine."""
    a = component("a", "CosimIntegrator.fmu", "u> x<")
    b = component("b", "CosimIntegrator.fmu", "u> x<", reals(x_start=1.0))
    wires = [connection("a.x -> b.u", linear(factor=-1)), connection("b.x -> a.u")]
    return write(folder, system([a, b, *extra], wires))


def test_every_step_is_the_implicit_one(parts):
    """Inputs at the end of a step: implicit Euler; in the middle between both ends: the implicit midpoint rule."""
    h, rows = 0.05, {(): [(0.0, 1.0)], ("a.u", "b.u"): [(0.0, 1.0)]}
    for mid_step, found in rows.items():
        share = 0.5 if mid_step else 1.0  # of the new values
        new = np.array([[1.0, -share * h], [share * h, 1.0]])
        old = np.array([[1.0, (1 - share) * h], [-(1 - share) * h, 1.0]])
        for _ in range(20):
            found.append(tuple(np.linalg.solve(new, old @ found[-1])))
        table, _ = run(oscillator(parts), step_size=h, mid_step=mid_step, options={"iteration_tolerance": 1e-13})
        # 20 steps with an error of the tolerance each, doubled for both variables
        np.testing.assert_allclose(np.column_stack([table["a.x"], table["b.x"]]), found, atol=40 * 1e-13)


@pytest.mark.parametrize(("mid_step", "order", "bound"), [((), 1.0, 1.0), (("a.u", "b.u"), 2.0, 0.2)])
def test_the_order_and_every_row_within_its_bound(parts, mid_step, order, bound):
    errors = []
    for h in (0.04, 0.02, 0.01):
        table, _ = run(oscillator(parts), step_size=h, mid_step=mid_step)
        wrong = np.abs(table["a.x"] - np.sin(table.times))
        assert (wrong <= bound * h**order).all()
        errors.append(wrong[-1])
    np.testing.assert_allclose(np.log2(np.array(errors[:-1]) / errors[1:]), order, atol=0.05)


def test_at_mid_step_the_energy_stays(parts):
    table, _ = run(oscillator(parts), step_size=0.1, stop_time=50.0, mid_step=["a.u", "b.u"])
    # 500 steps, each wrong by at most the tolerance
    np.testing.assert_allclose(table["a.x"] ** 2 + table["b.x"] ** 2, 1.0, atol=500 * 2e-8)


def test_a_stiff_system_needs_no_small_step(parts):
    """x' = -1000 x at h = 0.05: stepping forwards multiplies by -49 each time, implicitly by 1 / 51."""
    body = system(
        [component("a", "CosimIntegrator.fmu", "u> x<", reals(x_start=1.0))],
        [connection("a.x -> a.u", linear(factor=-1000))],
    )
    path = write(parts, body)
    table, _ = run(path, step_size=0.05)
    np.testing.assert_allclose(table["a.x"], 51.0 ** -np.arange(21.0), atol=1e-8)
    assert abs(run(path, step_size=0.05, coupling="gauss-seidel")[0]["a.x"][-1]) > 1e30


def test_only_cycles_are_repeated_and_only_their_fmus_must_save_their_state(parts):
    counter = component("n", "stateless.fmu", "u> x<")
    talker = component("s", "CosimSum.fmu", "u> v>", bind({"talks": ("Boolean", "true")}))
    path = algebraic(parts, 0.5, [counter, talker], [connection("p.y -> n.u"), connection("p.y -> s.u")])
    table, result = run(path, step_size=0.1)
    assert result.iterations > result.steps
    # the integrator got the solved value of the end of each step, once
    np.testing.assert_allclose(table["n.x"], np.cumsum(0.1 * table["p.y"]), atol=1e-15)
    assert len([e for e in table.events if e.source == "s"]) == 10


def test_what_is_said_in_a_step_that_is_taken_back_is_not_told(parts):
    talking = bind({"talks": ("Boolean", "true"), "k": ("Real", 0.5)})
    loop_ = component("p", "CosimSum.fmu", "u> v> y<", talking)
    path = write(parts, system([loop_], [connection("p.y -> p.u", linear(offset=1))]))
    table, result = run(path, step_size=0.1)
    assert result.iterations >= 10
    assert len([e for e in table.events if e.source == "p"]) == 10
    np.testing.assert_allclose(table["p.y"], 1.0, rtol=1e-8)


def test_fmus_that_cannot_save_their_state_are_named_before_the_run(parts):
    pair = [component(name, "stateless.fmu", "u> x<") for name in "ab"]
    path = write(parts, system(pair, [connection("a.x -> b.u"), connection("b.x -> a.u")]))
    with load(path) as loaded, pytest.raises(TwipError) as failure:
        simulate(loaded, algorithm=Algorithm(coupling="iterated"), step_size=0.1)
    assert str(failure.value).splitlines() == [
        f"{name}: FMU stateless.fmu cannot save its state (canGetAndSetFMUstate), which iterated coupling needs"
        for name in "ab"
    ]


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        ({"loop": "compiled"}, "loop 'compiled' cannot repeat steps, as iterated coupling does: take loop 'python'"),
        ({"own_steps": {"a": 0.2}}, "own step of a: iterated coupling repeats steps that are the same for all"),
        ({"order": ["a", "b"]}, "an order by hand has a meaning under gauss-seidel only, not under iterated"),
        ({"options": {"iteration_tolerance": 0.0}}, "iteration tolerance 0.0 must be a positive number"),
        ({"options": {"maximum_iterations": 0}}, "maximum of 0 iterations must be at least 1"),
        (
            {"coupling": "jacobi", "options": {"iteration_tolerance": 1e-6}},
            "iteration tolerance has a meaning under iterated only",
        ),
        (
            {"options": {"iteration_tolerence": 1e-6}},
            "there is no option iteration_tolerence of a coupling, did you mean iteration_tolerance?",
        ),
    ],
)
def test_what_does_not_go_together_is_refused(parts, options, problem):
    with load(oscillator(parts)) as loaded, pytest.raises(TwipError) as failure:
        simulate(loaded, **grouped(**{"coupling": "iterated", "step_size": 0.1, **options}))
    assert str(failure.value).startswith(problem)


def test_a_file_proposes_the_iteration(parts):
    path = oscillator(parts)
    said = algorithm('coupling="iterated" stepSize="0.1" iterationTolerance="1e-5" maximumIterations="3"')
    path.write_text(
        path.read_text().replace(TAIL, f'<ssd:DefaultExperiment stopTime="1">{said}</ssd:DefaultExperiment>')
    )
    given = {"step_size": 0.1, "options": {"iteration_tolerance": 1e-5, "maximum_iterations": 3}}
    np.testing.assert_array_equal(run(path, coupling=None)[0].values, run(oscillator(parts), **given)[0].values)


@pytest.mark.parametrize("mid_step", [(), ("a.u", "b.u")])
def test_a_checkpoint_continues_bit_for_bit(parts, mid_step):
    path, file = oscillator(parts), parts / "x.checkpoint"
    whole, _ = run(path, step_size=0.05, mid_step=mid_step)
    run(path, step_size=0.05, mid_step=mid_step, stop_time=0.4, checkpoint=file)
    rest, _ = run(path, step_size=0.05, mid_step=mid_step, resume=file)
    assert rest.values.tobytes() == whole.values[8:].tobytes()
    with pytest.raises(TwipError, match="iteration tolerance differs: 1e-06 here, 1e-08 in the checkpoint"):
        run(path, step_size=0.05, mid_step=mid_step, resume=file, options={"iteration_tolerance": 1e-6})


def test_a_chain_of_stages_follows_its_closed_form(parts):
    """Two RC stages on 1 V: voltages forwards, currents backwards."""
    stages = [component("s1", "CosimStage.fmu", "u> load> x< i<", reals(u=1.0))]
    stages.append(component("s2", "CosimStage.fmu", "u> load> x< i<", reals(capacity=0.5)))
    path = write(parts, system(stages, [connection("s1.x -> s2.u"), connection("s2.i -> s1.load")]))
    # x1' = 1 - 2 x1 + x2, x2' = 2 x1 - 2 x2: eigenvalues -2 ± √2
    errors = []
    for h in (0.05, 0.025, 0.0125):
        table, _ = run(path, step_size=h)
        slow, fast = -2.0 + math.sqrt(2.0), -2.0 - math.sqrt(2.0)
        # x2 = 1 + A e^(slow t) + B e^(fast t) with x2(0) = 0 and x2'(0) = 0
        big, small = fast / (slow - fast), -slow / (slow - fast)
        exact = 1.0 + big * np.exp(slow * table.times) + small * np.exp(fast * table.times)
        errors.append(np.abs(table["s2.x"] - exact).max())
        assert errors[-1] <= h
    # no more than 1: the current follows the voltage at once, so it would belong to an input's time, not to the end
    np.testing.assert_allclose(np.log2(np.array(errors[:-1]) / errors[1:]), 1.0, atol=0.1)


@pytest.mark.parametrize(
    "options", [{"coupling": "iterated", "step_size": 0.02}, {"tolerance": 1e-4, "step_size": 0.1}]
)
def test_fmus_of_both_versions_go_back(tmp_path, options):
    """a' = b + 1 in FMI 3, b' = -a in FMI 2, both from 0: a is the sine, b + 1 the cosine."""
    echo2(tmp_path, compiled("echo2", tmp_path))
    echo3(tmp_path, compiled("echo3", tmp_path))
    parts = [component("a", "echo3.fmu", "u> x<"), component("b", "echo2.fmu", "u> x<")]
    wires = [connection("a.x -> b.u", linear(factor=-1)), connection("b.x -> a.u", linear(offset=1))]
    table, result = run(write(tmp_path, system(parts, wires)), **{"coupling": None, "mid_step": MID, **options})
    # second order: h^2 / 12 of the third derivative for equal steps; the tolerance in each of the variable ones
    bound = 0.02**2 / 6 if result.variable is None else 1e-4 * result.steps
    assert np.abs(table["a.x"] - np.sin(table.times)).max() <= bound
    assert np.abs(table["b.x"] + 1 - np.cos(table.times)).max() <= bound
    assert result.iterations > result.steps or result.variable is not None
