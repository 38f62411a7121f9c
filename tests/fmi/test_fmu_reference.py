"""Each block replays its folder's reference input and matches its reference output; its README tells its signals."""

import re

import pytest
from fmi_replay import replay, table

from twip.fmi.blocks import block_folders
from twip.fmi.table import unit_of

SHOWN = ("input", "output")


def test_it_matches_its_reference_output(instance, robot_block):
    header, expected, found = replay(instance(robot_block), block_folders()[robot_block])
    assert len(expected) > 100
    for k, (ours, theirs) in enumerate(zip(found, expected, strict=True)):
        assert ours == theirs, (k, header)


def test_the_reference_moves_every_output(robot_block):
    header, rows = table(block_folders()[robot_block] / "output.csv")
    still = [n for n, column in zip(header, zip(*rows, strict=True), strict=True) if len(set(column)) == 1]
    # nothing falls in the reference run, the default floor has no bumps, and the limits of friction are parameters
    allowed = {"fallen", "ground_slope_rate"} | {n for n in header if n.endswith("_limit")}
    assert set(still) <= allowed


def signal_rows(text):
    """Return the rows of all Markdown tables whose first cell is a name in backquotes: name → other cells."""
    rows = {}
    for line in text.splitlines():
        cells = [c.strip() for c in line.strip().strip("|").split("|")]
        if line.strip().startswith("|") and re.fullmatch(r"`[\w.]+`", cells[0]):
            rows[cells[0].strip("`")] = cells[1:]
    return rows


def test_the_readme_tells_every_signal(declared, robot_block):
    rows = signal_rows((block_folders()[robot_block] / "README.md").read_text(encoding="utf-8"))
    variables = {v.name: v for v in declared(robot_block).variables if v.causality != "state"}
    assert {n for n, v in variables.items() if v.causality in SHOWN} <= set(rows)
    assert set(rows) <= set(variables)
    for name, cells in rows.items():
        assert variables[name].causality in cells, name
        unit = unit_of(variables[name])
        assert {unit} & set(cells) if unit else {"1", "", "-", "–"} & set(cells), f"{name} [{unit}]: {cells}"


@pytest.mark.parametrize("attempt", ["zeros", "garbage"])
def test_initialization_depends_on_parameters_and_inputs_alone(declared, name, attempt):
    block = declared(name)
    results = []
    for filler in (0.0, 0.0 if attempt == "zeros" else 123.456):
        values = Bag()
        for v in block.variables:
            known = v.causality in ("parameter", "input")
            setattr(values, v.attribute, float(v.start) if known else filler)
        for _ in range(2 if filler or attempt == "zeros" else 1):
            block.initialize(values, 0.25)
        results.append({v.attribute: getattr(values, v.attribute) for v in block.variables})
    assert results[0] == results[1]


class Bag:
    """An object with any attributes."""


def test_outputs_respond_at_once_to_declared_inputs_only(instance, declared, name):
    """At initialization an output may change with an input only if it says that it depends on it."""
    one = instance(name)
    one.enter()
    outputs = one.fmu.of("output")
    depends = {v.name: v.depends + v.initially for v in declared(name).variables}
    for variable in one.fmu.of("input"):
        start = one.get(variable)
        before = one.get(*outputs) if len(outputs) > 1 else [one.get(*outputs)]
        for value in (start + 0.37, start - 0.21):
            one.set(**{variable.replace(".", "__"): value})
            after = one.get(*outputs) if len(outputs) > 1 else [one.get(*outputs)]
            moved = {n for n, a, b in zip(outputs, before, after, strict=True) if a != b}
            assert {n for n in moved if variable not in depends[n]} == set(), variable
        one.set(**{variable.replace(".", "__"): start})
