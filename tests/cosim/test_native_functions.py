"""The compiled loop calls compiled blocks directly: same bits, same failures, and FMI where a block declines."""

from pathlib import Path

import numpy as np
import pytest
from ssp_writer import component, connection, system, write

from twip.cosim import Checkpoints, Inputs, Runtime, Table, load, simulate
from twip.cosim.coupling.compiled_loop import CompiledLoop
from twip.cosim.fmus.component import Instance
from twip.cosim.fmus.native import NOT_NATIVE
from twip.errors import TwipError
from twip.fmi.build import build_blocks

BLOCKS = Path(__file__).parents[1] / "fmi" / "blocks"


@pytest.fixture(scope="module", params=["2.0", "3.0"])
def blocks(tmp_path_factory, request):
    """A system of two blocks that remember and one that fails on demand, in both versions of FMI."""
    folder = tmp_path_factory.mktemp("native")
    names = ("walker", "raising")
    faces = {name: folder / name / f"{name}.py" for name in names}
    for (
        name,
        face,
    ) in faces.items():  # other content than in tests/fmi, which load the blocks uncompiled into this process
        face.parent.mkdir()
        face.write_text((BLOCKS / name / f"{name}.py").read_text() + f"\n# called natively, FMI {request.param}\n")
    build_blocks([(face, folder / f"{name}.fmu") for name, face in faces.items()], lambda _: None, request.param)
    elements = [
        component("a", "walker.fmu", "pull> position< pulled<"),
        component("b", "walker.fmu", "pull> position< pulled<"),
        component("c", "raising.fmu", "dividend> divisor> result< half_done<"),
    ]
    write(folder, system(elements, [connection("a.position -> b.pull"), connection("b.pulled -> c.dividend")]))
    return folder


def run(folder, loop, start_values=None, divisor=None):
    """Return the rows, how the run ended, and what was said on the way."""
    inputs = None
    if divisor is not None:
        inputs = folder / "in.csv"
        inputs.write_text("time,c.divisor\n" + divisor)
    with load(folder / "SystemStructure.ssd", start_values=start_values or {}) as loaded:
        table = Table(loaded.channels)
        try:
            simulate(
                loaded,
                stop_time=1.0,
                step_size=0.01,
                runtime=Runtime(loop=loop),
                sinks=[table],
                inputs=Inputs(file=inputs),
            )
            told = ""
        except TwipError as failure:
            told = str(failure)
    return table, told


def test_both_loops_give_the_same_bits_and_the_compiled_one_steps_natively(blocks, monkeypatch):
    made = []
    prepare = CompiledLoop.__init__
    monkeypatch.setattr(
        CompiledLoop, "__init__", lambda self, execution: (made.append(self), prepare(self, execution))[1]
    )
    (compiled, _), (plain, _) = run(blocks, "compiled"), run(blocks, "python")
    assert np.array_equal(compiled.values, plain.values)
    assert len(np.unique(compiled["b.position"])) == 101
    steppers = made[0].steppers
    assert len(steppers) == 3
    assert not np.any(steppers[:, 1] == steppers[:, 3])  # the addresses of the native step and of fmi2DoStep


@pytest.mark.parametrize(
    ("start_values", "divisor", "rows", "words"),
    [
        (None, "0,2\n0.5,0\n", 51, "ZeroDivisionError"),
        (None, "0,2\n0.25,1e-320\n", 26, "must be finite"),
        ({"c.overflow": True}, None, 1, "result = nan"),
    ],
)
def test_a_failing_block_leaves_the_same_rows_and_the_same_line(blocks, start_values, divisor, rows, words):
    (compiled, line), (plain, expected) = (run(blocks, loop, start_values, divisor) for loop in ("compiled", "python"))
    assert line == expected
    assert words in line
    assert len(compiled.times) == len(plain.times) == rows
    assert np.array_equal(compiled.values, plain.values)


def test_a_block_that_is_not_compiled_is_called_by_fmi(blocks, monkeypatch):
    monkeypatch.setattr("twip.cosim.coupling.compiled_loop.native_access", lambda _: NOT_NATIVE)
    through_fmi, _ = run(blocks, "compiled")
    monkeypatch.undo()
    natively, _ = run(blocks, "compiled")
    assert np.array_equal(through_fmi.values, natively.values)


def test_an_announcement_that_is_no_address_is_not_followed(blocks, monkeypatch):
    for text in ("", "1", "1 x", "-1 2", "1 2 3"):
        monkeypatch.setattr(Instance, "get_string", lambda *_, text=text: text)
        table, told = run(blocks, "compiled")
        assert told == ""
        assert len(table.times) == 101


def test_both_loops_leave_the_blocks_in_the_same_state(blocks, tmp_path):
    """Also the time that an FMU in FMI 3 shows, which no call tells it in a native step."""
    files = []
    for loop in ("compiled", "python"):
        files.append(tmp_path / loop)
        with load(blocks / "SystemStructure.ssd") as loaded:
            simulate(
                loaded,
                stop_time=0.5,
                step_size=0.01,
                runtime=Runtime(loop=loop),
                checkpoints=Checkpoints(file=files[-1]),
            )
    assert files[0].read_bytes() == files[1].read_bytes()
