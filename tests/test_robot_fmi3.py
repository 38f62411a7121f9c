"""The robot made of its blocks in FMI 3.0 is the robot made of them in FMI 2.0."""

import shutil

import numpy as np
import pytest

from twip.cosim import Runtime, Table, load, simulate
from twip.cosim.coupling.coupling import INITIAL
from twip.cosim.coupling.scheduling import make_schedule
from twip.fmi.build import build_fmi3

SOURCES = {"left": "motor", "right": "motor", "plant": "plant", "imu": "imu", "estimator": "estimator",
           "controller": "controller"}  # fmt: skip


@pytest.fixture(scope="module")
def swaps(built, tmp_path_factory):
    """All FMUs by component, in FMI 2.0 and in FMI 3.0, as folders: those run without being compiled first."""
    folder = tmp_path_factory.mktemp("fmi3")
    build_fmi3(folder, sorted(set(SOURCES.values())))
    for block in set(SOURCES.values()):
        shutil.unpack_archive(built / "fmus" / f"{block}.fmu", folder / "2.0" / block, "zip")
        shutil.unpack_archive(folder / "fmus" / f"{block}_fmi3.fmu", folder / "3.0" / block, "zip")
    return {v: {name: folder / v / block for name, block in SOURCES.items()} for v in ("2.0", "3.0")}


@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_declared_dependencies_close_no_algebraic_loop(built, swaps, version):
    with load(built / "ssp" / "twip.ssp", swap=swaps[version]) as system:
        plan = make_schedule(system, INITIAL)
        assert plan.loops == ()
        order = [system.components[i].name for i in plan.order]
    assert order.index("plant") > max(order.index("left"), order.index("right"))
    assert order[-4:] == ["plant", "imu", "estimator", "controller"]


def test_both_robots_stand_up_bit_for_bit(built, swaps):
    tables = []
    for swap in swaps.values():
        with load(built / "ssp" / "twip.ssp", swap=swap) as system:
            tables.append(Table(system.channels))
            simulate(system, stop_time=1.5, runtime=Runtime(loop="python"), sinks=[tables[-1]])
    for name in system.columns:
        assert np.array_equal(tables[0][name], tables[1][name]), name
