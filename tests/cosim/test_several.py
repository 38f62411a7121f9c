"""Arguments of the Python interface that take one thing or several: a text is never taken letter by letter."""

import pytest
from flat_options import grouped
from ssp_writer import GAIN, a_and_b, component, connection, parameter_set, system, write

from twip.cosim import Algorithm, Table, check, load, simulate
from twip.cosim.scenario.live_inputs import LiveInputs
from twip.errors import TwipError


@pytest.fixture
def path(folder):
    (folder / "p.ssv").write_text(parameter_set({"a.k": ("Real", 7)}))
    return write(folder, a_and_b(connection("a.y -> b.u")))


@pytest.mark.parametrize("one", [str, lambda path: path, lambda path: [path], lambda path: (str(path),)])
def test_one_parameter_file_may_stand_alone(path, one):
    given = one(path.parent / "p.ssv")
    assert check(path, parameters=given) == []
    with load(path, parameters=given) as model:
        assert [start.value for start in model.components[0].start_values] == [7.0]


def test_one_name_may_stand_alone(path):
    with load(path) as model:
        alone = simulate(model, step_size=0.25, algorithm=Algorithm(mid_step="b.u"))
        listed = simulate(model, step_size=0.25, algorithm=Algorithm(mid_step=["b.u"]))
        assert alone.table.values.tobytes() == listed.table.values.tobytes()
        assert LiveInputs(model, "a.u").names == ("a.u",)
    with load(write(path.parent, system([component("abc", GAIN)]))) as model:
        assert simulate(model, step_size=0.25, algorithm=Algorithm(coupling="gauss-seidel", order="abc")).steps == 4


def test_one_sink_may_stand_alone(path):
    with load(path) as model:
        table = Table(model.channels)
        simulate(model, step_size=0.25, sinks=table)
    assert len(table.times) == 5


def test_what_is_neither_is_refused_in_one_line(path):
    with load(path) as model:
        for options, said in (
            ({"mid_step": [3]}, "mid_step: 3 must be a name"),
            ({"own_steps": "a=0.5"}, "own_steps = 'a=0.5' must be a mapping, such as {'component.variable': 1.0}"),
        ):
            with pytest.raises(TwipError) as raised:
                simulate(model, step_size=0.25, **grouped(**options))
            assert str(raised.value) == said
        with pytest.raises(TwipError, match=r"^start_values = \['a.k', 1\] must be a mapping"):
            model.with_start_values(["a.k", 1])
    for name in ("start_values", "swap", "swap_map"):
        with pytest.raises(TwipError, match=f"^{name} = 'a.k' must be a mapping"):
            load(path, **{name: "a.k"})
