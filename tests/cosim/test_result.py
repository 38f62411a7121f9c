"""What a run returns: its rows in memory, by name and as a structured array, or a word on where they went."""

import numpy as np
import pytest
from ssp_writer import component, system, write

from twip.cosim import Runtime, Table, load, simulate
from twip.errors import TwipError


@pytest.fixture
def path(folder):
    return write(folder, system([component("m", "CosimMixed.fmu")]))


def test_a_run_without_sinks_keeps_its_rows(path, loop):
    result = simulate(load(path, start_values={"m.n": 2}), step_size=0.25, runtime=Runtime(loop=loop))
    assert result.times.tolist() == [0.0, 0.25, 0.5, 0.75, 1.0]
    assert result["m.total"].tolist() == [0.0, 2.0, 4.0, 6.0, 8.0]
    array = result.to_numpy()
    assert array.shape == (5,)
    assert array.dtype.names[:3] == ("time", "m.smooth", "m.held")
    assert [array.dtype[name] for name in ("time", "m.seen", "m.total", "m.inverted")] == [float, float, int, bool]
    assert array["time"].tolist() == result.times.tolist()
    assert array["m.total"].tolist() == [0, 2, 4, 6, 8]
    assert array["m.inverted"].tolist() == [True] * 5
    assert [event.level for event in result.events] == ["warning"] * len(result.warnings)
    assert result.values["m.total"] == 8.0


def test_a_name_that_is_not_there_is_told_with_the_nearest(path):
    result = simulate(load(path), step_size=0.5)
    with pytest.raises(TwipError, match=r"there is no column m.totl; near: m.total"):
        result["m.totl"]


def test_rows_that_went_to_sinks_are_not_in_the_result(path):
    with load(path) as loaded:
        table = Table(loaded.channels)
        result = simulate(loaded, step_size=0.5, sinks=[table])
        nothing = simulate(loaded, step_size=0.5, sinks=[])
    for each in (result, nothing):
        with pytest.raises(TwipError, match="the rows of this run went to its sinks"):
            each["m.total"]
    assert np.array_equal(table["m.total"], [0.0, 3.0, 6.0])
