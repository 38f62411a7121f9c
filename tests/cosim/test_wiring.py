"""Known answers for conversions, transformations, nested systems, and start values."""

import math

import pytest
from flat_options import grouped
from ssp_writer import bind, component, connection, edit_fmu, linear, parameter_set, system, units, write

from twip.cosim import Runtime, Table, load, simulate

UNITS = f"rad rad=1; deg rad=1 factor={math.pi / 180!r}; K K=1; degC K=1 offset=273.15; m m=1"
GAIN = "CosimGain.fmu"


def run(path, loading=None, **options):
    with load(path, **(loading or {})) as loaded:
        table = Table(loaded.channels)
        result = simulate(loaded, sinks=[table], step_size=0.5, **grouped(**options))
    return table, result


def in_units(folder, name, output, input_):
    """Make a gain whose output and input are in the given units."""
    variables = {"y": {"unit": output}, "u": {"unit": input_}}
    dependencies = {"y": ["u"], "z": ["u"]}
    return edit_fmu(
        folder / GAIN, folder / name, variables=variables, dependencies=dependencies, definitions=UNITS
    ).name


@pytest.mark.parametrize(
    ("source", "target", "sent", "received"),
    [
        ("deg", "rad", 180.0, math.pi),
        ("rad", "deg", math.pi, 180.0),
        ("K", "degC", 300.0, 300.0 - 273.15),
        ("degC", "K", 10.0, 283.15),
        ("rad", "rad", 0.1, 0.1),
    ],
)
def test_units_of_the_model_descriptions_are_converted(folder, source, target, sent, received):
    a, b = in_units(folder, "a.fmu", source, source), in_units(folder, "b.fmu", target, target)
    body = system([component("a", a, "u> y<"), component("b", b, "u> y<")], [connection("a.y -> b.u")])
    table, _ = run(write(folder, body), {"start_values": {"a.u": sent, "a.k": 1.0}})
    # two roundings in the factor, two in the product and sum
    assert table["b.u"] == pytest.approx([received] * 3, rel=4 * 2**-52)


def test_an_identity_copies_the_sign_of_zero(folder, loop):
    body = system([component("a", GAIN, "u> z<"), component("b", GAIN, "u>")], [connection("a.z -> b.u")])
    table, _ = run(write(folder, body), {"start_values": {"a.u": 0.0}}, loop=loop)
    assert math.copysign(1.0, table["a.z"][-1]) == math.copysign(1.0, table["b.u"][-1]) == -1.0


def test_the_unit_of_a_connector_stands_for_the_variable_without_one(folder):
    body = system(
        [component("a", GAIN, "u> y<:Real[deg]"), component("b", GAIN, "u>:Real[rad]")], [connection("a.y -> b.u")]
    )
    table, _ = run(
        write(folder, body, tail=units(UNITS) + '<ssd:DefaultExperiment stopTime="1"/>'),
        {"start_values": {"a.u": 90.0}},
    )
    # a.y = 180 deg in a variable without unit
    assert table["b.u"][-1] == pytest.approx(math.pi, rel=4 * 2**-52)


def test_a_linear_transformation_acts_on_the_value_in_the_unit_of_the_target(folder):
    a, b = in_units(folder, "a.fmu", "deg", "deg"), in_units(folder, "b.fmu", "rad", "rad")
    wire = connection("a.y -> b.u", linear(factor=3, offset=0.5))
    body = system([component("a", a, "u> y<"), component("b", b, "u>")], [wire])
    table, _ = run(write(folder, body), {"start_values": {"a.u": 90.0, "a.k": 1.0}})
    assert table["b.u"][-1] == pytest.approx(3 * math.pi / 2 + 0.5, rel=4 * 2**-52)


def test_suppressed_unit_conversion_leaves_only_the_transformation(folder):
    a, b = in_units(folder, "a.fmu", "deg", "deg"), in_units(folder, "b.fmu", "m", "m")
    wire = connection("a.y -> b.u", linear(factor=3), suppressUnitConversion="true")
    body = system([component("a", a, "u> y<"), component("b", b, "u>")], [wire])
    table, _ = run(write(folder, body), {"start_values": {"a.u": 90.0, "a.k": 1.0}})
    assert table["b.u"][-1] == 270.0


def test_a_connection_may_be_written_from_its_end(folder):
    body = system(
        [component("a", GAIN, "u> y<"), component("b", GAIN, "u>")], [connection("b.u -> a.y", linear(factor=5))]
    )
    table, _ = run(write(folder, body))
    assert table["b.u"][-1] == 5 * 2 * 0.5


def nested(folder, **options):
    inner = system(
        [component("g", GAIN, "u> k* y<"), component("h", GAIN, "u> y<")],
        [
            connection("v -> g.u", linear(factor=10)),
            connection("g.y -> h.u"),
            connection("h.y -> w"),
            connection("c -> g.k"),
        ],
        "v>:Real w<:Real c*:Real",
        name="inner",
    )
    body = system(
        [inner, component("out", GAIN, "u> y<")],
        [
            connection("x -> inner.v"),
            connection("inner.w -> out.u"),
            connection("out.y -> y"),
            connection("p -> inner.c"),
        ],
        "x>:Real y<:Real p*:Real",
        **options,
    )
    return write(folder, body)


@pytest.mark.parametrize("coupling", ["jacobi", "gauss-seidel"])
def test_nested_systems_are_flattened_and_their_connectors_recorded(folder, coupling, loop):
    (folder / "in.csv").write_text("time,x\n0,1\n1,1\n")
    table, _ = run(nested(folder), coupling=coupling, input_file=folder / "in.csv", loop=loop)
    assert [name for name in table.columns if "g" not in name.split(".") and "h" not in name.split(".")] == [
        "out.u", "out.y", "out.z", "x", "y", "inner.v", "inner.w",
    ]  # fmt: skip
    # g: 10 x * 2, h and out double; constant from row 0 on since the initialization propagates everything
    assert table["inner.g.u"].tolist() == [10.0] * 3
    assert table["inner.w"].tolist() == [40.0] * 3
    assert table["y"].tolist() == [80.0] * 3
    assert table["x"].tolist() == table["inner.v"].tolist() == [1.0] * 3


def test_an_open_system_input_leaves_the_start_value_behind_it(folder, loop):
    table, _ = run(nested(folder), loop=loop)
    assert table["inner.g.u"].tolist() == [0.5] * 3
    # what the connector would have to be for that value
    assert table["x"].tolist() == [0.05] * 3


def test_values_for_system_connectors_reach_the_variables_behind_them(folder):
    table, _ = run(nested(folder), {"start_values": {"x": 2, "p": "7"}})
    assert table["x"].tolist() == [2.0] * 3
    assert table["inner.g.u"].tolist() == [20.0] * 3
    assert table["inner.g.y"].tolist() == [140.0] * 3


def test_a_higher_level_wins_over_a_lower_one_and_a_later_binding_over_an_earlier(folder):
    def build(*levels):
        own = bind({"k": ("Real", 3)}) if "component" in levels else ""
        top = bind({"g.k": ("Real", 4)}) if "system" in levels else ""
        return write(folder, system([component("g", GAIN, "u> y<", own)], inside=top))

    (folder / "high.ssv").write_text(parameter_set({"g.k": ("Real", 5)}))
    (folder / "higher.ssv").write_text(parameter_set({"g.k": ("Real", 6)}))
    files = [folder / "high.ssv", folder / "higher.ssv"]
    assert run(build("component"))[0]["g.y"][0] == 1.5
    assert run(build("component", "system"))[0]["g.y"][0] == 2.0
    assert run(build("component", "system"), {"parameters": files})[0]["g.y"][0] == 3.0
    assert run(build("component", "system"), {"parameters": files[::-1]})[0]["g.y"][0] == 2.5
    assert run(build("component", "system"), {"parameters": files, "start_values": {"g.k": "7e0"}})[0]["g.y"][0] == 3.5


def test_a_parameter_file_with_prefix_and_unit(folder):
    fmu = edit_fmu(folder / GAIN, folder / "turn.fmu", variables={"k": {"unit": "rad"}}, definitions=UNITS).name
    (folder / "turn.ssv").write_text(parameter_set({"k": ("Real", 180, "deg")}, units(UNITS, "ssv")))
    path = write(folder, system([component("g", fmu, "u> y<")], inside=bind(source="turn.ssv", prefix="g.")))
    assert run(path, {"start_values": {"g.u": 1}})[0]["g.y"][0] == pytest.approx(math.pi, rel=4 * 2**-52)


def test_every_type_takes_a_start_value_before_the_first_step(folder, loop):
    path = write(folder, system([component("m", "CosimMixed.fmu")]))
    values = {"m.n": "5", "m.on": True, "m.held": "1e-3", "m.label": "a b"}
    table, _ = run(path, {"start_values": values}, loop=loop)
    assert table["m.n"].tolist() == [5.0] * 3
    assert table["m.on"].tolist() == [1.0] * 3
    assert table["m.total"].tolist() == [0.0, 5.0, 10.0]
    assert table["m.inverted"].tolist() == [1.0, 0.0, 0.0]
    assert table["m.seen"].tolist() == [0.0, 1e-3, 1e-3]


def test_an_unconnected_input_keeps_its_start_value_and_is_never_set(folder, loop):
    path = write(folder, system([component("m", "CosimMixed.fmu")]))
    table, _ = run(path, loop=loop)
    assert table["m.n"].tolist() == [3.0] * 3
    assert table["m.held"].tolist() == [0.25] * 3
    assert table["m.sets"].tolist() == [0.0] * 3


def test_only_changed_inputs_are_set(folder, loop):
    (folder / "in.csv").write_text("time,m.smooth,m.held\n0,1,0.5\n0.5,1,0.5\n1,1,0.5\n")
    table, _ = run(write(folder, system([component("m", "CosimMixed.fmu")])), input_file=folder / "in.csv", loop=loop)
    # smooth starts at 1; held changes once, at the start
    assert table["m.sets"].tolist() == [1.0] * 3


def test_integers_and_booleans_are_connected_exactly(folder, loop):
    parts = [component(name, "CosimMixed.fmu", "n>:Integer on> total< inverted<:Boolean") for name in "ab"]
    table, _ = run(
        write(folder, system(parts, [connection("a.total -> b.n"), connection("a.inverted -> b.on")])),
        coupling="gauss-seidel",
        loop=loop,
    )
    assert table["b.n"].tolist() == table["a.total"].tolist() == [0.0, 3.0, 6.0]
    assert table["b.inverted"].tolist() == [1.0, 0.0, 0.0]


def test_two_instances_of_one_fmu_and_a_swapped_one(folder):
    path = write(
        folder, system([component("a", GAIN, "u> y<"), component("b", GAIN, "u> y<")], [connection("a.y -> b.u")])
    )
    with load(path) as loaded:
        assert loaded.components[0].fmu is loaded.components[1].fmu
    other = edit_fmu(folder / GAIN, folder / "other.fmu", variables={"k": {"start": 2.0}})
    with load(path, swap={"b": other}) as loaded:
        assert loaded.components[1].fmu.path == other
        assert simulate(loaded, step_size=0.5).values["b.y"] == 2.0


def test_a_system_runs_again_with_the_same_result(folder, loop):
    with load(nested(folder), start_values={"x": 3}) as loaded:
        first, second = (simulate(loaded, step_size=0.25, runtime=Runtime(loop=loop)) for _ in range(2))
    assert first.values == second.values
    assert first.steps == second.steps == 4


def test_provenance_names_files_values_and_fingerprints(folder):
    (folder / "set.ssv").write_text(parameter_set({"g.k": ("Real", 5)}))
    path = write(folder, system([component("g", GAIN, "u> y<")]))
    with load(path, parameters=[folder / "set.ssv"], start_values={"g.u": 1}) as loaded:
        told = loaded.provenance()
    assert told["system"]["file"] == "SystemStructure.ssd"
    assert len(told["component g"]["sha256"]) == len(told["parameters set.ssv"]["sha256"]) == 64
    assert told["component g"]["fmi_version"] == "2.0"
    assert told["start values"] == {"g.u": "1"}
    assert told["start values g"] == {"k": "5.0", "u": "1.0"}
