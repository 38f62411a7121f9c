"""What the base installation does alone, and what a command says whose extra is missing."""

import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from twip.extras import COMMANDS, PACKAGES, optional

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]

WITHOUT = """\
import sys


class Without:
    def __init__(self, finder):
        self._finder = finder

    def find_spec(self, name, *rest):
        return None if name.partition(".")[0] in {refused!r} else self._finder.find_spec(name, *rest)

    def __getattr__(self, name):
        return getattr(self._finder, name)


sys.meta_path[:] = [Without(finder) for finder in sys.meta_path]
"""
"""For a `sitecustomize`, which every Python process runs first."""


@pytest.fixture
def base(tmp_path):
    """The environment of processes that find the base dependencies alone."""
    customize = WITHOUT.format(refused={*PACKAGES, "numba"})
    (tmp_path / "site").mkdir()
    (tmp_path / "site" / "sitecustomize.py").write_text(customize)
    return {**os.environ, "PYTHONPATH": str(tmp_path / "site"), "TWIP_CACHE": str(tmp_path / "cache")}


def python(folder, environment, *words, status=0):
    result = subprocess.run(
        [sys.executable, *words], cwd=folder, env=environment, capture_output=True, text=True, check=False, timeout=300
    )
    assert result.returncode == status, result.stderr
    return result


def test_the_base_installation_builds_checks_and_runs(base, built, tmp_path):
    hidden = f"import importlib.util as u; print([m for m in {[*PACKAGES, 'numba']} if u.find_spec(m)])"
    assert python(tmp_path, base, "-c", hidden).stdout == "[]\n"
    python(tmp_path, base, "-m", "twip.cli", "build", "motor")
    assert (tmp_path / "fmus" / "motor.fmu").read_bytes() == (built / "fmus" / "motor.fmu").read_bytes()
    ssp = str(built / "ssp" / "twip.ssp")
    assert "it would run" in python(tmp_path, base, "-m", "twip.cli", "check", ssp).stdout
    words = ["run", ssp, "--stop-time", "0.1", "--output-file", "out.csv"]
    assert "simulated to" in python(tmp_path, base, "-m", "twip.cli", *words).stdout
    assert (tmp_path / "out.csv").stat().st_size > 10_000
    python(tmp_path, base, "-m", "twip.cli", *words, "--isolate")
    python(tmp_path, base, "-m", "twip.cli", "parameters", ssp)
    python(tmp_path, base, "-m", "twip.cli", "container", ssp)
    python(tmp_path, base, "-m", "twip.cli", "replay", "logs/twip.mcap", "--as", "imu.fmu")
    live = python(tmp_path, base, "-m", "twip.cli", *words, "--live", "127.0.0.1:0", status=1).stderr
    assert live == "twip: a live view needs websockets, which is not installed: pip install -e '.[view]'\n"


def test_a_command_without_its_extra_says_in_one_line_what_to_install(base, tmp_path):
    commands = dict.fromkeys(("demo", "report", "plot", "animate", "identify", "paper", "stability"), "lab")
    for command, extra in {**commands, **COMMANDS}.items():
        result = python(tmp_path, base, "-m", "twip.cli", command, status=1)
        (line,) = result.stderr.splitlines()
        assert line.startswith(f"twip: twip {command} needs ")
        assert line.endswith(f", which is not installed: pip install -e '.[{extra}]'")


def test_a_part_of_a_package_is_as_good_as_the_whole(monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow.parquet", None)
    with pytest.raises(Exception, match=r"a sweep needs pyarrow, which is not installed: pip install -e '\.\[sweep\]'"):
        optional("pyarrow.parquet", "a sweep")


def names(requirements):
    return {requirement.split(">")[0].split("=")[0] for requirement in requirements}


def test_every_package_is_installed_by_the_extra_that_is_named():
    extras = PROJECT["optional-dependencies"]
    for package in PACKAGES.values():
        assert package.name in names(extras[package.extra])
        assert package.name not in names(PROJECT["dependencies"])


def test_extras_of_commands_install_what_the_lab_needs():
    for extra in COMMANDS.values():
        assert "twip[lab]" in names(PROJECT["optional-dependencies"][extra])
