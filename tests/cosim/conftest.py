"""FMUs for the tests of the master, built once by plain pythonfmu in a process of its own."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import c_fmu
import pytest
from checkpoint_runs import prepare

HERE = Path(__file__).parent
BUILD = """
import sys
from pathlib import Path
from pythonfmu.builder import FmuBuilder
for script in sorted(Path(sys.argv[1]).glob("*.py")):
    FmuBuilder.build_FMU(script, dest=sys.argv[2])
"""


@pytest.fixture(params=["compiled", "python"])
def loop(request) -> str:
    """How steps are executed: a test that takes this runs once in each way."""
    return request.param


@pytest.fixture(scope="session")
def fmus(tmp_path_factory) -> Path:
    """A folder with an FMU for each of `slaves/`, as plain pythonfmu makes them: CosimGain.fmu and so on."""
    folder = tmp_path_factory.mktemp("fmus")
    sources = folder / "sources"
    shutil.copytree(HERE / "slaves", sources, ignore=shutil.ignore_patterns("__pycache__"))
    subprocess.run(
        [sys.executable, "-c", BUILD, str(sources), str(folder)], check=True, capture_output=True, timeout=120
    )
    return folder


@pytest.fixture
def folder(fmus, tmp_path) -> Path:
    """An own folder for a test, with the FMUs in it."""
    for fmu in fmus.glob("*.fmu"):
        os.link(fmu, tmp_path / fmu.name)
    return tmp_path


@pytest.fixture(scope="session")
def faulty(tmp_path_factory) -> Path:
    """The FMU that misbehaves on demand, see `c_fmu`."""
    return c_fmu.build(tmp_path_factory.mktemp("faulty"))


@pytest.fixture
def faulty_folder(faulty, tmp_path) -> Path:
    """An own folder for a test, with `faulty.fmu` in it."""
    os.link(faulty, tmp_path / faulty.name)
    return tmp_path


@pytest.fixture
def state_folder(fmus, tmp_path) -> Path:
    """An own folder for a test, with the FMUs able to serialize their state and `in.csv` for `checkpoint_runs`."""
    return prepare(fmus, tmp_path)
