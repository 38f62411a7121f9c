"""What differs between operating systems is known in one place, and the rest works where it is missing."""

import ast
import subprocess
import sys
from pathlib import Path

import fmpy
import pytest

from twip.fmi.replay import CARRIED
from twip.fmi.sources import ROOTS
from twip.platform import PLATFORMS, TUPLE

SOURCE = Path(__file__).parents[1] / "src" / "twip"
CARRIED_BY_FMUS = {*ROOTS.values(), *(f"fmi/{name}" for name in CARRIED)}
MODULES = {"fcntl", "grp", "msvcrt", "pty", "pwd", "resource", "termios", "tty", "winreg"}
NAMES = {
    *("sys.platform", "os.name", "platform.machine", "platform.system", "fmpy.architecture"),
    *("os.O_CLOEXEC", "os.O_NOFOLLOW", "os.fchmod", "os.fork", "os.killpg", "os.memfd_create", "os.sched_getaffinity"),
    *("signal.SIGHUP", "signal.SIGKILL", "signal.pthread_sigmask"),
}
FOLDERS = {name for platform in PLATFORMS for name in (platform.fmi2, platform.fmi3)}


def asked(path):
    """Yield what a module knows of platforms."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import | ast.ImportFrom):
            module = "" if isinstance(node, ast.Import) else node.module or ""
            for alias in node.names:
                yield from {alias.name, module} & MODULES
                yield from {f"{module}.{alias.name}"} & NAMES
        elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            yield from {f"{node.value.id}.{node.attr}"} & NAMES
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield from {node.value} & FOLDERS


def test_one_module_knows_the_platforms():
    found = {path.relative_to(SOURCE).as_posix(): sorted(asked(path)) for path in SOURCE.rglob("*.py")}
    assert {"fcntl", "sys.platform", "signal.SIGKILL", "os.killpg", "win64"} <= set(found.pop("platform.py"))
    foreign = {"fmi/native/toolchain.py": FOLDERS}  # Zig names some platforms as FMI does
    for path, names in found.items():
        allowed = FOLDERS if path in CARRIED_BY_FMUS else foreign.get(path, set())
        assert not set(names) - allowed, path


def test_folders_and_endings_are_those_that_fmpy_loads_here():
    (here,) = [platform for platform in PLATFORMS if platform.fmi3 == TUPLE]
    assert fmpy.platform_tuple == here.fmi3
    assert fmpy.sharedLibraryExtension == f".{here.ending}"
    if "aarch64" not in TUPLE:  # FMI 2.0 has no name for it
        assert fmpy.platform == here.fmi2


WINDOWS = """\
import os
import signal
import sys
from types import SimpleNamespace

import twip.cli
import twip.commands.check
import twip.commands.parts.live
import twip.commands.run
import twip.lab.sweep.run

for name in [name for name in sys.modules if name.split(".")[0] == "twip"]:
    del sys.modules[name]
for name in ("fcntl", "grp", "pty", "pwd", "resource", "termios", "tty"):
    sys.modules[name] = None
for name in ("SIGHUP", "SIGKILL", "pthread_sigmask"):
    delattr(signal, name)
for name in ("O_CLOEXEC", "O_NOFOLLOW", "fchmod", "fork", "killpg", "memfd_create", "sched_getaffinity"):
    delattr(os, name)
system, sys.platform = sys.platform, "win32"
import twip.platform

sys.platform = system  # the libraries at hand are of this system
twip.platform.sys = SimpleNamespace(platform="win32")
import twip.cli
import twip.lab.sweep.run

sys.exit(twip.cli.main(sys.argv[1:]))
"""


def without_posix(folder, *words):
    return subprocess.run(
        [sys.executable, "-c", WINDOWS, *words], cwd=folder, capture_output=True, text=True, check=False, timeout=200
    )


@pytest.mark.parametrize(
    ("command", "said"),
    [("check", "it would run"), ("run --loop python --stop-time 0.05 --output-file out.csv", "simulated to")],
)
def test_commands_work_without_what_windows_lacks(command, said, built, tmp_path):
    name, *options = command.split()
    result = without_posix(tmp_path, name, str(built / "ssp" / "twip.ssp"), *options)
    assert result.returncode == 0, result.stderr
    assert said in result.stdout


def test_isolation_without_it_is_refused_in_one_line(built, tmp_path):
    result = without_posix(tmp_path, "run", str(built / "ssp" / "twip.ssp"), "--isolate", "--loop", "python")
    assert result.returncode == 1
    assert result.stderr.startswith("twip: isolated FMUs need Linux")
    assert len(result.stderr.splitlines()) == 1
