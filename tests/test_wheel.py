"""A wheel of the repository, unpacked elsewhere, runs the demonstration in an empty folder."""

import os
import subprocess
import sys
import zipfile
from pathlib import Path

ROOT = Path(__file__).parents[1]


def run(*command, **options):
    result = subprocess.run(command, capture_output=True, text=True, check=False, timeout=300, **options)
    assert result.returncode == 0, result.stderr
    return result.stdout


def test_a_wheel_runs_the_demo_in_an_empty_folder(tmp_path):
    run(sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(tmp_path / "dist"), cwd=ROOT)
    (wheel,) = (tmp_path / "dist").glob("*.whl")
    installed, empty = tmp_path / "installed", tmp_path / "empty"
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(installed)
        names = archive.namelist()
    assert not [n for n in names if n.endswith((".fmu", ".ssp", ".mcap"))]  # what is built is not shipped
    assert {n.split("/")[0] for n in names} == {"twip", next(n.split("/")[0] for n in names if "dist-info" in n)}
    empty.mkdir()
    environment = {**os.environ, "PYTHONPATH": str(installed)}
    where = "import twip; print(twip.__file__)"
    assert run(sys.executable, "-c", where, cwd=empty, env=environment).startswith(str(installed))
    out = run(sys.executable, "-m", "twip.cli", "demo", cwd=empty, env=environment)
    assert "balanced" in out
    assert {p.name for p in empty.iterdir()} == {"fmus", "ssp", "logs"}
    assert (empty / "ssp" / "parameters" / "pid.ssv").is_file()
