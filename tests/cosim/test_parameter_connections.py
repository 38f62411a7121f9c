"""What a connection gives a parameter, against parameter bindings of the same one: the connection wins, and says so."""

import pytest
from ssp_writer import a_and_b, bind, component, connection, line_of, linear, system, write

from twip.cosim import Runtime, Table, check, load, simulate

GAIN = "CosimGain.fmu"


def started(path, **loading):
    """Return what the system starts with, by `component.variable`, and its warnings."""
    with load(path, **loading) as loaded:
        values = {f"{c.name}.{s.variable.name}": s.value for c in loaded.components for s in c.start_values}
        return values, list(loaded.warnings)


def together(*lists):
    """Put the bindings of several lists into one."""
    name = "ssd:ParameterBindings"
    inside = "".join(text.removeprefix(f"<{name}>").removesuffix(f"</{name}>") for text in lists)
    return f"<{name}>{inside}</{name}>"


def p(value):
    return bind({"p": ("Real", value)})


@pytest.mark.parametrize(
    ("of_component", "of_system"),
    [
        (bind({"k": ("Real", 5)}), p(3)),
        ("", together(bind({"a.k": ("Real", 5)}), p(3))),
        ("", together(p(3), bind({"a.k": ("Real", 5)}))),
        (bind({"k": ("Real", 4)}), together(p(9), bind({"a.k": ("Real", 5)}), p(3))),
    ],
    ids=["of the component", "before", "after", "everywhere"],
)
def test_a_connection_wins_wherever_the_binding_stands(folder, of_component, of_system, loop):
    a = component("a", GAIN, "u> k* y<", of_component)
    path = write(folder, system([a], [connection("p -> a.k", linear(2))], "p*:Real", of_system))
    five = 'Real value="5"'
    place = f"component a, SystemStructure.ssd line {line_of(path, five)}"
    values, warnings = started(path)
    assert values["a.k"] == 6.0
    assert warnings == [f"a.k = 5 is overridden by the connection p → a.k ({place})"]
    with load(path, start_values={"a.u": 1.0}) as loaded:
        table = Table(loaded.channels)
        simulate(loaded, sinks=[table], step_size=0.5, runtime=Runtime(loop=loop))
    assert table["a.y"].tolist() == [6.0] * 3


def test_the_binding_of_the_system_around_does_not_win_over_a_connection_inside(folder):
    inner = system(
        [component("a", GAIN, "k*")], [connection("q -> a.k")], "q*:Real", bind({"q": ("Real", 3)}), name="in"
    )
    values, warnings = started(write(folder, system([inner], inside=bind({"in.a.k": ("Real", 5)}))))
    assert values == {"in.a.k": 3.0}
    assert [w.split(" (")[0] for w in warnings] == ["in.a.k = 5 is overridden by the connection in.q → in.a.k"]


def test_of_parameters_on_one_way_the_outermost_with_a_value_wins(folder):
    inner = system([component("a", GAIN, "k*")], [connection("q -> a.k")], "q*:Real", name="in")
    wires = [connection("p -> in.q", linear(2))]
    outer_last = system([inner], wires, "p*:Real", together(p(3), bind({"in.q": ("Real", 5)})))
    values, warnings = started(write(folder, outer_last))
    assert values == {"in.a.k": 6.0}
    assert [w.split(" (")[0] for w in warnings] == ["in.q = 5 is overridden by the connection p → in.q"]
    unset = system([inner], wires, "p*:Real", bind({"in.q": ("Real", 5)}))
    assert started(write(folder, unset)) == ({"in.a.k": 5.0}, [])


def test_an_input_that_a_parameter_feeds_is_set_by_the_connection_too(folder):
    body = a_and_b(
        connection("p -> a.u"), ports="p*:Real", inside=together(p(3), bind({"a.u": ("Real", 5), "b.u": ("Real", 7)}))
    )
    values, warnings = started(write(folder, body))
    assert values == {"a.u": 3.0, "b.u": 7.0}
    assert [w.split(" (")[0] for w in warnings] == ["a.u = 5 is overridden by the connection p → a.u"]


def test_a_parameter_without_value_leaves_the_binding_as_it_is(folder):
    body = a_and_b(connection("p -> a.k"), ports="p*:Real", inside=bind({"a.k": ("Real", 5)}))
    assert started(write(folder, body)) == ({"a.k": 5.0}, [])


def test_the_caller_still_wins_over_the_connection(folder):
    body = a_and_b(connection("p -> a.k"), ports="p*:Real", inside=together(p(3), bind({"a.k": ("Real", 5)})))
    path = write(folder, body)
    assert started(path, start_values={"a.k": 7.0})[0] == {"a.k": 7.0}
    assert started(path, start_values={"p": 8.0})[0] == {"a.k": 8.0}
    with load(path) as loaded:
        assert loaded.with_start_values({"p": 9.0}).components[0].start_values[0].value == 9.0


def test_an_overridden_value_is_checked_all_the_same(folder):
    body = a_and_b(connection("p -> a.k"), ports="p*:Real", inside=together(bind({"p": ("Boolean", "true")}), p(3)))
    assert [line.split(" (")[0] for line in check(write(folder, body))] == [
        "p = 'true' must be a finite Real number, not Boolean"
    ]
