"""The unit that a connector of a component states must fit its variable's, whether or not anything is connected."""

import pytest
from ssp_writer import component, connection, edit_fmu, line_of, system, units, write

from twip.cosim import check, load
from twip.errors import TwipError

TAIL = '<ssd:DefaultExperiment stopTime="1"/>'


@pytest.fixture
def kelvin(folder):
    """A gain whose input and output are in K."""
    variables = {"u": {"unit": "K"}, "y": {"unit": "K"}}
    return edit_fmu(folder / "CosimGain.fmu", folder / "k.fmu", variables=variables, definitions="K K=1").name


@pytest.mark.parametrize("wires", [[], [connection("a.y -> b.u")]])
@pytest.mark.parametrize(
    ("ports", "connector", "reason"),
    [
        ("u> y<:Real[m]", "a.y: is in m", "units differ"),
        ("u>:Real[m] y<", "a.u: is in m", "units differ"),
        ("u> y<:Real[ell]", "a.y: is in ell", "unit ell has no definition"),
    ],
)
def test_a_unit_that_measures_something_else_is_refused_where_it_stands(
    folder, kelvin, wires, ports, connector, reason
):
    body = system([component("a", kelvin, ports), component("b", kelvin, "u> y<")], wires)
    path = write(folder, body, tail=units("m m=1") + TAIL)
    place = f"SystemStructure.ssd line {line_of(path, 'k.fmu')}"
    told = f"connector {connector}, but in K in k.fmu: {reason} ({place})"
    assert check(path) == [told]
    with pytest.raises(TwipError) as error:
        load(path)
    assert str(error.value) == told
