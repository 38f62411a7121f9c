"""The robot in other people's masters gives the bits of our loop in their scheme."""

import importlib.util
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[1]
STEPS = 1500
"""Held for a second, then half a second of standing up, at 1 ms."""


@pytest.fixture(scope="module")
def conformance():
    """The benchmark as a module."""
    path = ROOT / "benchmarks" / "conformance.py"
    specification = importlib.util.spec_from_file_location("conformance", path)
    module = importlib.util.module_from_spec(specification)
    sys.modules["conformance"] = module
    specification.loader.exec_module(module)
    return module


def test_the_page_is_what_the_command_writes(conformance, built):
    names, _ = conformance.robot(built)
    text = conformance.PAGE.read_text(encoding="utf-8")
    rows = {line.split(" | ")[0].strip("| "): line.split(" | ") for line in text.splitlines() if line.startswith("| ")}
    assert set(rows) == {
        *("tool", "signal"),
        *(f"our compiled loop, {c}{f}" for c in ("gauss-seidel", "jacobi") for f in ("", ", native FMUs")),
        *(t.name for t in conformance.TOOLS),
        *(f"`{n}`" for n in names),
    }
    outcomes = [
        conformance.Outcome(name, row[1], row[2], dict.fromkeys(names, 0.0), True)
        for name, row in rows.items()
        if row[-1].strip(" |") == "equal"
    ]
    assert len(outcomes) >= 12
    for line in conformance.page(outcomes, names).splitlines():
        assert line in text or line.startswith(("| signal", "|---", "| `"))


def test_our_loop_follows_the_times_it_is_given(conformance, built):
    names, _ = conformance.robot(built)
    plain = conformance.ours(built, names, None, 20, coupling="jacobi", loop="python")
    same = conformance.ours(built, names, conformance.times_by_product(20), 20)
    assert np.array_equal(plain, same)
    times, sizes = conformance.times_by_product(20)
    longer = conformance.ours(built, names, (times, 1.5 * sizes), 20)
    assert not np.array_equal(plain, longer)


def test_a_missing_tool_is_reported_as_missing(conformance, built):
    tool = conformance.Tool("none", "no-such-distribution", "ecos.py", "ssp/twip.ssp", "", conformance.times_by_sum)
    outcome = conformance.try_tool(tool, built, ["plant.pitch"], [0], 1)
    assert (outcome.problem, outcome.equal) == ("missing", False)


@pytest.fixture(scope="module")
def both_flavours(conformance, built, tmp_path_factory):
    """A folder with the robot of Python FMUs and that of native ones."""
    folder = tmp_path_factory.mktemp("flavours")
    conformance.build_for_here(folder)
    (folder / "ssp" / "twip.ssp").symlink_to(built / "ssp" / "twip.ssp")
    return folder


JUDGED = ["libcosim", "Ecos", "libcosim, native FMUs", "Ecos, native FMUs"]


@pytest.mark.foreign
@pytest.mark.parametrize("name", JUDGED)
def test_masters_give_our_bits_in_their_scheme(conformance, both_flavours, name):
    (tool,) = (t for t in conformance.TOOLS if t.name == name)
    names, references = conformance.robot(both_flavours)
    outcome = conformance.try_tool(tool, both_flavours, names, references, STEPS)
    assert outcome.problem == ""
    assert {n: d for n, d in outcome.differences.items() if d} == {}


@pytest.mark.foreign
@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_fmpy_gives_our_bits_of_the_native_robot(conformance, both_flavours, version):
    (tool,) = (t for t in conformance.TOOLS if t.name == f"fmpy simulate, native robot FMI {version}")
    names, references = conformance.robot(both_flavours)
    outcome = conformance.try_tool(tool, both_flavours, names, references, 300)
    assert (outcome.problem, outcome.equal) == ("", True)
    assert not conformance.try_tool(replace(tool, coupled=False), both_flavours, names, references, 300).equal


@pytest.mark.foreign
def test_the_schemes_are_told_apart(conformance, built):
    names, references = conformance.robot(built)
    for number, other in ((2, conformance.times_by_sum), (3, conformance.times_by_nanoseconds)):
        tool = replace(conformance.TOOLS[number], times=other)
        assert not conformance.try_tool(tool, built, names, references, STEPS).equal
