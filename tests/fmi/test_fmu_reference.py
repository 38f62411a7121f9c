"""Each block replays its folder's reference input and matches its reference output; its README tells its signals."""

import csv
import re
import struct

import pytest

from twip.fmi.blocks import block_folders
from twip.fmi.table import unit_of

SHOWN = ("input", "output")


def table(path):
    """Read a CSV file with a `time` column; return its header and its rows as floats."""
    with path.open(encoding="utf-8", newline="") as file:
        header, *rows = csv.reader(file)
    assert header[0] == "time"
    return header, [[float(x) for x in row] for row in rows]


def at(time, rows):
    """Return the row at a time: linear between rows, constant outside them, the last of several rows at one time."""
    before = [row for row in rows if row[0] <= time]
    after = [row for row in rows if row[0] > time]
    if not before or not after:
        return (before or after[:1])[-1]
    left, right = before[-1], after[0]
    share = (time - left[0]) / (right[0] - left[0])
    return [a + share * (b - a) for a, b in zip(left, right, strict=True)]


def test_it_matches_its_reference_output(instance, declared, robot_block):
    """The first row holds after initialization; before a step the inputs are set to what they are at its beginning."""
    folder = block_folders()[robot_block]
    inputs, driven = table(folder / "input.csv")
    outputs, expected = table(folder / "output.csv")
    block, size = instance(robot_block), declared(robot_block).step_size
    assert set(inputs[1:]) <= set(block.fmu.of("input"))
    assert set(outputs[1:]) == set(block.fmu.of("output"))
    assert len(expected) > 100
    block.enter()
    for k, row in enumerate(expected):
        values = dict(zip(inputs, at(k * size, driven), strict=True))
        if k == 0:
            block.set(**{n.replace(".", "__"): x for n, x in values.items() if n != "time"})
            block.check("ExitInitializationMode")
        found = [k * size, *(block.get(n) for n in outputs[1:])]
        # numbers in the file are the shortest decimals that read back as the same float: every bit must agree
        assert [struct.pack("d", x) for x in found] == [struct.pack("d", x) for x in row], (k, outputs)
        block.set(**{n.replace(".", "__"): x for n, x in values.items() if n != "time"})
        assert block.step(k * size, size) == 0, block.log


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
