"""Compiled blocks: the same bits as plain Python, cached in the folder that a master keeps."""

import ast
import math
import os
import subprocess
import sys
from pathlib import Path

import fmi_replay
import pytest
from fmi_blocks import BLOCKS

from twip.fmi.blocks import PACKAGE, block_folders

ALLOWED = {"sqrt", "floor", "fabs", "copysign", "frexp", "ldexp", "isfinite", "pi", "inf", "nan"}
"""Names of `math` that are exact, so that no machine and no compiler computes them otherwise."""
BUILTINS = {"min", "max", "abs", "int", "float", "range"}
FORBIDDEN = (
    *(ast.Pow, ast.MatMult, ast.Try, ast.Raise, ast.With, ast.Lambda, ast.Yield, ast.Await, ast.JoinedStr, ast.Starred),
    *(
        ast.List,
        ast.Dict,
        ast.Set,
        ast.ListComp,
        ast.DictComp,
        ast.SetComp,
        ast.GeneratorExp,
        ast.Import,
        ast.ImportFrom,
    ),
)
SOURCES = [*sorted((PACKAGE / "robot").glob("*.py")), *(block_folders()[n] / f"{n}.py" for n in BLOCKS)]


def run(fmu, folder, reference, *options):
    command = [sys.executable, *options, fmi_replay.__file__, fmu, folder, reference]
    result = subprocess.run(list(map(str, command)), capture_output=True, text=True, timeout=300, check=False)
    assert result.returncode == 0, result.stderr
    return result.stdout


def test_compiled_and_plain_give_the_same_bits(fmu_path, robot_block, tmp_path):
    """The reference output is that of plain Python; the second process finds the compiled code in the folder."""
    rows = len((block_folders()[robot_block] / "output.csv").read_text(encoding="utf-8").splitlines()) - 1
    out = run(fmu_path(robot_block), tmp_path / "kept", block_folders()[robot_block])
    assert out == f"{rows} rows, 0 differ, numba loaded\n"
    assert list((tmp_path / "kept" / "resources").glob("_twip_*/**/*.nbi"))


DISK_FILLS = """
import resource, signal, sys
from pathlib import Path
from fmi_host import WARNING, Fmu, Instance
from fmi_replay import kept, replay
fmu = Fmu(sys.argv[1], kept(Path(sys.argv[2])))
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (2000, 2000))
for _ in range(2):
    one = Instance(fmu)
    _, expected, found = replay(one, Path(sys.argv[3]))
    print(found == expected, [text for status, _, text in one.log if status == WARNING])
    one.free()
"""


def test_a_disk_that_fills_while_a_block_is_compiled_leaves_it_plain(fmu_path, tmp_path):
    words = [fmu_path("motor"), tmp_path / "kept", block_folders()["motor"]]
    command = [sys.executable, "-c", DISK_FILLS, *map(str, words)]
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parent)}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=300, check=False)
    told = "the block runs uncompiled: numba's cache cannot be written (File too large)"
    assert (done.stdout, done.returncode) == (f"{True} {[told]}\n" * 2, 0), done.stderr


def kernels(path):
    """Return the marked functions of a module, and the functions it takes from `math`."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    marked = [
        node
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef) and any(getattr(d, "id", "") == "kernel" for d in node.decorator_list)
    ]
    taken = {
        a.asname or a.name
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and node.module == "math"
        for a in node.names
    }
    return marked, taken


def named_tuples(path):
    classes = [n for n in ast.parse(path.read_text()).body if isinstance(n, ast.ClassDef)]
    return [c.name for c in classes if [ast.unparse(base) for base in c.bases] == ["NamedTuple"]]


def broken_rules(path, known):
    marked, taken = kernels(path)
    rules = [f"math.{name}" for name in sorted(taken - ALLOWED) if marked]
    for function in marked:
        for node in ast.walk(function):
            if isinstance(node, FORBIDDEN):
                rules.append(
                    f"{function.name}, line {node.lineno if hasattr(node, 'lineno') else '?'}: {type(node).__name__}"
                )
            elif isinstance(node, ast.BinOp) and isinstance(node.op, FORBIDDEN):
                rules.append(f"{function.name}, line {node.lineno}: {type(node.op).__name__}")
            elif isinstance(node, ast.Call):
                name = getattr(node.func, "id", None)
                if name not in known | BUILTINS | taken:
                    rules.append(f"{function.name}, line {node.lineno}: calls {ast.unparse(node.func)}")
    return rules


@pytest.mark.parametrize("path", SOURCES, ids=lambda p: p.name)
def test_kernels_keep_to_what_both_compute_identically(path):
    known = {function.name for source in SOURCES for function in kernels(source)[0]}
    known |= {name for source in SOURCES for name in named_tuples(source)}
    assert broken_rules(path, known) == []


def test_the_scan_sees_what_it_forbids(tmp_path):
    bad = tmp_path / "bad.py"
    bad.write_text(
        "from math import hypot, sin\n\n@kernel\n"
        "def f(v):\n    return v.x**2 + hypot(1.0, sum([v.x])) + round(sin(v.x))\n"
    )
    found = "; ".join(broken_rules(bad, set()))
    for word in ("math.hypot", "math.sin", "Pow", "calls sum", "calls round", "List"):
        assert word in found


def test_every_step_is_made_of_kernels():
    for name in BLOCKS:
        functions = {f.name for f in kernels(block_folders()[name] / f"{name}.py")[0]}
        assert {"initialize", "step"} <= functions


def test_allowed_functions_exist():
    assert all(hasattr(math, name) for name in ALLOWED)
    assert Path(SOURCES[0]).is_file()
