"""Inputs taken at the middle of a step: the recurrences they make, their order, and what is refused."""

import math

import numpy as np
import pytest
from flat_options import grouped
from ssp_writer import algorithm, component, connection, edit_fmu, linear, system, write

from twip.cosim import Algorithm, Table, check, load, simulate
from twip.errors import TwipError

RING = ("a.x -> minus.u", "minus.z -> b.u", "b.x -> a.u")
"""a' = b, b' = -a: with a(0) = 0, b(0) = 1 that is sine and cosine."""


@pytest.fixture
def integrator(fmus, tmp_path):
    edit_fmu(fmus / "CosimGain.fmu", tmp_path / "gain.fmu", dependencies={"y": ["u"], "z": ["u"]})
    return edit_fmu(fmus / "CosimIntegrator.fmu", tmp_path / "integrator.fmu", dependencies={"x": []}).name


@pytest.fixture
def ring(integrator, tmp_path):
    parts = [component(name, integrator, "u> x<") for name in "ab"] + [component("minus", "gain.fmu", "u> z<")]
    return write(tmp_path, system(parts, [connection(c) for c in RING]))


@pytest.fixture
def pair(integrator, tmp_path):
    """The same oscillator with the sign in a connection."""
    parts = [component(name, integrator, "u> x<") for name in "ab"]
    return write(tmp_path, system(parts, [connection("a.x -> b.u", linear(factor=-1)), connection("b.x -> a.u")]))


def run(path, **options):
    with load(path, start_values={"b.x_start": 1.0}) as loaded:
        table = Table(loaded.channels)
        simulate(loaded, sinks=[table], **grouped(**options))
    return table


@pytest.mark.parametrize("mid_step", [["a.u"], ["b.u"], ["a.u", "b.u"]])
def test_a_source_that_has_not_run_is_taken_half_a_step_ahead_one_that_has_half_a_step_behind(ring, loop, mid_step):
    h, share_a, share_b = 0.01, 0.5 * ("a.u" in mid_step), 0.5 * ("b.u" in mid_step)
    a, b = 0.0, 1.0
    b_before, z_before = b, -a  # in the first step, what the copies brought at the start
    rows = [(a, b)]
    for _ in range(100):
        u, b_before = b + share_a * (b - b_before), b  # b runs after a
        a = a + h * u
        z = -a
        u, z_before = z - share_b * (z - z_before), z  # minus has run
        b = b + h * u
        rows.append((a, b))
    table = run(ring, step_size=h, coupling="gauss-seidel", mid_step=mid_step, loop=loop)
    np.testing.assert_array_equal(np.column_stack([table["a.x"], table["b.x"]]), rows)


def test_under_jacobi_every_source_is_taken_half_a_step_ahead(pair, loop):
    h, a, b = 0.01, 0.0, 1.0
    before = (a, b)
    rows = [before]
    for _ in range(100):  # two steps of Adams and Bashforth
        ua, ub = b + 0.5 * (b - before[1]), -a + 0.5 * (-a + before[0])
        before = (a, b)
        a, b = a + h * ua, b + h * ub
        rows.append((a, b))
    table = run(pair, step_size=h, coupling="jacobi", mid_step=["a.u", "b.u"], loop=loop)
    np.testing.assert_array_equal(np.column_stack([table["a.x"], table["b.x"]]), rows)
    assert table["a.u"][2] == 1.5 * table["b.x"][1] - 0.5 * table["b.x"][0]  # the row holds what the step used


@pytest.mark.parametrize(
    ("system_", "coupling", "mid_step", "order"),
    [
        ("pair", "jacobi", [], 1.0),
        ("pair", "jacobi", ["a.u"], 1.0),
        ("pair", "jacobi", ["a.u", "b.u"], 2.0),
        ("ring", "gauss-seidel", ["a.u", "b.u"], 2.0),
    ],
)
def test_the_error_falls_with_the_order_of_the_extrapolation(request, system_, coupling, mid_step, order):
    path = request.getfixturevalue(system_)
    errors = []
    for step in (0.02, 0.01, 0.005):
        table = run(path, step_size=step, coupling=coupling, mid_step=mid_step)
        errors.append(abs(table["a.x"][-1] - math.sin(1.0)) + abs(table["b.x"][-1] - math.cos(1.0)))
    # terms of the next order move the observed order by less than 0.1 at these steps
    np.testing.assert_allclose(np.log2(np.array(errors[:-1]) / errors[1:]), order, atol=0.1)


def proposing(path, mid_step):
    """Let the file propose Gauss-Seidel with mid-step inputs."""
    text = path.read_text(encoding="utf-8")
    plain = '<ssd:DefaultExperiment startTime="0" stopTime="1"/>'
    assert plain in text
    proposal = algorithm('coupling="gauss-seidel"', mid_step)
    path.write_text(
        text.replace(plain, f'<ssd:DefaultExperiment stopTime="1">{proposal}</ssd:DefaultExperiment>'), encoding="utf-8"
    )
    return path


def test_a_file_proposes_mid_step_inputs_and_the_caller_wins(ring):
    with_both = run(ring, step_size=0.1, coupling="gauss-seidel", mid_step=["b.u", "a.u"])
    with_none = run(ring, step_size=0.1, coupling="gauss-seidel")
    assert not np.array_equal(with_both.values, with_none.values)
    path = proposing(ring, ["a.u", "b.u"])
    with load(path) as loaded:
        assert loaded.experiment.algorithm.mid_step == ("a.u", "b.u")
    np.testing.assert_array_equal(run(path, step_size=0.1).values, with_both.values)
    np.testing.assert_array_equal(run(path, step_size=0.1, mid_step=[]).values, with_none.values)
    np.testing.assert_array_equal(run(path, step_size=0.1, coupling="gauss-seidel").values, with_none.values)


WRONG = [
    ("g.v", "there is no input g.v, did you mean g.u?"),
    ("h.u", "input h.u is not connected and cannot be taken at the middle of a step"),
    ("m.held", "input m.held is not continuous and cannot be taken at the middle of a step"),
    ("m.n", "input m.n is not continuous and cannot be taken at the middle of a step"),
]


@pytest.fixture
def wrong(folder):
    gain = "CosimGain.fmu"
    parts = [component(name, gain, "u> y<") for name in "gh"] + [component("m", "CosimMixed.fmu", "held> n>:Integer")]
    return write(folder, system(parts, [connection("h.y -> g.u"), connection("g.y -> m.held")]))


@pytest.mark.parametrize(("name", "problem"), WRONG)
def test_an_input_of_the_file_that_cannot_be_taken_at_mid_step_is_named_with_its_line(wrong, name, problem):
    path = proposing(wrong, ["g.u", name])
    line = next(i for i, text in enumerate(path.read_text().splitlines(), 1) if f'"{name}"' in text)
    assert check(path) == [f"{problem} (SystemStructure.ssd line {line})"]


def test_all_such_inputs_of_the_caller_are_named_together(wrong):
    with load(wrong) as loaded, pytest.raises(TwipError) as failure:
        simulate(loaded, step_size=0.1, algorithm=Algorithm(mid_step=["g.u", *(name for name, _ in WRONG)]))
    assert str(failure.value).splitlines() == [problem for _, problem in WRONG]
