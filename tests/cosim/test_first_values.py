"""Initialization mode: outputs are read when what they depend on is set, and loops begin at the start values."""

import pytest
from flat_options import grouped
from ssp_writer import bind, component, connection, edit_fmu, linear, system, write

from twip.cosim import load, simulate


@pytest.fixture
def parts(fmus, tmp_path):
    """FMUs that say what depends on what."""
    depends = {
        "CosimIntegrator": {"x": []},
        "CosimGain": {"y": ["u"], "z": ["u"]},
        "CosimHeron": {"y": ["u"], "z": ["u"]},
    }
    for name, dependencies in depends.items():
        edit_fmu(fmus / f"{name}.fmu", tmp_path / f"{name}.fmu", dependencies=dependencies)
    return tmp_path


def reals(**values):
    return bind({name: ("Real", value) for name, value in values.items()})


def first_row(path, **options):
    with load(path) as loaded:
        result = simulate(loaded, stop_time=0.1, step_size=0.1, **grouped(loop="python", **options))
    return {name: float(result[name][0]) for name in loaded.columns}, result.warnings


def shared(row, expected):
    return {name: row[name] for name in expected}


@pytest.mark.parametrize("isolate", [False, True])
@pytest.mark.parametrize("coupling", ["jacobi", "gauss-seidel"])
def test_no_output_is_asked_for_before_its_inputs_are_set(parts, coupling, isolate):
    """x(0) = 2 → z = 1 / x → x' = z: z is not defined at u = 0, where FMUs begin, and x does not wait for z."""
    inverse, state = (
        component("a", "CosimHeron.fmu", "u> z<"),
        component("b", "CosimIntegrator.fmu", "u> x<", reals(x_start=2)),
    )
    path = write(parts, system([inverse, state], [connection("b.x -> a.u"), connection("a.z -> b.u")]))
    row, warnings = first_row(path, coupling=coupling, isolate=isolate)
    expected = {"a.u": 2.0, "a.z": 0.5, "b.u": 0.5, "b.x": 2.0}
    assert shared(row, expected) == expected
    assert warnings == ()


def test_values_go_around_a_loop_that_a_state_breaks(parts):
    """x(0) = 4 → z = 1 / (x / 2) → y = 3 z → x' = y, in whatever order the FMUs are executed."""
    elements = [
        component("a", "CosimHeron.fmu", "u> z<"),
        component("b", "CosimIntegrator.fmu", "u> x<", reals(x_start=4)),
        component("g", "CosimGain.fmu", "u> y<", reals(k=3)),
    ]
    wires = [connection("b.x -> a.u", linear(factor=0.5)), connection("a.z -> g.u"), connection("g.y -> b.u")]
    row, _ = first_row(write(parts, system(elements, wires)))
    expected = {"a.u": 2.0, "a.z": 0.5, "b.u": 1.5, "b.x": 4.0, "g.u": 0.5, "g.y": 1.5}
    assert shared(row, expected) == expected


@pytest.mark.parametrize(("start", "solution"), [(5.0, 2.0), (0.1, 2.0), (-1.0, -2.0)])
def test_an_algebraic_loop_begins_at_the_start_values_of_its_inputs(parts, start, solution):
    elements = [
        component("a", "CosimHeron.fmu", "u> y<", reals(u=start)),
        component("g", "CosimGain.fmu", "u> y<", reals(k=1, u=start)),
    ]
    path = write(parts, system(elements, [connection("a.y -> g.u"), connection("g.y -> a.u")]))
    row, _ = first_row(path)
    expected = dict.fromkeys(("a.u", "a.y", "g.u", "g.y"), pytest.approx(solution, rel=1e-12))
    assert shared(row, expected) == expected
