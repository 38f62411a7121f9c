"""Values that overflow on a connection: a failure of the connection, with all rows before it, in both loops.

`i.x` grows by 1 in each step of 1/8 s, from `x_start` on.
"""

import pytest
from flat_options import grouped
from ssp_writer import component, connection, edit_fmu, linear, system, units, write

from twip.cosim import Runtime, Table, check, load, simulate
from twip.errors import TwipError

STEP = 0.125
RAMP = component("i", "CosimIntegrator.fmu", "u> x<")
HELD = component("m", "CosimMixed.fmu", "smooth> held> seen<")


def run(path, start_values=None, **options):
    """Return the times of the rows and what the run fails with."""
    with load(path, start_values={"i.u": 8.0, **(start_values or {})}) as loaded:
        table = Table(loaded.channels)
        with pytest.raises(TwipError) as failure:
            simulate(loaded, sinks=[table], **grouped(**{"step_size": STEP, **options}))
    return table.times.tolist(), str(failure.value)


@pytest.mark.parametrize(
    ("wire", "options", "rows", "at"),
    [
        ("i.x -> out", {"coupling": "jacobi"}, 2, 2),
        ("i.x -> out", {"coupling": "gauss-seidel"}, 2, 2),
        ("i.x -> m.held", {"coupling": "jacobi"}, 3, 2),  # taken at the beginning of the next step
        ("i.x -> m.held", {"coupling": "gauss-seidel"}, 2, 2),
        ("i.x -> m.held", {"coupling": "gauss-seidel", "own_steps": {"m": 4 * STEP}}, 4, 4),
    ],
)
@pytest.mark.parametrize(("factor", "gave"), [(1e308, "inf"), (-1e308, "-inf")])
def test_a_transformation_that_overflows_fails(folder, loop, wire, options, rows, at, factor, gave):
    path = write(folder, system([RAMP, HELD], [connection(wire, linear(factor))], "out<"))
    times, told = run(path, loop=loop, **options)
    assert times == [k * STEP for k in range(rows)]
    assert told == f"{wire.replace('->', '→')} failed at t = {at * STEP:g} s: gave {gave}, which is not finite"


def test_what_overflows_on_the_way_to_the_middle_of_a_step_fails(folder, loop):
    """2 x = 1.7e308 is a number, on the line to 2.5 x it is none any more."""
    path = write(folder, system([RAMP, HELD], [connection("i.x -> m.smooth", linear(8.5e307))]))
    times, told = run(path, coupling="jacobi", mid_step=["m.smooth"], loop=loop)
    assert times == [0.0, STEP, 2 * STEP]
    assert told == f"i.x → m.smooth failed at t = {2 * STEP:g} s: gave inf, which is not finite"


def test_a_fault_that_overflows_fails(folder, loop):
    path = write(folder, system([RAMP, HELD], [connection("i.x -> m.held", linear(1e308))]))
    (folder / "s.toml").write_text('[[faults]]\nsignal = "m.held"\nkind = "bias"\nvalue = 1e308\n')
    times, told = run(path, coupling="jacobi", loop=loop, scenario=folder / "s.toml")
    assert times == [0.0, STEP]
    assert told == f"i.x → m.held failed at t = {STEP:g} s: gave inf, which is not finite"


def test_other_ways_to_step_fail_alike(fmus, tmp_path):
    for name, depends in (("CosimIntegrator", {"x": []}), ("CosimMixed", {"seen": ["held"]})):
        edit_fmu(fmus / f"{name}.fmu", tmp_path / f"{name}.fmu", dependencies=depends, state=True)
    path = write(tmp_path, system([RAMP, HELD], [connection("i.x -> m.held", linear(1e308))]))
    told = f"i.x → m.held failed at t = {2 * STEP:g} s: gave inf, which is not finite"
    assert run(path, coupling="iterated") == ([0.0, STEP], told)
    assert run(path, coupling="gauss-seidel", isolate=True) == ([0.0, STEP], told)
    times, told = run(path, coupling="gauss-seidel", tolerance=1e-3)
    assert 0.0 < times[-1] < 0.225  # x = 1.8 and more is no number
    assert told.startswith("i.x → m.held failed at t = 0.22")


@pytest.mark.parametrize("wire", ["i.x -> out", "i.x -> m.held"])
def test_initial_values_that_overflow_fail(folder, loop, wire):
    path = write(folder, system([RAMP, HELD], [connection(wire, linear(1e308))], "out<"))
    times, told = run(path, {"i.x_start": 2.0}, loop=loop)
    assert times == []
    assert told == f"{wire.replace('->', '→')} failed at t = 0 s: gave inf, which is not finite"


@pytest.mark.parametrize("factor", [1e4, 1e5])  # an output overflows first, a connection does
def test_an_initial_loop_that_overflows_when_values_are_handed_around_is_solved(folder, factor):
    """b.y = 2 f a.y and a.y = 2 (b.y + 1), so that b.y (1 - 4 f) = 4 f."""
    parts = [component(name, "CosimGain.fmu", "u> y<") for name in "ab"]
    wires = [connection("a.y -> b.u", linear(factor)), connection("b.y -> a.u", linear(1, 1))]
    with load(write(folder, system(parts, wires))) as loaded:
        result = simulate(loaded, step_size=STEP, stop_time=STEP)
    expected = 4 * factor / (1 - 4 * factor)
    assert result["b.y"][0] == pytest.approx(expected, rel=1e-11)  # a few times the tolerance of the passes


def test_a_parameter_gets_no_value_that_overflows(folder, loop):
    edit_fmu(
        folder / "CosimGain.fmu",
        folder / "S.fmu",
        variables={"y": {"causality": "calculatedParameter", "variability": "fixed"}},
        no_output=["y"],
    )
    parts = [component("a", "S.fmu", "u> y="), component("b", "CosimGain.fmu", "k*"), RAMP]
    path = write(folder, system(parts, [connection("a.y -> b.k", linear(1e308, 1e308))]))
    assert run(path, loop=loop) == ([], "a.y → b.k failed at t = 0 s: gave inf, which is not finite")


def test_a_connector_that_nobody_drives_shows_a_number(folder, loop):
    wires = [connection("u -> m.held", linear(0, 1)), connection("v -> m.smooth", linear(0, 1))]
    wires += [connection("v -> g.u", linear(2)), connection("w -> h.u", linear(1e-309))]
    parts = [HELD, component("g", "CosimGain.fmu", "u>"), component("h", "CosimGain.fmu", "u>")]
    with load(write(folder, system(parts, wires, "u> v> w>"))) as loaded:
        result = simulate(loaded, step_size=0.5, runtime=Runtime(loop=loop))
    assert [result[name].tolist() for name in ("u", "v", "w")] == [[0.0] * 3, [0.25] * 3, [0.0] * 3]
    assert result["m.held"].tolist() == [0.25] * 3
    assert (result["m.smooth"][-1], result["g.u"][-1], result["h.u"][-1]) == (1.0, 0.5, 0.5)


@pytest.mark.parametrize(
    ("ports", "wires", "message"),
    [
        ("[big] [small]", [""], "a.y [big] → b.u [small]: "),
        ("[small] [big]", [""], "a.y [small] → b.u [big]: "),
        (" ", [linear(1e200), linear(1e200)], "a.y → c: "),
        (" ", [linear(1e-200), linear(1e-200)], "a.y → c: "),
        (" ", [linear(2, 1e308), linear(2)], "a.y → c: "),
    ],
)
def test_conversions_beyond_float64_are_refused(folder, ports, wires, message):
    before, after = ports.split(" ")
    typed = ":Real" if before else ""
    parts = [component("a", "CosimGain.fmu", f"u> y<{typed}{before}")]
    if len(wires) == 1:
        parts.append(component("b", "CosimGain.fmu", f"u>{typed}{after} y<"))
        body = system(parts, [connection("a.y -> b.u", wires[0])])
    else:
        inner = system(parts, [connection("a.y -> y", wires[0])], "y<", name="in")
        body, message = system([inner], [connection("in.y -> c", wires[1])], "c<"), f"in.{message}"
    path = write(
        folder,
        body,
        tail=units("big m=1 factor=1e300;small m=1 factor=1e-300") + '<ssd:DefaultExperiment stopTime="1"/>',
    )
    told = check(path)
    assert [line.rpartition(" (")[0] for line in told] == [f"{message}the conversion is beyond the range of float64"]
