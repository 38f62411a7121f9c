"""Names that a system may not have, because something else is called so."""

import pytest
from ssp_writer import a_and_b, bind, component, connection, line_of, system, write

from twip.cosim import Runtime, check, load, simulate

GAIN, NAME = "CosimGain.fmu", 'name="time"'


@pytest.mark.parametrize(("ports", "wire"), [("time<", "a.y -> time"), ("time>", "time -> a.u")])
def test_a_recorded_connector_called_time_is_refused(folder, ports, wire):
    path = write(folder, a_and_b(connection(wire), ports=ports))
    place = f"SystemStructure.ssd line {line_of(path, NAME)}"
    assert check(path) == [f"connector time: time is the name of the independent variable ({place})"]


def test_what_is_called_time_elsewhere_has_a_name_of_its_own(folder):
    inner = system([component("g", GAIN, "u> y<")], [connection("g.y -> time")], "time<", name="in")
    path = write(folder, system([inner], ports="time*", inside=bind({"time": ("Real", 2.0)})))
    table = simulate(load(path), stop_time=1.0, step_size=0.5, runtime=Runtime(loop="python")).to_numpy()
    assert [name for name in table.dtype.names if "time" in name] == ["time", "in.time"]
