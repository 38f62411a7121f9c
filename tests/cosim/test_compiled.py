"""The compiled loop against the plain one: the same bits, messages and failures, on systems of every kind."""

import random

import numpy as np
import pytest
from flat_options import grouped
from ssp_writer import component, connection, edit_fmu, linear, system, write

from twip.cosim import Observer, Runtime, Table, load, simulate
from twip.errors import TwipError

COUPLINGS = ["jacobi", "gauss-seidel"]


def outcome(path, *, start_values=None, **options):
    """Return everything that a run leaves behind, as bytes and text."""
    with load(path, start_values=start_values or {}) as loaded:
        table = Table(loaded.channels)
        try:
            result = simulate(loaded, sinks=[table], **grouped(**options))
            told = (result.steps, result.time, result.values, result.warnings)
        except TwipError as failure:
            told = str(failure)
    return table.times.tobytes(), table.values.tobytes(), table.events, told


def both(path, **options):
    """Run in both ways, compare, and return the number of rows and what was told."""
    plain, compiled = (outcome(path, loop=loop, **options) for loop in ("python", "compiled"))
    assert compiled == plain
    return len(plain[0]) // 8, plain[3]


@pytest.mark.parametrize("coupling", COUPLINGS)
@pytest.mark.parametrize("driven", [False, True])
def test_reals_integers_and_booleans_of_a_nested_system_agree(folder, coupling, driven):
    """Fed by connections, by inputs of the system and by a file, across two chunks and a part of one."""
    mixed = "smooth> n>:Integer on>:Boolean held> total<:Integer inverted<:Boolean seen<"
    inner = system(
        [component("a", "CosimMixed.fmu", mixed), component("g", "CosimGain.fmu", "u> y<")],
        [
            connection("w -> a.smooth"),
            connection("a.seen -> g.u", linear(factor=-0.7, offset=0.1)),
            connection("g.y -> v"),
            connection("a.inverted -> off"),
        ],
        "w> v< off<:Boolean",
        name="inner",
    )
    body = system(
        [inner, component("b", "CosimMixed.fmu", mixed), component("i", "CosimIntegrator.fmu", "u> x<")],
        [
            connection("w -> inner.w"),
            connection("inner.v -> b.smooth"),
            connection("inner.v -> b.held"),
            connection("inner.off -> b.on"),
            connection("b.seen -> i.u"),
            connection("i.x -> out"),
        ],
        "w>:Real out<",
    )
    (folder / "in.csv").write_text(
        "time,w,inner.a.held,inner.a.n,inner.a.on\n0,0.1,-0.5,7,0\n0.3,0.7,2,-3,1\n1,0,3,3,0\n"
    )
    inputs = folder / "in.csv" if driven else None
    rows, told = both(write(folder, body), step_size=1 / 450, coupling=coupling, input_file=inputs)
    assert rows == 451
    assert told[0] == 450


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("coupling", COUPLINGS)
def test_random_wirings_agree(fmus, tmp_path, seed, coupling):
    """Gains and integrators, any output to any input, some at mid-step, some with their own step; loops included."""
    random_ = random.Random(seed)
    gain = edit_fmu(fmus / "CosimGain.fmu", tmp_path / "gain.fmu", dependencies={"y": ["u"], "z": ["u"]}).name
    integrator = edit_fmu(fmus / "CosimIntegrator.fmu", tmp_path / "integrator.fmu", dependencies={"x": []}).name
    kinds = {f"c{i}": random_.choice([gain, integrator]) for i in range(random_.randint(2, 7))}
    parts = [component(name, fmu, "u> y< z<" if fmu == gain else "u> x<") for name, fmu in kinds.items()]
    outputs = [f"{n}.{o}" for n, fmu in kinds.items() for o in ("yz" if fmu == gain else "x")]
    fed = random_.sample(sorted(kinds), random_.randint(1, len(kinds)))
    wires = [
        connection(f"{random_.choice(outputs)} -> {name}.u", linear(random_.uniform(-0.4, 0.4), random_.gauss(0, 1)))
        for name in fed
    ]
    starts = {f"{n}.x_start": random_.gauss(0, 1) for n, fmu in kinds.items() if fmu == integrator}
    both(
        write(tmp_path, system(parts, wires)),
        step_size=0.01,
        coupling=coupling,
        mid_step=[f"{name}.u" for name in fed if random_.random() < 0.5],
        own_steps={name: random_.choice([0.01, 0.02, 0.05, 0.1]) for name in kinds if random_.random() < 0.5},
        start_values=starts,
    )


@pytest.mark.parametrize("coupling", COUPLINGS)
@pytest.mark.parametrize("fault", ["raise", "discard", "nan", "chatter"])
def test_failures_and_messages_agree_with_all_rows_before_them(folder, coupling, fault):
    parts = [component(name, "CosimFaulty.fmu", "u> y<") for name in ("good", "bad")]
    body = system([*parts, component("g", "CosimGain.fmu", "u>")], [connection("good.y -> g.u")])
    rows, told = both(
        write(folder, body),
        step_size=1 / 512,
        coupling=coupling,
        start_values={"bad.fault": fault, "bad.fault_time": 300 / 512},  # in the second chunk
    )
    assert rows == (513 if fault == "chatter" else 301)
    assert ("failed at t = 0.58" in told) is (fault != "chatter")


def test_an_input_that_overflows_agrees(folder):
    body = system([component("i", "CosimIntegrator.fmu", "u> x<")], [connection("i.x -> i.u", linear(factor=1e200))])
    _, told = both(write(folder, body), step_size=0.25, start_values={"i.x_start": 1e100})
    assert told == "i.x → i.u failed at t = 0.25 s: gave inf, which is not finite"


def test_a_system_without_any_connection_or_input_agrees(folder):
    rows, _ = both(write(folder, system([component("h", "CosimHidden.fmu", "y<")])), step_size=0.01)
    assert rows == 101


def test_the_compiled_loop_is_in_numbas_cache_after_its_first_run(folder):
    path = write(folder, system([component("i", "CosimIntegrator.fmu")]))
    told = []
    for _ in range(2):
        with load(path) as loaded:
            simulate(loaded, step_size=0.5, runtime=Runtime(loop="compiled"), observer=Observer(notice=told.append))
    assert len(told) <= 1  # the first run of all may have had to compile


def test_a_sink_may_keep_the_rows_it_gets(folder, loop):
    class Keeps:
        rows: tuple = ()

        def write(self, _times, rows):
            self.rows = (*self.rows, rows)

        def event(self, *_):
            pass

        def close(self):
            pass

    with load(write(folder, system([component("m", "CosimMixed.fmu")]))) as loaded:
        sink, table = Keeps(), Table(loaded.channels)
        simulate(loaded, step_size=1 / 450, sinks=[sink, table], runtime=Runtime(loop=loop))
    np.testing.assert_array_equal(np.concatenate(sink.rows), table.values)
