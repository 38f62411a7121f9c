"""Instances that serve several runs, and variations of a loaded system's start values."""

import numpy as np
import pytest
from flat_options import grouped
from ssp_writer import bind, component, connection, system, write

from twip.cosim import InstancePool, Runtime, Table, load, simulate
from twip.cosim.fmus.component import Instance
from twip.errors import TwipError


@pytest.fixture
def path(folder):
    parts = [
        component("a", "CosimIntegrator.fmu", "u> x<", bind({"u": ("Real", 2.0)})),
        component("b", "CosimIntegrator.fmu", "u> x<"),
        component("f", "CosimFaulty.fmu", "u> y<"),
        component("h", "CosimHidden.fmu"),
    ]
    return write(folder, system(parts, [connection("a.x -> b.u")]))


@pytest.fixture
def created(monkeypatch):
    """The names of the instances that are made, in order."""
    names = []
    original = Instance.__init__

    def counted(self, component, *arguments):
        names.append(component.name)
        original(self, component, *arguments)

    monkeypatch.setattr(Instance, "__init__", counted)
    return names


def rows(loaded, pool=None, **options):
    table = Table(loaded.channels)
    simulate(loaded, step_size=0.125, sinks=[table], **grouped(pool=pool, **options))
    return table.values


def test_runs_of_a_pool_equal_runs_of_new_instances(path, created, loop):
    with load(path) as loaded, InstancePool() as pool:
        starts = [{"a.x_start": x, "f.fault": "chatter", "b.x_start": -x} for x in (1.0, 3.0, 1.0)]
        anew = [rows(loaded.with_start_values(s), loop=loop) for s in starts]
        del created[:]
        kept = [rows(loaded.with_start_values(s), pool, loop=loop) for s in (*starts, {})]
        assert created == ["a", "b", "f", "h"]
        np.testing.assert_array_equal(kept[:3], anew)
        np.testing.assert_array_equal(kept[3], rows(loaded))
        assert kept[0][-1].tolist() == [2.0, 3.0, 2.75, 0.875, 0.0, 8.0, 8.0]


def test_instances_of_a_failed_run_serve_no_other(path, created, loop):
    with load(path) as loaded, InstancePool() as pool:
        rows(loaded, pool, loop=loop)
        with pytest.raises(TwipError, match=r"f failed at t = 0\.5 s"):
            rows(loaded.with_start_values({"f.fault": "discard", "f.fault_time": 0.5}), pool, loop=loop)
        del created[:]
        after = rows(loaded, pool, loop=loop)
        assert created == ["a", "b", "f", "h"]
        np.testing.assert_array_equal(after, rows(loaded, loop=loop))


def test_messages_belong_to_the_run_in_which_they_were_said(path):
    with load(path, start_values={"f.fault": "chatter", "f.fault_time": 0.75}) as loaded, InstancePool() as pool:
        for _ in range(2):
            table = Table(loaded.channels)
            simulate(loaded, step_size=0.125, sinks=[table], runtime=Runtime(pool=pool))
            told = [(m.time, m.source, m.level) for m in table.events]
            assert told == [(t, "f", level) for t in (0.75, 0.875) for level in ("info", "warning")]


def test_variations_are_what_load_would_make(path):
    values = {"a.x_start": 4, "b.x_start": "-1.5", "f.fault": "nan"}
    with load(path, start_values={"a.x_start": 1.0}) as loaded, load(path, start_values=values) as wanted:
        varied = loaded.with_start_values(values)
        given = [[(s.variable.name, s.value) for s in c.start_values] for c in varied.components]
        assert given == [[(s.variable.name, s.value) for s in c.start_values] for c in wanted.components]
        assert varied.sources == wanted.sources
        assert [s.value for s in loaded.components[0].start_values] == [2.0, 1.0]


def test_values_of_connectors_reach_what_is_behind_them(folder):
    parts = [component("a", "CosimIntegrator.fmu", "u> x<")]
    path = write(folder, system(parts, [connection("drive -> a.u")], ports="drive>"))
    with load(path, start_values={"drive": 1.0}) as loaded:
        varied = loaded.with_start_values({"drive": 3.0})
        assert rows(varied)[-1].tolist() == rows(load(path, start_values={"drive": 3.0}))[-1].tolist()
        assert rows(loaded)[-1].tolist() != rows(varied)[-1].tolist()


def test_all_mistakes_of_a_variation_are_told_at_once(path):
    with load(path) as loaded, pytest.raises(TwipError) as caught:
        loaded.with_start_values({"a.xstart": 1.0, "b.u": 1.0, "a.x_start": "much"})
    assert str(caught.value).splitlines() == [
        "unknown parameter a.xstart, did you mean a.x_start? (start values)",
        "x_start = 'much' must be a finite Real number (component a, start values)",
        "b.u is connected inside the system and cannot be given a start value (start values)",
    ]
