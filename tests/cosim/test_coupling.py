"""Known answers: what the two couplings do to small systems whose recurrences can be written down."""

import math

import numpy as np
import pytest
from flat_options import grouped
from ssp_writer import bind, component, connection, edit_fmu, linear, system, write

from twip.cosim import Table, load, simulate

COSINE = ("a.x -> minus.u", "minus.z -> b.u", "b.x -> a.u")
"""a' = b, b' = -a: with a(0) = 0, b(0) = 1 that is sine and cosine."""


@pytest.fixture
def oscillator(fmus, tmp_path):
    integrator = edit_fmu(fmus / "CosimIntegrator.fmu", tmp_path / "integrator.fmu", dependencies={"x": []})
    gain = edit_fmu(fmus / "CosimGain.fmu", tmp_path / "gain.fmu", dependencies={"y": ["u"], "z": ["u"]})
    parts = {
        "a": component("a", integrator.name, "u> x<"),
        "b": component("b", integrator.name, "u> x<"),
        "minus": component("minus", gain.name, "u> z<"),
    }

    def build(order=("a", "b", "minus")):
        return write(tmp_path, system([parts[name] for name in order], [connection(c) for c in COSINE]))

    return build


def run(path, **options):
    with load(path, start_values=options.pop("start_values", {"b.x_start": 1.0})) as loaded:
        table = Table(loaded.channels)
        result = simulate(loaded, sinks=[table], **grouped(**options))
    return table, result


def recurrence(coupling, steps, h):
    a, b, z = 0.0, 1.0, -0.0
    rows = [(a, b)]
    for _ in range(steps):
        if coupling == "jacobi":  # all take the values of the step's begin; the gain's output lags by a step
            a, b, z = a + h * b, b + h * z, -a
        else:  # ranks: a and b have sources at depth 0 and 1; minus follows a, b follows minus
            a = a + h * b
            z = -a
            b = b + h * z
        rows.append((a, b))
    return np.array(rows)


@pytest.mark.parametrize("coupling", ["jacobi", "gauss-seidel"])
def test_every_step_follows_the_recurrence_exactly(oscillator, coupling, loop):
    table, result = run(oscillator(), step_size=0.01, coupling=coupling, loop=loop)
    expected = recurrence(coupling, 100, 0.01)
    np.testing.assert_array_equal(np.column_stack([table["a.x"], table["b.x"]]), expected)
    assert result.steps == 100
    assert result.values["a.x"] == expected[-1, 0]


@pytest.mark.parametrize("coupling", ["jacobi", "gauss-seidel"])
def test_the_error_against_sine_halves_with_the_step(oscillator, coupling):
    errors = []
    for step in (0.02, 0.01, 0.005):
        table, _ = run(oscillator(), step_size=step, coupling=coupling)
        errors.append(abs(table["a.x"][-1] - math.sin(1.0)) + abs(table["b.x"][-1] - math.cos(1.0)))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    # first order; terms of second order move the observed order by less than 0.1 at these steps
    np.testing.assert_allclose(orders, 1.0, atol=0.1)


@pytest.mark.parametrize("coupling", ["jacobi", "gauss-seidel"])
def test_the_order_of_components_in_the_file_changes_no_bit(oscillator, coupling, loop):
    reference, _ = run(oscillator(), step_size=0.01, coupling=coupling, loop=loop)
    for order in (("minus", "b", "a"), ("b", "minus", "a")):
        table, _ = run(oscillator(order), step_size=0.01, coupling=coupling, loop=loop)
        assert table.columns != reference.columns
        for name in reference.columns:
            assert table[name].tobytes() == reference[name].tobytes()


def test_row_0_is_consistent_and_the_last_row_is_exactly_at_the_stop_time(oscillator, loop):
    table, result = run(
        oscillator(), step_size=0.1, stop_time=0.7, start_values={"a.x_start": 0.25, "b.x_start": 1.0}, loop=loop
    )
    assert table.times.tolist() == [*(k * 0.1 for k in range(7)), 0.7]
    assert result.time == 0.7
    assert table["minus.u"][0] == 0.25
    assert table["minus.z"][0] == -0.25
    assert table["b.u"][0] == -0.25
    # each row holds the inputs used in the step that ended there
    assert table["a.x"][1] == 0.25 + 0.1 * table["a.u"][1]
    assert table["a.u"][1] == table["b.x"][0]


def test_a_start_time_shifts_the_stamps_only(oscillator, loop):
    shifted, _ = run(oscillator(), step_size=0.125, start_time=5.0, stop_time=6.0, loop=loop)
    plain, _ = run(oscillator(), step_size=0.125, loop=loop)
    assert shifted.times.tolist() == (5.0 + plain.times).tolist()
    np.testing.assert_array_equal(shifted.values, plain.values)


def test_an_algebraic_loop_is_named_and_solved_at_the_start(fmus, tmp_path, loop):
    gain = edit_fmu(fmus / "CosimGain.fmu", tmp_path / "gain.fmu", dependencies={"y": ["u"], "z": ["u"]})
    body = system(
        [component("p", gain.name, "u> y<"), component("q", gain.name, "u> y<")],
        [connection("p.y -> q.u"), connection("q.y -> p.u", linear(factor=0.125, offset=1))],
    )
    table, result = run(write(tmp_path, body), step_size=0.5, start_values={}, loop=loop)
    # p.u = 0.125 * 2 * 2 * p.u + 1, hence p.u = 2
    np.testing.assert_allclose(table["p.u"], 2.0, rtol=1e-11)  # the iteration stops at 1e-12 relative change
    assert any("algebraic loop: p.y → q.u → q.y → p.u" in w for w in result.warnings)


def test_a_loop_in_which_handing_values_around_diverges_is_solved_at_the_start_too(fmus, tmp_path):
    gain = edit_fmu(fmus / "CosimGain.fmu", tmp_path / "gain.fmu", dependencies={"y": ["u"], "z": ["u"]})
    body = system(
        [component("p", gain.name, "u> y<"), component("q", gain.name, "u> y<")],
        [connection("p.y -> q.u"), connection("q.y -> p.u", linear(factor=-0.75, offset=1))],
    )
    table, result = run(write(tmp_path, body), step_size=0.5, start_values={})
    # p.u = -0.75 * 2 * 2 * p.u + 1, hence p.u = 0.25; each pass around multiplies the error by -3
    np.testing.assert_allclose(table["p.u"][0], 0.25, rtol=1e-11)
    assert not [w for w in result.warnings if "settle" in w]


def test_a_loop_that_does_not_settle_is_a_warning_with_its_signals(fmus, tmp_path):
    gain = edit_fmu(fmus / "CosimGain.fmu", tmp_path / "gain.fmu", dependencies={"y": ["u"], "z": ["u"]})
    guess = bind({"u": ("Real", 0.0)})
    body = system([component("p", gain.name, "u> z<", guess)], [connection("p.z -> p.u", linear(factor=-1, offset=1))])
    _, result = run(write(tmp_path, body), step_size=0.5, start_values={})  # p.u = p.u + 1
    assert any(w.startswith("initial values do not settle within 100 passes: p.u, ") for w in result.warnings)


def test_without_declared_dependencies_an_output_depends_on_every_input(folder):
    fmu = "CosimIntegrator.fmu"
    body = system(
        [component("a", fmu, "u> x<"), component("b", fmu, "u> x<")],
        [connection("a.x -> b.u"), connection("b.x -> a.u")],
    )
    _, result = run(write(folder, body), step_size=0.5)
    assert any("algebraic loop: a.x → b.u → b.x → a.u" in w for w in result.warnings)
