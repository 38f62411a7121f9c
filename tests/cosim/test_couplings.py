"""The family of couplings: found by its folder, known to nobody by name."""

import ast
from pathlib import Path

import pytest
from ssp_writer import component, connection, system, write

import twip
from twip.cosim import load
from twip.cosim.coupling.algorithms import COUPLINGS, DEFAULT, IN_ORDER, OPTIONS, named
from twip.cosim.coupling.algorithms.base import CouplingAlgorithm, Stages
from twip.cosim.coupling.coupling import Coupling
from twip.cosim.coupling.scheduling import make_schedule
from twip.errors import TwipError

SOURCES = sorted(Path(twip.__file__).parent.rglob("*.py"))


def test_the_couplings_come_from_the_simplest_to_the_costliest():
    assert list(COUPLINGS) == ["jacobi", "gauss-seidel", "iterated"]
    assert (DEFAULT.name, IN_ORDER.name) == ("jacobi", "gauss-seidel")
    assert list(OPTIONS) == ["iteration_tolerance", "maximum_iterations"]
    assert named(lambda algorithm: not algorithm.repeats) == "jacobi or gauss-seidel"


def test_only_its_own_file_names_a_coupling():
    found = {name: [] for name in COUPLINGS}
    for path in SOURCES:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Constant) and isinstance(node.value, str) and node.value in found:
                found[node.value].append(path.name)
    assert found == {"jacobi": ["jacobi.py"], "gauss-seidel": ["gauss_seidel.py"], "iterated": ["iterated.py"]}


@pytest.mark.parametrize("algorithm", COUPLINGS.values(), ids=lambda a: a.name)
def test_the_stages_of_a_coupling_have_every_component_once(algorithm):
    wires = {("b", "u"): ("a", "y"), ("a", "u"): ("b", "y"), ("c", "u"): ("b", "y")}
    stages = algorithm.stages(["a", "b", "c"], wires, algorithm.completed({}))
    assert [name for stage in stages.members for name in stage] == ["a", "b", "c"]
    assert bool(stages.cycles) == algorithm.repeats
    assert stages.cycles in ((), ((0, 2),))


def test_stages_without_a_component_are_refused(folder):
    class Forgetful(CouplingAlgorithm):
        name = "forgetful"

        def stages(self, order, _sources, _options):
            return Stages((tuple(order[1:]),))

    body = system(
        [component("a", "CosimGain.fmu", "y<"), component("b", "CosimGain.fmu", "u>")], [connection("a.y -> b.u")]
    )
    with load(write(folder, body)) as loaded, pytest.raises(TwipError) as failure:
        make_schedule(loaded, Coupling(Forgetful()))
    assert str(failure.value) == "coupling forgetful: the stages (('b',),) must have every component once"
