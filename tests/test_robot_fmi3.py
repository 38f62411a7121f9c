"""The robot made of its blocks in FMI 3.0 is the robot made of them in FMI 2.0."""

import numpy as np
import pytest

from twip.cosim import Table, load, simulate
from twip.cosim.coupling import Coupling
from twip.cosim.schedule import make_schedule
from twip.fmi.build import build_fmi3

SOURCES = {"left": "motor", "right": "motor", "plant": "plant", "imu": "imu", "estimator": "estimator",
           "controller": "controller"}  # fmt: skip


@pytest.fixture(scope="module")
def swaps(tmp_path_factory):
    """The swaps that leave all FMUs in FMI 2.0, and those that replace all by FMI 3.0."""
    folder = tmp_path_factory.mktemp("fmi3")
    build_fmi3(folder, sorted(set(SOURCES.values())))
    return {"2.0": {}, "3.0": {name: folder / "fmus" / f"{block}_fmi3.fmu" for name, block in SOURCES.items()}}


@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_declared_dependencies_close_no_algebraic_loop(built, swaps, version):
    with load(built / "ssp" / "twip.ssp", swap=swaps[version]) as system:
        plan = make_schedule(system, Coupling("gauss-seidel"))
        assert plan.loops == ()
        order = [system.components[i].name for i in plan.order]
    assert order.index("plant") > max(order.index("left"), order.index("right"))
    assert order[-4:] == ["plant", "imu", "estimator", "controller"]


@pytest.mark.heavy
def test_both_robots_stand_up_bit_for_bit(built, swaps):
    tables = []
    for swap in swaps.values():
        with load(built / "ssp" / "twip.ssp", swap=swap) as system:
            tables.append(Table(system.channels))
            simulate(system, stop_time=3.0, sinks=[tables[-1]])
    for name in system.columns:
        assert np.array_equal(tables[0][name], tables[1][name]), name
