"""The blocks in FMI 3.0: valid, complete, and equal to those in FMI 2.0 bit for bit."""

import os
import subprocess
import sys

import fmi3_host
import pytest
from fmi_blocks import BLOCKS, OWN_BLOCKS, face_of
from fmi_host import DISCARD, ERROR, OK
from fmi_replay import replay
from fmpy import read_model_description
from fmpy.validation import validate_fmu

from twip.fmi.blocks import block_folders
from twip.fmi.build import build_blocks
from twip.fmi.messages import Messages


@pytest.fixture(scope="session")
def fmi3_paths(tmp_path_factory):
    """The FMUs in FMI 3.0 by the name of their block."""
    folder = tmp_path_factory.mktemp("fmi3")
    names = [*BLOCKS, *OWN_BLOCKS]
    build_blocks([(face_of(n), folder / f"{n}_fmi3.fmu") for n in names], lambda _: None, "3.0")
    return {n: folder / f"{n}_fmi3.fmu" for n in names}


@pytest.fixture(scope="session")
def loaded3(fmi3_paths, tmp_path_factory):
    """The unpacked and loaded FMU in FMI 3.0 by the name of its block; each once per session."""
    fmus = {}

    def load(name):
        if name not in fmus:
            fmus[name] = fmi3_host.Fmu(fmi3_paths[name], tmp_path_factory.mktemp(f"{name}3"))
        return fmus[name]

    return load


@pytest.fixture
def instance3(loaded3):
    """Make instances of a block in FMI 3.0; they are freed after the test."""
    made = []

    def make(name):
        made.append(fmi3_host.Instance(loaded3(name)))
        return made[-1]

    yield make
    for one in made:
        one.free()


def test_fmpy_finds_nothing_to_complain_about(fmi3_paths, name):
    assert validate_fmu(str(fmi3_paths[name])) == []


def test_the_descriptions_say_the_same(fmu_path, fmi3_paths, name):
    two, three = (read_model_description(str(p)) for p in (fmu_path(name), fmi3_paths[name]))
    assert three.fmiVersion == "3.0"
    time, *variables = three.modelVariables
    assert (time.causality, time.name, time.type) == ("independent", "time", "Float64")
    types = {"Real": "Float64", "Integer": "Int32", "Boolean": "Boolean"}
    for a, b in zip(two.modelVariables, variables, strict=True):
        for attribute in ("name", "valueReference", "causality", "variability", "initial", "description", "unit",
                          "displayUnit", "min", "max", "nominal", "start"):  # fmt: skip
            assert getattr(a, attribute) == getattr(b, attribute), (a.name, attribute)
        assert types[a.type] == b.type
    for ours, theirs in ((two.outputs, three.outputs), (two.initialUnknowns, three.initialUnknowns)):
        assert [(u.variable.name, {d.name for d in u.dependencies}) for u in ours] == [
            (u.variable.name, {d.name for d in u.dependencies}) for u in theirs
        ]
    ours, theirs = (
        [(u.name, repr(u.baseUnit), [(d.name, d.factor, d.offset) for d in u.displayUnits]) for u in d.unitDefinitions]
        for d in (two, three)
    )
    assert ours == theirs
    assert three.coSimulation.canGetAndSetFMUstate
    assert three.coSimulation.canSerializeFMUstate
    assert three.coSimulation.canHandleVariableCommunicationStepSize


def test_it_matches_the_reference_output_of_its_block(instance3, robot_block):
    _, expected, found = replay(instance3(robot_block), block_folders()[robot_block])
    assert found == expected


@pytest.mark.parametrize("start", [0.0, 3.7])
def test_both_versions_give_the_same_bits(instance, instance3, name, start):
    two, three = instance(name).begin(start), instance3(name).begin(start)
    size = two.fmu.step_size
    for k in range(20):
        for one in (two, three):
            values = {n.replace(".", "__"): fmi3_host.wave(three.fmu, n, k) for n in three.fmu.of("input")}
            one.set(**values)
            assert one.step(start + k * size, size) == OK, one.log
        variables = list(two.fmu.variables)
        assert two.get(*variables) == three.get(*variables), k
    assert three.get("time") == start + 19 * size + size


def test_restoring_repeats_bit_for_bit_in_another_instance(instance3, name):
    first, second = instance3(name).begin(), instance3(name)
    first.run(0, 10)
    state = first.save()
    data = first.serialize(state)
    expected = first.run(10, 10)
    first.restore(state)
    assert first.run(10, 10) == expected
    first.release(state)
    state = second.deserialize(data)
    second.restore(state)
    second.release(state)
    assert second.run(10, 10) == expected


def test_a_refused_value_is_logged_and_fails_the_next_step(instance3):
    one = instance3("walker").begin()
    one.set(pull=float("nan"))
    assert "pull = nan m must be finite" in one.log[-1][2]
    assert one.step(0.0, 0.01) == ERROR


def test_a_mistake_of_before_is_an_error_of_the_step_and_a_failure_of_its_own_a_discard(instance3):
    one = instance3("raising").begin()
    state = one.save()
    one.set(divisor=0.0)
    assert one.step(0.0, 1e-3) == DISCARD  # it was tried, and a shorter one might do
    assert one.step(0.0, 1e-3) == ERROR  # nothing is tried any more
    one.restore(state)
    one.set(divisor=4.0)
    assert one.step(0.0, 1e-3) == OK
    one.release(state)
    out_of_bounds = instance3("walker").begin(gain=11.0)
    assert [(c, t) for _, c, t in out_of_bounds.log] == [("logStatusError", "gain = 11 1/s must be at most 10 1/s")]
    assert out_of_bounds.step(0.0, 0.01) == ERROR


@pytest.mark.parametrize(("formats", "logged"), [(True, "50 %% of it"), (False, "50 % of it")])
def test_per_cent_signs_are_doubled_where_the_log_takes_a_format(formats, logged):
    queue = []
    Messages(queue, formats).fail("50 % of it")
    assert [m.msg for m in queue] == [logged]


def test_none_of_ten_runs_ends_badly(fmi3_paths, tmp_path):
    command = [sys.executable, "-m", "fmpy", "simulate", str(fmi3_paths["walker"]), "--output-file", "out.csv"]
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    runs = [subprocess.run(command, env=environment, cwd=tmp_path, capture_output=True, check=False) for _ in range(10)]
    assert [(r.returncode, r.stderr) for r in runs] == [(0, b"")] * 10
