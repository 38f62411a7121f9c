"""The FMUs of all blocks and of this folder's own small blocks, unpacked and loaded once."""

import fmi3_host
import fmi_host
import pytest
from fmi_blocks import BLOCKS, OWN_BLOCKS, face_of
from fmi_host import Fmu, Instance

from twip.fmi.blocks import load_block
from twip.fmi.build import build_blocks
from twip.fmi.native.package import package_native
from twip.fmi.native.toolchain import this_machine

HOSTS = {"2.0": fmi_host, "3.0": fmi3_host}


def pytest_generate_tests(metafunc):
    """Give tests with `name` every block, those with `robot_block` the robot's alone."""
    if "name" in metafunc.fixturenames:
        metafunc.parametrize("name", [*BLOCKS, *OWN_BLOCKS])
    if "robot_block" in metafunc.fixturenames:
        metafunc.parametrize("robot_block", BLOCKS)


@pytest.fixture(scope="session")
def own_fmus(tmp_path_factory):
    """A folder with the FMUs of this folder's own blocks."""
    folder = tmp_path_factory.mktemp("own_fmus")
    build_blocks([(face_of(n), folder / f"{n}.fmu") for n in OWN_BLOCKS], lambda _: None)
    return folder


@pytest.fixture(scope="session")
def fmu_path(request):
    """Path of a built FMU by the name of its block."""

    def path(name):
        if name in OWN_BLOCKS:
            return request.getfixturevalue("own_fmus") / f"{name}.fmu"
        return request.getfixturevalue("built") / "fmus" / f"{name}.fmu"

    return path


@pytest.fixture(scope="session")
def declared():
    """The declaration of a block by its name."""
    return lambda name: load_block(face_of(name))


@pytest.fixture(scope="session")
def loaded(fmu_path, tmp_path_factory):
    """The unpacked and loaded FMU by the name of its block; each once per session."""
    fmus = {}

    def load(name):
        if name not in fmus:
            fmus[name] = Fmu(fmu_path(name), tmp_path_factory.mktemp(name))
        return fmus[name]

    return load


@pytest.fixture
def instance(loaded):
    """Make instances of a block; they are freed after the test."""
    made = []

    def make(name):
        made.append(Instance(loaded(name)))
        return made[-1]

    yield make
    for one in made:
        one.free()


@pytest.fixture(scope="session")
def native_path(tmp_path_factory):
    """Path of a native FMU by block and FMI version."""
    built = {}

    def path(name, version):
        if (name, version) not in built:
            built[name, version] = tmp_path_factory.mktemp("native") / f"{name}.fmu"
            package_native(face_of(name), built[name, version], version, [this_machine()])
        return built[name, version]

    return path


@pytest.fixture(scope="session")
def native_loaded(native_path, tmp_path_factory):
    """The unpacked and loaded FMU by block and FMI version."""
    fmus = {}

    def load(name, version):
        if (name, version) not in fmus:
            fmus[name, version] = HOSTS[version].Fmu(native_path(name, version), tmp_path_factory.mktemp(name))
        return fmus[name, version]

    return load


@pytest.fixture
def native(native_loaded):
    """Make instances of a native block; they are freed after the test."""
    made = []

    def make(name, version="2.0"):
        made.append(HOSTS[version].Instance(native_loaded(name, version)))
        return made[-1]

    yield make
    for one in made:
        one.free()
