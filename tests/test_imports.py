"""The layers import in one direction only (docs/architecture.md), and never inside a function."""

import ast
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SOURCES = sorted((ROOT / "src" / "twip").rglob("*.py"))
FACES = sorted((ROOT / "fmus").glob("*/*.py"))
STANDARD = set(sys.stdlib_module_names)

ALLOWED = {
    "robot": {"twip.robot"},
    "fmi": {"twip.fmi", "twip.robot", "twip.errors", "pythonfmu", "fmpy", "lxml", "markdown_it"},
    "cosim": {"twip.cosim", "twip.errors", "fmpy", "mcap", "google", "numba", "llvmlite", "numpy", "lxml", "lz4", "zstandard"},
    "lab": {"twip", "matplotlib", "numpy", "scipy"},
}
"""Per layer, what a module may import besides the standard library."""


def imports(path: Path, package: str) -> list[tuple[str, int]]:
    """Return the absolute names that a module imports, with their lines."""
    found = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found += [(alias.name, node.lineno) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = package.split(".")[: len(package.split(".")) - node.level + 1] if node.level else []
            found.append((".".join([*base, node.module] if node.module else base), node.lineno))
    return found


def within(name: str, allowed: set[str]) -> bool:
    return any(name == a or name.startswith(a + ".") for a in allowed)


def package_of(path: Path) -> str:
    return ".".join(path.relative_to(ROOT / "src").parent.parts)


@pytest.mark.parametrize("path", [p for p in SOURCES if len(p.relative_to(ROOT / "src").parts) > 2], ids=lambda p: p.relative_to(ROOT / "src").as_posix())
def test_layer_imports_only_what_it_may(path):
    layer = path.relative_to(ROOT / "src" / "twip").parts[0]
    wrong = [(n, line) for n, line in imports(path, package_of(path)) if n.split(".")[0] not in STANDARD and not within(n, ALLOWED[layer])]
    if path.name == "kernel.py":
        wrong = [(n, line) for n, line in wrong if not within(n, {"numba", "numpy"})]
    assert not wrong


@pytest.mark.parametrize("path", FACES, ids=lambda p: p.stem)
def test_a_face_imports_the_robot_and_the_declaration_only(path):
    wrong = [(n, line) for n, line in imports(path, "") if n.split(".")[0] not in STANDARD and not within(n, {"twip.robot", "twip.fmi.declare"})]
    assert not wrong


@pytest.mark.parametrize("path", [*SOURCES, *FACES], ids=lambda p: p.relative_to(ROOT).as_posix())
def test_no_import_inside_a_function(path):
    functions = [n for n in ast.walk(ast.parse(path.read_text(encoding="utf-8"))) if isinstance(n, ast.FunctionDef | ast.Lambda)]
    inside = [n.lineno for f in functions for n in ast.walk(f) if isinstance(n, ast.Import | ast.ImportFrom)]
    assert not inside


def test_the_walk_sees_every_layer():
    assert {p.relative_to(ROOT / "src" / "twip").parts[0] for p in SOURCES} >= set(ALLOWED)
    assert len(FACES) >= 6
