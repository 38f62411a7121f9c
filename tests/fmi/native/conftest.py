"""Machines, their programs, and the robot as one native FMU."""

import pytest
from native_hosts import ARM, HERE, LINUX, unpack, windows

from twip.cosim import load
from twip.fmi.build import build_native
from twip.fmi.native.toolchain import this_machine
from twip.lab.native_container import pack_native


@pytest.fixture(scope="session")
def machines(tmp_path_factory):
    """All machines by name."""
    with windows(tmp_path_factory.mktemp("windows")) as wine:
        found = {"linux64": LINUX, "win64": wine, "aarch64": ARM}
        assert HERE in found.values()
        yield found


@pytest.fixture(scope="session")
def programs(tmp_path_factory):
    """The folder of the hosts."""
    return tmp_path_factory.mktemp("programs")


@pytest.fixture(scope="session")
def native_systems(tmp_path_factory):
    """A folder with native FMUs for this machine and the systems of them."""
    folder = tmp_path_factory.mktemp("native_systems")
    build_native(folder, platforms=[this_machine()])
    return folder / "ssp"


@pytest.fixture(scope="session")
def robots(native_systems, tmp_path_factory):
    """The unpacked robot as one native FMU by FMI version, for given platforms."""

    made = {}

    def pack(version, platforms):
        key = version, tuple(platforms)
        if key not in made:
            folder = tmp_path_factory.mktemp("robots")
            with load(native_systems / "twip_native.ssp") as system:
                assert pack_native(system, version, folder / "robot.fmu", platforms=platforms) == []
            made[key] = unpack(folder / "robot.fmu", folder / "fmu")
        return made[key]

    return pack
