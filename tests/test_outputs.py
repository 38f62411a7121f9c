"""Files are written whole or not at all, and in one way."""

import ast
import os
import re
import stat
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from twip.errors import TwipError
from twip.outputs import replacing, write_file

ROOT = Path(__file__).parents[1] / "src" / "twip"
ELSEWHERE = {
    "cli.py": "the standard output that nobody reads",
    "platform.py": "a file of the kernel",
    "cosim/fmus/fmu_cache.py": "a folder that is renamed as a whole",
    "cosim/log/sole_file.py": "files that grow during a run",
    "cosim/fmus/unpacked.py": "a temporary folder",
    "fmi/native/toolchain.py": "a temporary folder",
    "fmi/package.py": "a temporary folder",
    "lab/rerun_view.py": "a temporary folder",
    "outputs.py": "the one way",
}
"""Modules that write a file without `replacing` or `write_file`, and which."""
WRITERS = {"write_text", "write_bytes", "copyfile", "mkstemp", "savefig", "write_table", "save", "savetxt", "tofile"}


def writes(module):
    """Return the lines of a module that write a file by its path."""
    found = []
    for call in (node for node in ast.walk(ast.parse(module.read_text())) if isinstance(node, ast.Call)):
        name = getattr(call.func, "attr", getattr(call.func, "id", ""))
        values = [*call.args, *(keyword.value for keyword in call.keywords)]
        modes = [v.value for v in values if isinstance(v, ast.Constant) and isinstance(v.value, str)]
        into_a_stream = any(isinstance(v, ast.Name) and v.id == "stream" for v in values)
        if (
            (name in ("open", "fdopen") and any(re.fullmatch("[rwxabt+]*[wxa+][bt+]*", mode) for mode in modes))
            or (name == "open" and isinstance(call.func, ast.Attribute) and ast.unparse(call.func) == "os.open")
            or (name in WRITERS and isinstance(call.func, ast.Attribute) and not into_a_stream)
        ):
            found.append(call.lineno)
    return found


def test_nothing_else_writes_files():
    found = {path.relative_to(ROOT).as_posix(): writes(path) for path in ROOT.rglob("*.py")}
    assert {name: lines for name, lines in found.items() if lines and name not in ELSEWHERE} == {}
    assert all(found[name] for name in ELSEWHERE)


def test_a_file_is_created_with_its_folders_and_replaced(tmp_path):
    path = tmp_path / "a" / "b" / "file.txt"
    write_file(path, b"old")
    assert path.read_bytes() == b"old"
    umask = os.umask(0)
    os.umask(umask)
    assert stat.S_IMODE(path.stat().st_mode) == 0o666 & ~umask
    path.chmod(0o640)
    write_file(path, b"new")
    assert path.read_bytes() == b"new"
    assert stat.S_IMODE(path.stat().st_mode) == 0o640
    assert list(path.parent.iterdir()) == [path]


@pytest.mark.parametrize("failure", [ValueError, KeyboardInterrupt])
def test_a_failure_leaves_the_old_file_and_nothing_else(tmp_path, failure):
    path = tmp_path / "file.txt"
    path.write_bytes(b"old")
    seen = []

    def fail():
        with replacing(path) as stream:
            stream.write(b"half of the n")
            stream.flush()
            seen.extend((len(list(tmp_path.iterdir())), path.read_bytes()))
            raise failure

    with pytest.raises(failure):
        fail()
    assert seen == [2, b"old"]
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_the_scratch_file_has_another_name_each_time_and_follows_no_link(tmp_path, monkeypatch):
    path, victim, names = tmp_path / "file.txt", tmp_path / "victim", set()
    for _ in range(20):
        with replacing(path) as stream:
            names |= {file.name for file in tmp_path.iterdir()} - {path.name}
            stream.write(b"new")
    assert len(names) == 20
    victim.write_bytes(b"precious")
    (tmp_path / ".twip-known").symlink_to(victim)
    monkeypatch.setattr("secrets.token_hex", lambda _: "known")
    with pytest.raises(TwipError, match=f"^{path}: cannot be written: File exists$"):
        write_file(path, b"newer")
    assert victim.read_bytes() == b"precious"
    assert path.read_bytes() == b"new"


def test_a_link_keeps_leading_to_its_file(tmp_path):
    (tmp_path / "far").mkdir()
    link, file = tmp_path / "link", tmp_path / "far" / "file"
    link.symlink_to(file)
    for content in (b"made", b"replaced"):
        write_file(link, content)
        assert link.is_symlink()
        assert file.read_bytes() == content


def test_a_pipe_is_written_directly(tmp_path):
    pipe, read = tmp_path / "pipe", []
    os.mkfifo(pipe)
    reader = threading.Thread(target=lambda: read.append(pipe.read_bytes()))
    reader.start()
    write_file(pipe, b"content")
    reader.join(10)
    assert read == [b"content"]
    assert stat.S_ISFIFO(pipe.stat().st_mode)


@pytest.mark.parametrize(
    ("place", "message"),
    [
        ("folder", "{}/folder: cannot be written: Is a directory"),
        ("file/a", "{}/file: cannot be written: File exists"),
        ("loop", "{}/loop: cannot be written: Too many levels of symbolic links"),
        ("x" * 300, f"{{}}/{'x' * 300}: cannot be written: File name too long"),
        ("nul\0", "{}/nul\\x00: cannot be written: embedded null byte"),
    ],
)
def test_what_cannot_be_written_is_named(tmp_path, place, message):
    (tmp_path / "folder").mkdir()
    (tmp_path / "file").touch()
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(TwipError) as caught:
        write_file(tmp_path / place, b"content")
    assert str(caught.value) == message.format(tmp_path)
    assert sorted(tmp_path.rglob("*")) == before


FULL = """
import resource, sys
from pathlib import Path
import numpy as np
from twip.errors import TwipError
from twip.lab.drawing import picture
from twip.lab.identification.experiments import staircase
from twip.lab.paper.reports import write_reports
from twip.lab.report.frame import write_page
from twip.cosim.ssp.parameter_file import Entry, write_parameter_set
from twip.fmi.archive import write_archive

path = Path(sys.argv[1])
def draw():
    with picture(path, "noise", [3.0]) as (axes,):
        axes.plot(np.random.default_rng(0).normal(size=(3000, 2)))
makes = {
    ".html": lambda: write_page("x" * 100_000, path),
    ".ssv": lambda: write_parameter_set(path, "set", [Entry(f"a.b{i}", "Real", 1.0) for i in range(1000)]),
    ".fmu": lambda: write_archive(path, {"a": bytes(100_000)}, "a"),
    ".csv": lambda: staircase(step=0.0001).write(path),
    ".md": lambda: write_reports([], path.parent),
}
resource.setrlimit(resource.RLIMIT_FSIZE, (500 if path.suffix == ".md" else 10_000,) * 2)
try:
    makes.get(path.suffix, draw)()
except TwipError as error:
    print(error)
"""


@pytest.mark.parametrize("name", ["a.html", "a.png", "a.svg", "a.pdf", "a.ssv", "a.fmu", "a.csv", "results.md"])
def test_a_full_disk_leaves_the_old_file(tmp_path, name):
    path = tmp_path / name
    path.write_bytes(b"old")
    done = subprocess.run([sys.executable, "-c", FULL, path], stdout=subprocess.PIPE, text=True, check=True, timeout=60)
    assert done.stdout == f"{path}: cannot be written: File too large\n"
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]
