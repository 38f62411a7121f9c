"""The plan of a step: order from feed-through, stages, copies, value references."""

import itertools

import numpy as np
from ssp_writer import component, connection, edit_fmu, linear, system, write

from twip.cosim import load
from twip.cosim.coupling.algorithms import COUPLINGS
from twip.cosim.coupling.coupling import Coupling
from twip.cosim.coupling.feedthrough import evaluation_order
from twip.cosim.coupling.scheduling import make_schedule


def order(feedthrough, wires):
    sources = {tuple(end.split(".")): tuple(start.split(".")) for start, end in (w.split(" -> ") for w in wires)}
    declared = {c: {o: frozenset(i) for o, i in outputs.items()} for c, outputs in feedthrough.items()}
    found = evaluation_order(declared, sources)
    return list(found.components), [[".".join(node) for node in loop] for loop in found.loops]


def test_a_chain_runs_from_its_source_whatever_the_order_in_the_file():
    parts = {"d": {"y": "u"}, "c": {"y": "u"}, "b": {"y": "u"}, "z": {"y": ""}}
    wires = ["z.y -> d.u", "d.y -> c.u", "c.y -> b.u"]
    for permuted in itertools.permutations(parts):
        assert order({name: parts[name] for name in permuted}, wires) == (["z", "d", "c", "b"], [])


def test_a_state_breaks_a_loop():
    assert order({"plant": {"x": ""}, "law": {"u": "x"}}, ["plant.x -> law.x", "law.u -> plant.u"]) == (
        ["law", "plant"],
        [],
    )


def test_feedthrough_counts_by_variable_not_by_component():
    # a.p depends on nothing that b makes from a.q: no loop, although both depend on each other as components
    parts = {"a": {"p": "u", "q": ""}, "b": {"y": "v"}}
    assert order(parts, ["a.q -> b.v", "b.y -> a.u"]) == (["b", "a"], [])


def test_loops_are_named_and_do_not_hide_what_follows():
    parts = {"c": {"y": "u"}, "b": {"y": "u"}, "a": {"y": "u"}, "self": {"y": "u"}}
    wires = ["b.y -> c.u", "c.y -> b.u", "c.y -> a.u", "self.y -> self.u"]
    assert order(parts, wires) == (["b", "c", "self", "a"], [["b.y", "c.y"], ["self.y"]])


def test_components_without_connections_come_by_name():
    assert order({"b": {}, "a": {"y": "u"}}, []) == (["a", "b"], [])


def test_the_arrays_of_both_couplings(folder):
    gain = edit_fmu(folder / "CosimGain.fmu", folder / "g.fmu", dependencies={"y": ["u"], "z": ["u"]}).name
    body = system(
        [component("b", gain, "u> y<"), component("a", gain, "u> y<"), component("m", "CosimMixed.fmu")],
        [connection("a.y -> b.u", linear(factor=3, offset=4)), connection("b.y -> w")],
        "w<",
    )
    with load(write(folder, body)) as loaded:
        jacobi, seidel = (
            make_schedule(loaded, Coupling(COUPLINGS[coupling])) for coupling in ("jacobi", "gauss-seidel")
        )
        names = loaded.columns
    assert names[:6] == ["b.u", "b.y", "b.z", "a.u", "a.y", "a.z"]
    mixed = jacobi.components[2]
    # Real, Integer, Boolean inputs, then outputs
    assert names[6:] == [
        "m.smooth", "m.held", "m.n", "m.on", "m.seen", "m.clock", "m.sets", "m.total", "m.inverted", "w",
    ]  # fmt: skip
    assert [[g.type, g.first, len(g.references)] for g in (*mixed.inputs, *mixed.outputs)] == [
        ["Real", 6, 2], ["Integer", 8, 1], ["Boolean", 9, 1], ["Real", 10, 3], ["Integer", 13, 1], ["Boolean", 14, 1],
    ]  # fmt: skip
    for schedule in (jacobi, seidel):
        assert [schedule.components[i].name for i in schedule.order] == ["a", "m", "b"]
        assert schedule.destination.tolist() == [0, 15]
        assert schedule.source.tolist() == [4, 1]
        assert schedule.factor.tolist() == [3.0, 1.0]
        assert schedule.offset.tolist() == [4.0, 0.0]
        assert np.signbit(schedule.offset).tolist() == [False, True]
    assert jacobi.stage_order.tolist() == [0, 3, 3]
    assert jacobi.stage_copies.tolist() == [0, 1, 2]
    assert seidel.stage_order.tolist() == [0, 1, 2, 3, 3]
    assert seidel.stage_copies.tolist() == [0, 0, 0, 1, 2]
