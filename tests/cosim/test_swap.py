"""Another FMU in a component's place: what fits runs with the same answer, what does not is told in one go.

`a.x` is a ramp that `g` (y = 2 u) doubles and `b` integrates.
"""

import numpy as np
import pytest
from ssp_writer import bind, component, connection, edit_fmu, linear, system, write

from twip.cli import main
from twip.cosim import Algorithm, Runtime, check, load, simulate
from twip.errors import TwipError

STEP = 1 / 8
UNITS = "rad rad=1; deg rad=1 factor=0.5; m m=1"  # a "degree" whose factor is exact
DEPENDS = {"y": ["u"], "z": ["u"]}


def gain(folder, name, u=None, y=None, k=None, dependencies=DEPENDS, rename=None):
    """Write an FMU `y = 2 u` with attributes of its variables, and with other names for some."""
    given = {"u": u or {}, "y": y or {}, "k": k or {}}
    variables = {n: a for n, a in given.items() if a}
    path = edit_fmu(
        folder / "CosimGain.fmu", folder / name, variables=variables, dependencies=dependencies, definitions=UNITS
    )
    return path if rename is None else edit_fmu(path, folder / f"renamed_{name}", rename=rename)


@pytest.fixture
def path(folder):
    old = gain(folder, "old.fmu", {"unit": "rad"}, {"unit": "rad"}, {"unit": "rad"})
    parts = [
        component("a", "CosimIntegrator.fmu", "u> x<"),
        component("g", old.name, "u> y< z<", bind({"k": ("Real", 3.0)})),
        component("b", "CosimIntegrator.fmu", "u> x<"),
    ]
    return write(folder, system(parts, [connection("a.x -> g.u"), connection("g.y -> b.u", linear(factor=4))]))


def run(path, loop="python", **options):
    return simulate(
        load(path, start_values={"a.u": 1.0}, **options),
        step_size=STEP,
        algorithm=Algorithm(coupling="gauss-seidel"),
        runtime=Runtime(loop=loop),
    )


def problems(path, folder, new, text=None):
    if text is not None:
        (folder / "map.toml").write_text(text)
    maps = {} if text is None else {"g": folder / "map.toml"}
    return check(path, swap={"g": new}, swap_map=maps)


def test_units_are_converted_at_the_boundary(path, folder, loop):
    # the new FMU counts in half radians: it gets 2 u, gives 2 k u half radians, and its k = 3 rad is 6 half radians
    deg = {"unit": "deg"}
    new = gain(folder, "new.fmu", deg, deg, deg)
    before, after = run(path, loop), run(path, loop, swap={"g": new})
    assert after["g.u"].tolist() == (2.0 * before["g.u"]).tolist()
    assert after["g.y"].tolist() == (6.0 * after["g.u"]).tolist()
    assert after["b.u"].tolist() == (4.0 * 0.5 * after["g.y"]).tolist()


def test_names_come_from_a_map(path, folder, loop):
    new = gain(folder, "new.fmu", {"unit": "rad"}, {"unit": "rad"}, rename={"u": "angle", "y": "torque", "k": "slope"})
    (folder / "map.toml").write_text('[names]\nu = "angle"\ny = "torque"\nk = "slope"\n')
    before = run(path, loop)
    loaded = load(path, start_values={"a.u": 1.0}, swap={"g": new}, swap_map={"g": folder / "map.toml"})
    after = simulate(loaded, step_size=STEP, algorithm=Algorithm(coupling="gauss-seidel"), runtime=Runtime(loop=loop))
    assert after.to_numpy().tolist() == before.to_numpy().tolist()
    assert loaded.provenance()["swap g"] == {
        "fmu": str(new),
        "instead_of": "old.fmu",
        "instead_of_sha256": load(path).provenance()["component g"]["sha256"],
        "name u": "angle",
        "name y": "torque",
        "name k": "slope",
    }


def test_everything_that_does_not_fit_is_told_in_one_go(path, folder):
    new = gain(folder, "new.fmu", {"unit": "m"}, rename={"y": "torque"})
    told = problems(path, folder, new)
    assert [line.partition(" (System")[0] for line in told] == [
        f"swap g: u is in m in {new}, in rad in the system: units differ, which a.x feeds",
        f"swap g: {new} has no output y, which b.u takes",
    ]
    told = problems(path, folder, folder / "CosimMixed.fmu")
    assert len(told) == 2
    assert "has no input u" in told[0]
    assert "has no output y" in told[1]


def test_a_type_or_causality_that_differs_is_refused(path, folder):
    new = gain(folder, "new.fmu", {"unit": "rad"}, rename={"u": "y", "y": "u"})
    told = problems(path, folder, new)
    assert f"swap g: {new} has no input u (it is output there), which a.x feeds" in told[0]
    assert f"swap g: {new} has no output y (it is input there), which b.u takes" in told[1]
    (folder / "map.toml").write_text('[names]\nu = "n"\ny = "total"\n')
    told = check(path, swap={"g": folder / "CosimMixed.fmu"}, swap_map={"g": folder / "map.toml"})
    assert "u is Integer in" in told[0]
    assert ", not Real, which a.x feeds" in told[0]
    assert "y is Integer in" in told[1]


def test_what_may_differ_is_warned_of(path, folder):
    new = gain(folder, "new.fmu", {"min": -1, "max": 1}, rename={"k": "slope", "z": "w"})
    warned = load(path, swap={"g": new}).warnings
    assert warned == (
        f"swap g: u has no unit in {new}, it is taken to be in rad",
        f"swap g: u is at least -1 in {new}, not bounded before",
        f"swap g: u is at most 1 in {new}, not bounded before",
        f"swap g: y has no unit in {new}, it is taken to be in rad",
        f"swap g: {new} lacks what nothing is connected to: z",
        "unknown parameter k is ignored (component g, SystemStructure.ssd line 7)",
    )
    (folder / "map.toml").write_text('ignore = ["u"]\n[names]\ny = "seen"\n')
    warned = load(path, swap={"g": folder / "CosimMixed.fmu"}, swap_map={"g": folder / "map.toml"}).warnings
    (line,) = [line for line in warned if "nothing feeds" in line]
    assert line.endswith("they keep smooth = 1, n = 3, on = false, held = 0.25")


def test_an_ignored_input_loses_its_connection(path, folder):
    (folder / "map.toml").write_text('ignore = ["u"]\n[units]\ny = "deg"\n')
    new = gain(folder, "new.fmu", rename={"u": "v"})
    result = run(path, swap={"g": new}, swap_map={"g": folder / "map.toml"})
    # v keeps its start value 0.5, k = 3 rad is in no unit here; y is in half radians
    assert result["g.v"].tolist() == [0.5] * 9
    assert result["b.u"][1:].tolist() == [4.0 * 0.5 * 3.0 * 0.5] * 8


def test_a_map_that_does_not_fit_is_refused(path, folder):
    new = gain(folder, "new.fmu", {"unit": "rad"})
    text = 'ignore = ["y", "w"]\n[names]\nk = "q"\nkk = "z"\n[units]\ny = "furlong"\nq = "m"\n'
    told = [line.removeprefix("swap g: ").partition(" (Sys")[0] for line in problems(path, folder, new, text)]
    assert told == [
        "y is an output and cannot be ignored",
        "the system has no g.w, which the map ignores",
        f"{new} has no variable q, which the map names",
        "the system has no g.kk (there is k), which the map names",
        "unit furlong of y in the map is not defined",
    ]
    (line,) = problems(path, folder, new, '[names]\nu = "y"\n')[:1]
    assert "u is the name of another variable" in line
    assert problems(path, folder, new, "names = 3\nother = 1\nallow_loop = 1\n") == [
        "unknown key other: there are allow_loop, ignore, names, units (map.toml line 2)",
        "names must be a table, headed [names] (map.toml line 1)",
        "allow_loop = 1 must be true or false (map.toml line 3)",
    ]
    assert check(path, swap_map={"g": folder / "map.toml"})[-1] == "there is a map for g, which is not swapped"


def test_feedthrough_that_closes_a_loop_is_refused_unless_accepted(folder):
    old = gain(folder, "old.fmu", dependencies={"y": []})
    parts = [component("a", "CosimGain.fmu", "u> y<"), component("g", old.name, "u> y<")]
    path = write(folder, system(parts, [connection("a.y -> g.u", linear(factor=0.125)), connection("g.y -> a.u")]))
    new = gain(folder, "new.fmu")
    assert check(path) == []
    (line,) = check(path, swap={"g": new})
    assert line == ("swap g: feed-through closes an algebraic loop: a.y, g.y (allow_loop = true in its map accepts it)")
    (folder / "map.toml").write_text("allow_loop = true\n")
    assert check(path, swap={"g": new}, swap_map={"g": folder / "map.toml"}) == []
    assert check(path, swap={"g": old}) == []


def test_a_loop_that_was_there_is_no_reason_to_refuse(folder):
    old = gain(folder, "old.fmu")
    parts = [component("a", "CosimGain.fmu", "u> y<"), component("g", old.name, "u> y<")]
    path = write(folder, system(parts, [connection("a.y -> g.u", linear(factor=0.125)), connection("g.y -> a.u")]))
    assert check(path, swap={"g": gain(folder, "new.fmu")}) == []


def test_without_the_old_fmu_the_connectors_are_the_contract(path, folder):
    new = gain(folder, "new.fmu", {"unit": "rad"})
    (folder / "old.fmu").unlink()
    warned = load(path, swap={"g": new}).warnings
    assert warned[0] == "swap g: old.fmu cannot be read, only what the connectors say is checked"


def test_the_command_line_takes_swaps(path, folder, capsys):
    new = gain(folder, "new.fmu", {"unit": "rad"}, rename={"u": "v"})
    (folder / "map.toml").write_text('[names]\nu = "v"\n')
    words = [str(path), "--step-size", "0.125", "--swap", f"g={new}"]
    assert main(["check", *words]) == 1
    assert "has no input u, which a.x feeds" in capsys.readouterr().err
    assert main(["check", *words, "--swap-map", f"g={folder / 'map.toml'}"]) == 0
    assert f"g                 {new}, FMI 2.0" in capsys.readouterr().out
    assert main(["check", *words, "--swap", "g"]) == 1
    assert "--swap g: a component and a file are needed" in capsys.readouterr().err
    with pytest.raises(TwipError, match="there is no component h to swap"):
        load(path, swap={"h": new})
    assert np.array_equal(run(path)["a.x"], STEP * np.arange(9))


def test_what_is_wrong_with_a_swap_is_told_of_the_swap(folder):
    ssd = write(folder, system([component("gain", "CosimGain.fmu")]))
    for swap, told in (
        ({"gain": "nosuch.fmu"}, "FMU nosuch.fmu does not exist (swap gain)"),
        ({"gian": "CosimGain.fmu"}, "there is no component gian to swap, did you mean gain?"),
    ):
        with pytest.raises(TwipError) as refused, load(ssd, swap=swap):
            pass
        assert str(refused.value) == told
