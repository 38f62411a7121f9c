"""The members of open families are found by their folders, and nothing else knows them by name."""

import ast
from pathlib import Path

import pytest

from twip.cosim.reading.family import members
from twip.cosim.scenario.faults import kinds

SOURCES = Path(__file__).parents[1] / "src" / "twip"
MASTER = [path for part in ("cosim", "commands") for path in sorted((SOURCES / part).rglob("*.py"))]


def named(path):
    """Return the texts of a module that are whole names; docstrings are not."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    return {node.value for node in ast.walk(tree) if isinstance(node, ast.Constant) and isinstance(node.value, str)}


def test_a_kind_of_fault_is_a_file():
    files = {path.stem for path in (SOURCES / "cosim" / "scenario" / "faults").glob("*.py")} - {"__init__", "base"}
    assert list(kinds()) == ["stuck", "bias", "noise", "dropout", "delay"]
    assert set(kinds()) == files


@pytest.mark.parametrize("kind", kinds())
def test_a_kind_of_fault_is_named_in_its_own_file_only(kind):
    assert [path.name for path in MASTER if kind in named(path)] == [f"{kind}.py"]


def test_members_are_the_classes_that_a_folders_files_define(tmp_path, monkeypatch):
    package = tmp_path / "toys"
    package.mkdir()
    (package / "__init__.py").touch()
    (package / "base.py").write_text(
        "from abc import ABC, abstractmethod\nclass Toy(ABC):\n    @abstractmethod\n    def play(self): ...\n"
    )
    for name in ("top", "ball"):
        text = f"from .base import Toy\nclass {name.title()}(Toy):\n    def play(self): ...\n"
        (package / f"{name}.py").write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    assert [toy.__name__ for toy in members("toys", [str(package)])] == ["Ball", "Top"]
