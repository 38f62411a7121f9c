"""docs/paper_map.md has a row for every equation, table and figure; what it and docs/errata.md name exists."""

import ast
import re
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
MAP = (ROOT / "docs" / "paper_map.md").read_text(encoding="utf-8")
ERRATA = (ROOT / "docs" / "errata.md").read_text(encoding="utf-8")
PLACES = [f"({n})" for n in range(1, 65)] + [f"Table {n}" for n in range(1, 5)] + [f"Fig. {n}" for n in range(1, 20)]
EXPLAINED = {"corrected", "typo"}


def rows(text):
    """Return the cells of every table row that begins with an equation, table or figure."""
    lines = re.findall(r"^\| ((?:\(\d+\)|Table|Fig\.).*) \|$", text, re.MULTILINE)
    return [[cell.strip() for cell in line.split(" | ")] for line in lines]


ROWS = rows(MAP)


def named(cell):
    """Return what stands between backticks."""
    return re.findall(r"`([^`]+)`", cell)


@cache
def definitions(path):
    """Return the names that a module defines at its top level, members of classes as `Class.member`."""
    found = set()
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            found.add(node.name)
            if isinstance(node, ast.ClassDef):
                found |= {f"{node.name}.{member.name}" for member in node.body if isinstance(member, ast.FunctionDef)}
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            found |= {target.id for target in targets if isinstance(target, ast.Name)}
    return found


def exists(name):
    """Tell whether `twip.module.thing`, `folder/file` or `folder/file.py::thing` exists in the repository."""
    path, _, inner = name.partition("::")
    if "/" in path:
        return (ROOT / path).is_file() and (not inner or inner in definitions(ROOT / path))
    parts = path.split(".")
    for split in range(len(parts), 0, -1):
        module = ROOT / "src" / Path(*parts[:split])
        for file in (module.with_suffix(".py"), module / "__init__.py"):
            if file.is_file():
                return split == len(parts) or ".".join(parts[split:]) in definitions(file)
    return False


def corrected_in_errata():
    """Return the places that the headings of the errata name."""
    headings = re.findall(r"^### (.+?): ", ERRATA, re.MULTILINE)
    return {place for heading in headings for place in re.findall(r"\(\d+\)|Table \d+|Fig\. \d+", heading)}


def test_every_place_has_one_row_in_order():
    assert [row[0] for row in ROWS] == PLACES


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row[0])
def test_what_a_row_names_exists(row):
    assert len(row) == 5
    place, what, code, form, test = row
    assert what
    assert named(code)
    assert [name for name in named(code) + named(test) if not exists(name)] == []
    tests = named(test)
    assert tests
    assert all(re.fullmatch(r"tests/[\w/]+\.py::test_\w+", name) for name in tests)
    assert form in {"printed", "experiment", "drawing"} | EXPLAINED
    assert (form in EXPLAINED) == (place in corrected_in_errata())


def test_every_correction_has_its_reason_and_a_test_that_exists():
    entries = re.split(r"^### ", ERRATA, flags=re.MULTILINE)[1:]
    for entry in entries:
        tests = [name for name in named(entry) if name.startswith("tests/")]
        assert tests, entry.splitlines()[0]
        assert [name for name in tests if not exists(name)] == []
        assert "Printed: " in entry
    assert corrected_in_errata() == {row[0] for row in ROWS if row[3] in EXPLAINED}


@pytest.mark.parametrize("name", [
    "twip.robot.plant.force", "twip.robot.plants.forces", "fmus/imu/imus.py", "fmus/imu/imu.py::nothing",
    "twip.lab.stability.Trial.fell",
    "tests/robot/test_imu.py::test_nothing", "nothing",
])  # fmt: skip
def test_a_name_that_leads_nowhere_is_noticed(name):
    assert not exists(name)


def test_a_missing_or_changed_row_is_noticed():
    assert [row[0] for row in rows(MAP.replace("| (17) |", "| (170) |"))] != PLACES
    shorter = re.sub(r"^\| \(17\) .*\n", "", MAP, flags=re.MULTILINE)
    assert set(PLACES) - {row[0] for row in rows(shorter)} == {"(17)"}
