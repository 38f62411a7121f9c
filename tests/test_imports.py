"""The layers import in one direction only (docs/architecture.md), and never inside a function."""

import ast
import re
import sys
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SOURCES = sorted((ROOT / "src" / "twip").rglob("*.py"))
LAYERED = [path for path in SOURCES if len(path.relative_to(ROOT / "src").parts) > 2]
CALLERS = [path for path in LAYERED if path.relative_to(ROOT / "src" / "twip").parts[0] in ("lab", "commands")]
FACES = sorted((ROOT / "fmus").glob("*/*.py"))
STANDARD = set(sys.stdlib_module_names)

ALLOWED = {
    "robot": {"twip.robot"},
    "fmi": {
        *("twip.fmi", "twip.robot", "twip.errors", "twip.lazy", "twip.outputs", "twip.platform"),
        *("pythonfmu", "pythonfmu3", "fmpy", "lxml", "markdown_it"),
    },
    "cosim": {
        *("twip.cosim", "twip.errors", "twip.interrupts", "twip.lazy", "twip.outputs", "twip.platform"),
        *("fmpy", "google", "llvmlite", "lxml", "lz4", "mcap", "numba", "numpy", "zstandard"),
    },
    "lab": {"twip", "PIL", "bokeh", "google", "matplotlib", "numpy", "rich", "scipy", "websockets"},
    "commands": {"twip", "numpy", "rich"},
}
"""Per layer, what a module may import besides the standard library."""
FLOORS = (
    ("reading",),
    ("values",),
    ("model",),
    ("fmus", "log"),
    ("coupling", "sinks"),
    ("ssp",),
    ("swap", "scenario"),
    ("run",),
    ("load", "simulate", "overview"),
    ("inspection",),
)
"""The folders and top modules of `cosim`, from the lowest floor up: each imports from floors below its own only."""
FLOOR = {part: floor for floor, parts in enumerate(FLOORS) for part in parts}
COSIM = ROOT / "src" / "twip" / "cosim"
OFFERED = {name: import_module(name).__all__ for name in ("twip.cosim", "twip.cosim.log", "twip.fmi", "twip.robot")}
"""What callers may use of the layers below `lab` and `commands`."""


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


def forbidden(path: Path, package: str, allowed: set[str]) -> list[tuple[str, int]]:
    found = imports(path, package)
    return [(name, line) for name, line in found if name.split(".")[0] not in STANDARD and not within(name, allowed)]


def parts_imported(text: str, package: str) -> set[str]:
    """Return the parts of `cosim` that a module's text imports from."""
    found = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = package.split(".")[: len(package.split(".")) - node.level + 1] if node.level else []
            names = [".".join([*base, *(node.module or "").split("."), alias.name]) for alias in node.names]
        else:
            continue
        inside = [name.replace("..", ".").split(".") for name in names]
        found |= {name[2] for name in inside if name[:2] == ["twip", "cosim"] and len(name) > 2}
    return found


def behind_the_faces(path: Path, package: str) -> list[tuple[str, int]]:
    """Return what a module imports of a layer with a face, and the face does not offer."""
    found = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found += [(alias.name, node.lineno) for alias in node.names if within(alias.name, set(OFFERED))]
        elif isinstance(node, ast.ImportFrom):
            base = package.split(".")[: len(package.split(".")) - node.level + 1] if node.level else []
            module = ".".join([*base, node.module] if node.module else base)
            names = [alias.name for alias in node.names]
            if module == "twip":
                found += [(f"twip.{name}", node.lineno) for name in names if f"twip.{name}" in OFFERED]
            elif within(module, set(OFFERED)):
                offered = OFFERED.get(module, ())
                found += [(f"{module}.{name}", node.lineno) for name in names if name not in offered]
    return found


def upwards(text: str, part: str, package: str) -> set[str]:
    """Return the parts that `part` imports from, in a module of `package`, though they do not stand below it."""
    return {other for other in parts_imported(text, package) if other != part and FLOOR[other] >= FLOOR[part]}


def package_of(path: Path) -> str:
    return ".".join(path.relative_to(ROOT / "src").parent.parts)


@pytest.mark.parametrize("path", LAYERED, ids=lambda p: p.relative_to(ROOT / "src").as_posix())
def test_layer_imports_only_what_it_may(path):
    layer = path.relative_to(ROOT / "src" / "twip").parts[0]
    optional = {"numba", "numpy"} if path.name == "kernel.py" else set()
    assert not forbidden(path, package_of(path), ALLOWED[layer] | optional)


@pytest.mark.parametrize("path", CALLERS, ids=lambda p: p.relative_to(ROOT / "src").as_posix())
def test_lab_and_commands_use_what_the_layers_below_offer(path):
    assert not behind_the_faces(path, package_of(path))


def test_an_import_behind_a_face_is_seen(tmp_path):
    file = tmp_path / "x.py"
    for text, seen in (
        ("from ..cosim import load, tidy", ["twip.cosim.tidy"]),
        ("from ..cosim.model.system import System", ["twip.cosim.model.system.System"]),
        ("from ..cosim.log import Scan, log_scan", ["twip.cosim.log.log_scan"]),
        ("import twip.robot.parameters", ["twip.robot.parameters"]),
        ("from .. import fmi", ["twip.fmi"]),
        ("from ..errors import TwipError\nfrom . import report", []),
    ):
        file.write_text(text)
        assert [name for name, _ in behind_the_faces(file, "twip.lab")] == seen


@pytest.mark.parametrize("face", OFFERED)
def test_everything_that_is_offered_is_there_and_documented(face):
    page = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
    assert len(set(OFFERED[face])) == len(OFFERED[face])
    for name in OFFERED[face]:
        assert getattr(import_module(face), name) is not None
        assert re.search(rf"\b{name}\b", page), name
    with pytest.raises(AttributeError, match=r"has no attribute 'nothing'"):
        _ = import_module(face).nothing


@pytest.mark.parametrize("path", sorted(COSIM.rglob("*.py")), ids=lambda p: p.relative_to(COSIM).as_posix())
def test_a_folder_of_the_master_imports_only_what_stands_below_it(path):
    part = path.relative_to(COSIM).with_suffix("").parts[0]
    if part == "__init__":
        return  # what callers use
    assert not upwards(path.read_text(encoding="utf-8"), part, package_of(path))


def test_an_import_that_runs_upwards_is_seen():
    package = "twip.cosim.model"
    assert upwards("from ..ssp.links import Link", "model", package) == {"ssp"}
    assert upwards("from twip.cosim import load, values", "model", package) == {"load"}
    assert upwards("from .. import run", "model", package) == {"run"}
    assert upwards("import twip.cosim.log.playback", "model", package) == {"log"}
    assert upwards("from ..log import log_event", "fmus", "twip.cosim.fmus") == {"log"}
    assert not upwards("from ..values.units import Unit\nfrom .signals import Signal", "model", package)


def test_every_part_of_the_master_has_a_floor():
    parts = {p.stem for p in COSIM.iterdir() if p.suffix == ".py" or (p / "__init__.py").is_file()} - {"__init__"}
    assert parts == set(FLOOR)


@pytest.mark.parametrize("path", FACES, ids=lambda p: p.stem)
def test_a_face_imports_the_robot_and_the_declaration_only(path):
    assert not forbidden(path, "", {"twip.robot", "twip.fmi.declare"})


@pytest.mark.parametrize("path", [*SOURCES, *FACES], ids=lambda p: p.relative_to(ROOT).as_posix())
def test_no_import_inside_a_function(path):
    tree = ast.parse(path.read_text(encoding="utf-8"))
    functions = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef | ast.Lambda)]
    inside = [n.lineno for f in functions for n in ast.walk(f) if isinstance(n, ast.Import | ast.ImportFrom)]
    assert not inside


def test_the_walk_sees_every_layer():
    assert {p.relative_to(ROOT / "src" / "twip").parts[0] for p in SOURCES} >= set(ALLOWED)
    assert len(FACES) >= 6
