"""What a system takes to check grows with the number of its connections, also where they are those of arrays."""

import time

import fmpy
import pytest
from echo_fmu import echo3_description, pack
from ssp_writer import component, connection, system, write

from twip.cosim import check
from twip.cosim.coupling.feedthrough import evaluation_order

TIMES = 4
"""Growth of what is measured; linear time grows as much, quadratic time by the square of it."""
MOST = 9.0
"""Growth of the time that is accepted: between 4 and 16, as the processor's caches hold less of the larger one."""


def seconds(function, *arguments):
    """Return the least processor time of three calls."""
    found = []
    for _ in range(3):
        begin = time.process_time()
        function(*arguments)
        found.append(time.process_time() - begin)
    return min(found)


def ports(*arrays):
    items = "".join(
        f'<ssd:Connector name="{name}" kind="{kind}"><ssc:Float64/><ssc:Dimension size="{size}"/></ssd:Connector>'
        for name, kind, size in arrays
    )
    return f"<ssd:Connectors>{items}</ssd:Connectors>"


def order_of(size, loop):
    """Order two components, every output of which depends on all inputs, fed one by one."""
    inputs, outputs = ([f"{letter}[{i}]" for i in range(size)] for letter in "uy")
    declared = {name: dict.fromkeys(outputs, frozenset(inputs)) for name in ("a", "b")}
    sources = {("b", u): ("a", y) for u, y in zip(inputs, outputs, strict=True)}
    if loop:
        sources |= {("a", u): ("b", y) for u, y in zip(inputs, outputs, strict=True)}
    return evaluation_order(declared, sources)


@pytest.mark.parametrize("loop", [False, True])
def test_ordering_grows_with_the_elements(loop):
    assert seconds(order_of, TIMES * 1000, loop) < MOST * seconds(order_of, 1000, loop)
    found = order_of(1000, loop)
    assert found.components == ("a", "b")
    assert [len(each) for each in found.loops] == [2000] * loop
    if loop:
        assert found.paths[0].startswith("a.y[0] → b.u[0] → b.y[0] → a.u[0] (and with them a.y[100], ")


@pytest.fixture
def system_of(tmp_path):
    """Write two systems, each around an FMU with an array of a size, one after the other."""

    def made(size):
        text = echo3_description()
        for side, start in (("in", ' start="1 2 3"'), ("out", "")):
            old = f'causality="{side}put" variability="continuous"{start}><Dimension start="3"/>'
            new = old.replace("1 2 3", "1").replace('Dimension start="3"', f'Dimension start="{size}"')
            assert old in text
            text = text.replace(old, new)
        library = tmp_path / "echo3.so"
        library.touch()  # never loaded
        pack(tmp_path / f"echo{size}.fmu", library, text, fmpy.platform_tuple)
        inside = ports(("ins_Float64", "input", size), ("outs_Float64", "output", size))
        around = ports(("x", "input", size), ("y", "output", size))
        parts = [
            system(
                [component("c", f"echo{size}.fmu", inside=inside)],
                [connection("x -> c.ins_Float64"), connection("c.outs_Float64 -> y")],
                inside=around,
                name=name,
            )
            for name in ("a", "b")
        ]
        wires = [connection("x -> a.x"), connection("a.y -> b.x"), connection("b.y -> y")]
        return write(tmp_path, system(parts, wires, inside=around), version="2.0")

    return made


def test_checking_grows_with_the_elements(system_of):
    def timed(size):
        path = system_of(size)
        assert check(path) == []
        return seconds(check, path)

    assert timed(TIMES * 100) < MOST * timed(100)
