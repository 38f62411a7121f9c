"""Arguments of a run: what cannot be is refused; what is not given comes from the file and the FMUs."""

import pytest
from flat_options import grouped
from ssp_writer import component, edit_fmu, proposing, system, write

from twip.cosim import Algorithm, load, simulate
from twip.errors import TwipError

GAIN = "CosimGain.fmu"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"step_size": 0}, "step size 0.0 s must be a positive number"),
        ({"step_size": -1}, "step size -1.0 s must be a positive number"),
        ({"step_size": float("nan")}, "step size nan s must be a positive number"),
        ({"step_size": 0.3}, "step size 0.3 s does not divide the interval from 0.0 s to 1.0 s (3.33333333 steps)"),
        ({"step_size": 3}, "step size 3.0 s does not divide the interval from 0.0 s to 1.0 s (0.333333333 steps)"),
        ({"step_size": 0.1, "stop_time": -1}, "stop time -1.0 s must be later than start time 0.0 s"),
        ({"step_size": 0.1, "stop_time": float("inf")}, "stop time inf s must be later than start time 0.0 s"),
        ({"step_size": 1e-300}, "step size 1e-300 s is too small for the interval from 0.0 s to 1.0 s"),
        (
            {"start_time": 1e9, "stop_time": 1e9 + 2**-21, "step_size": 2**-24},
            "step size 5.960464477539063e-08 s is below the resolution of time near 1000000000.0000005 s (1.2e-07 s)",
        ),
        ({}, "step size is not given, and neither SystemStructure.ssd nor any FMU proposes one"),
        ({"step_size": 1, "coupling": "magic"}, "coupling 'magic' must be one of jacobi, gauss-seidel, iterated"),
        ({"step_size": 1, "loop": "magic"}, "loop 'magic' must be one of compiled, python"),
    ],
)
def test_arguments_of_a_run_that_cannot_be(folder, options, message):
    with load(write(folder, system([component("a", GAIN)]))) as loaded, pytest.raises(TwipError) as failure:
        simulate(loaded, **grouped(**options))
    assert str(failure.value) == message


def test_step_and_coupling_come_from_the_annotation_then_from_the_fmus(folder):
    stepped = edit_fmu(folder / GAIN, folder / "g.fmu", step_size=0.125).name
    tail = proposing('coupling="gauss-seidel" stepSize="0.25"')
    with load(write(folder, system([component("a", stepped)]), tail=tail)) as loaded:
        result = simulate(loaded)
        assert (result.step_size, result.coupling) == (0.25, "gauss-seidel")
        result = simulate(loaded, step_size=0.5, algorithm=Algorithm(coupling="jacobi"), stop_time=2)
        assert (result.steps, result.coupling) == (4, "jacobi")
    with load(write(folder, system([component("a", stepped)]))) as loaded:
        result = simulate(loaded)
        assert (result.step_size, result.coupling) == (0.125, "jacobi")
    with (
        load(write(folder, system([component("a", stepped)]), tail="")) as loaded,
        pytest.raises(TwipError, match="stop time is not given"),
    ):
        simulate(loaded)
