"""Components with a step of their own, and an order by hand: recurrences, measured orders, what is refused."""

import numpy as np
import pytest
from flat_options import grouped
from ssp_writer import algorithm, component, connection, edit_fmu, linear, system, write

from twip.cosim import Algorithm, Table, check, load, simulate
from twip.errors import TwipError

ALL = ["a.u", "b.u"]


@pytest.fixture
def pair(fmus, tmp_path):
    """a' = b, b' = -a: with a(0) = 0, b(0) = 1 that is sine and cosine."""
    depends, state = {"x": []}, True
    fmu = edit_fmu(fmus / "CosimIntegrator.fmu", tmp_path / "i.fmu", dependencies=depends, state=state).name
    parts = [component(name, fmu, "u> x<") for name in "ab"]
    return write(tmp_path, system(parts, [connection("a.x -> b.u", linear(factor=-1)), connection("b.x -> a.u")]))


def run(path, **options):
    with load(path, start_values={"b.x_start": 1.0}) as loaded:
        table = Table(loaded.channels)
        simulate(loaded, sinks=[table], **grouped(**options))
    return table


@pytest.mark.parametrize("coupling", ["jacobi", "gauss-seidel"])
def test_a_component_steps_where_its_own_step_ends_and_holds_between(pair, loop, coupling):
    h, a, b = 0.01, 0.0, 1.0
    u = -a
    rows = [(a, b, u)]
    for n in range(1, 101):
        before, a = a, a + h * b
        if n % 4 == 0:  # jacobi: the value at the beginning of this communication step
            u = -before if coupling == "jacobi" else -a
            b = b + 4 * h * u
        rows.append((a, b, u))
    table = run(pair, step_size=h, coupling=coupling, own_steps={"b": 0.04}, loop=loop)
    np.testing.assert_array_equal(np.column_stack([table["a.x"], table["b.x"], table["b.u"]]), rows)


def test_a_slow_source_is_followed_and_a_fast_one_taken_back_at_mid_step(pair, loop):
    h, a, b = 0.01, 0.0, 1.0
    b_old, b_at, b_old_at = 1.0, 0, -1  # the last two values of b, and the steps at whose ends they hold
    a_old, a_old_at = 0.0, 0
    rows = [(a, b)]
    for n in range(1, 101):
        a = a + h * (b + (n - 0.5 - b_at) / (b_at - b_old_at) * (b - b_old))
        if n % 4 == 0:
            u = -a + (n - 2.0 - n) / (n - a_old_at) * (-a + a_old)
            a_old, a_old_at = a, n
            b_old, b_old_at, b_at = b, b_at, n
            b = b + 4 * h * u
        rows.append((a, b))
    table = run(pair, step_size=h, coupling="gauss-seidel", mid_step=ALL, own_steps={"b": 0.04}, loop=loop)
    np.testing.assert_array_equal(np.column_stack([table["a.x"], table["b.x"]]), rows)


@pytest.mark.parametrize("own", [{"a": 4}, {"b": 4}, {"a": 2, "b": 4}, {"a": 5, "b": 2}])
@pytest.mark.parametrize(
    ("coupling", "mid_step", "order", "bound"),
    [
        ("jacobi", (), 1.0, 3.0),
        ("gauss-seidel", (), 1.0, 3.0),
        ("jacobi", ALL, 2.0, 20.0),
        ("gauss-seidel", ALL, 2.0, 20.0),
    ],
)
def test_orders_with_own_steps(pair, coupling, mid_step, order, bound, own):
    errors = []
    for h in (1 / 40, 1 / 80, 1 / 160):
        steps = {name: multiple * h for name, multiple in own.items()}
        table = run(pair, step_size=h, coupling=coupling, mid_step=mid_step, own_steps=steps, loop="python")
        largest = 0.0
        for name, solution in (("a", np.sin), ("b", np.cos)):
            rows = slice(None, None, own.get(name, 1))  # a row between its own steps holds an older value
            wrong = np.abs(table[f"{name}.x"][rows] - solution(table.times[rows]))
            assert (wrong <= bound * h**order).all()
            largest = max(largest, wrong.max())
        errors.append(largest)
    # terms of the next order move the observed order by less than 0.15 at own steps up to 0.1
    np.testing.assert_allclose(np.log2(np.array(errors[:-1]) / errors[1:]), order, atol=0.15)


@pytest.mark.parametrize("stop", [0.24, 0.25, 0.26])  # at an end of both own steps, of one, of none
def test_a_checkpoint_between_own_steps_continues_bit_for_bit(pair, loop, stop):
    given = {"step_size": 0.01, "coupling": "gauss-seidel", "mid_step": ALL, "own_steps": {"b": 0.04}, "loop": loop}
    file = pair.with_name("x.checkpoint")
    whole = run(pair, **given)

    def progress(time):
        if time > stop + 1e-9:  # after the chunk that follows the first checkpoint
            raise KeyboardInterrupt

    with load(pair, start_values={"b.x_start": 1.0}) as loaded, pytest.raises(KeyboardInterrupt):
        simulate(loaded, **grouped(progress=progress, checkpoint=file, checkpoint_every=stop, **given))
    rest = run(pair, resume=file, **given)
    begin = round(rest.times[0] / 0.01)
    assert begin == round(stop / 0.01)
    assert rest.values.tobytes() == whole.values[begin:].tobytes()


def test_own_steps_that_cannot_be_are_refused_together(pair):
    with load(pair) as loaded:
        for own, problem in [
            ({"a": 0.025}, "own step 0.025 s of a is not a whole multiple of the step 0.01 s"),
            ({"b": 0.03}, "own step 0.03 s of b does not divide the interval from 0.0 s to 1.0 s (33.3333333 steps)"),
            ({"c": 0.02}, "own step: there is no component c"),
            ({"a": 0.0}, "own step 0.0 s of a must be a positive number"),
            ({"a": 0.001}, "own step 0.001 s of a is not a whole multiple of the step 0.01 s"),
        ]:
            with pytest.raises(TwipError) as failure:
                simulate(loaded, step_size=0.01, algorithm=Algorithm(own_steps=own))
            assert str(failure.value) == problem


def test_an_order_by_hand_wins(pair, loop):
    h, a, b = 0.01, 0.0, 1.0
    rows = [(a, b)]
    for _ in range(100):
        b = b + h * -a
        a = a + h * b
        rows.append((a, b))
    table = run(pair, step_size=h, coupling="gauss-seidel", order=["b", "a"], loop=loop)
    np.testing.assert_array_equal(np.column_stack([table["a.x"], table["b.x"]]), rows)
    assert not np.array_equal(run(pair, step_size=h, coupling="gauss-seidel")["b.x"], table["b.x"])


@pytest.mark.parametrize(
    ("order", "problems"),
    [
        (["b"], ["order: a missing; an order by hand names every component once"]),
        (["b", "a", "b"], ["order: component b is named 2 times"]),
        (
            ["c", "a"],
            ["order: there is no component c", "order: b missing; an order by hand names every component once"],
        ),
    ],
)
def test_an_order_that_is_none_is_refused(pair, order, problems):
    with load(pair) as loaded, pytest.raises(TwipError) as failure:
        simulate(loaded, step_size=0.1, algorithm=Algorithm(coupling="gauss-seidel", order=order))
    assert str(failure.value).splitlines() == problems


def test_an_order_needs_gauss_seidel(pair):
    with (
        load(pair) as loaded,
        pytest.raises(TwipError, match="under gauss-seidel only, not under jacobi"),
    ):
        simulate(loaded, step_size=0.1, algorithm=Algorithm(order=["a", "b"]))


def proposing(path, **proposal):
    text = path.read_text(encoding="utf-8")
    plain = '<ssd:DefaultExperiment startTime="0" stopTime="1"/>'
    said = f'<ssd:DefaultExperiment stopTime="1">{algorithm(**proposal)}</ssd:DefaultExperiment>'
    path.write_text(text.replace(plain, said), encoding="utf-8")
    return path


def test_a_file_proposes_order_and_own_steps_and_the_caller_wins(pair):
    given = {"step_size": 0.01, "coupling": "gauss-seidel"}
    both = run(pair, order=["b", "a"], own_steps={"a": 0.02}, **given)
    own = run(pair, own_steps={"a": 0.02}, **given)
    none = run(pair, **given)
    path = proposing(
        pair, attributes='coupling="gauss-seidel" stepSize="0.01"', order=["b", "a"], own_steps=[("a", 0.02)]
    )
    np.testing.assert_array_equal(run(path).values, both.values)
    np.testing.assert_array_equal(run(path, coupling="gauss-seidel").values, own.values)  # the order goes, steps stay
    np.testing.assert_array_equal(run(path, order=[]).values, own.values)
    np.testing.assert_array_equal(run(path, order=[], own_steps={}).values, none.values)


def test_what_a_file_proposes_wrongly_is_named_with_its_line(pair):
    path = proposing(pair, attributes='coupling="gauss-seidel"', order=["b", "d"], own_steps=[("c", 0.1), ("a", -1)])
    lines = path.read_text().splitlines()

    def at(text):
        return f"(SystemStructure.ssd line {next(i for i, line in enumerate(lines, 1) if text in line)})"

    next_b, next_d, step_c, step_a = (at(t) for t in ('Next component="b"', 'component="d"', 'size="0.1"', 'size="-1"'))
    assert check(path) == [
        f"order: there is no component d {next_d}",
        f"order: a missing; an order by hand names every component once {next_b}",
        f"own step: there is no component c {step_c}",
        f"own step -1.0 s of a must be a positive number {step_a}",
    ]


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ('kind = "bias"\nvalue = 1\nstart = 0.04\nstop = 0.06', "begins and ends between two steps of b, it would do"),
        (
            'kind = "delay"\ndelay = 0.02',
            "delay = 0.02 s must be a whole multiple of the step of b, 4 communication steps",
        ),
    ],
)
def test_faults_that_the_steps_of_a_component_leave_no_room_for_are_refused(pair, text, problem):
    (pair.parent / "s.toml").write_text(f'[[faults]]\nsignal = "b.u"\n{text}\n')
    given = {"step_size": 0.01, "own_steps": {"b": 0.04}, "scenario": pair.parent / "s.toml"}
    with pytest.raises(TwipError, match=rf"faults\[0\].*{problem}.*\(s.toml line 2\)"):
        run(pair, **given)
    (pair.parent / "s.toml").write_text(f'[[faults]]\nsignal = "a.u"\n{text}\n')
    run(pair, **given)


def test_a_fault_acts_in_the_steps_of_its_component(pair, loop):
    """b takes a.x at 0.04, 0.08, …; from 0.04 to 0.08 s lies its step that ends at 0.08 s."""
    (pair.parent / "s.toml").write_text(
        '[[faults]]\nsignal = "b.u"\nkind = "bias"\nvalue = 10\nstart = 0.04\nstop = 0.08\n'
    )
    given = {"step_size": 0.01, "stop_time": 0.2, "own_steps": {"b": 0.04}, "coupling": "gauss-seidel", "loop": loop}
    faulty = run(pair, scenario=pair.parent / "s.toml", **given)
    assert (faulty["b.u"] + faulty["a.x"] > 9.0).tolist() == [8 <= k < 12 for k in range(21)]
