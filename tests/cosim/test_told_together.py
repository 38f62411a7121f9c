"""Whatever is wrong is told in one go: one unreadable FMU, file or option does not hide the mistakes beside it."""

import pytest
from ssp_writer import GAIN, algorithm, bind, component, connection, line_of, parameter_set, system, write

from twip.cli import main
from twip.cosim import Algorithm, Inputs, check, load, simulate
from twip.errors import TwipError

RULE = "must be a finite Real number"


@pytest.fixture
def broken(folder):
    """A system whose component `bad` has an unreadable FMU."""
    (folder / "bad.fmu").write_bytes(b"no archive")

    def make(inside="", wires=(), ports="", good="", bad=""):
        parts = [component("bad", "bad.fmu", "u> k* y<", bad), component("good", GAIN, "u> k* y<", good)]
        return write(folder, system(parts, wires, ports, inside))

    return make


def rest(lines):
    """Return the lines that are not about the FMU, without their places."""
    assert any(line.startswith("FMU bad.fmu is not a readable zip archive") for line in lines)
    return [line.partition(" (")[0] for line in lines if not line.startswith("FMU bad.fmu is not")]


def test_bindings_of_readable_components_are_checked_beside_an_unreadable_fmu(broken):
    path = broken(
        bind({"good.k": ("Boolean", "true"), "bad.k": ("Boolean", "true")}), good=bind({"u": ("String", "a")})
    )
    assert rest(check(path)) == [f"u = 'a' {RULE}, not String", f"k = 'true' {RULE}, not Boolean"]


def test_files_and_start_values_are_checked_beside_an_unreadable_fmu(broken, folder):
    (folder / "p.ssv").write_text(parameter_set({"good.k": ("Boolean", "true"), "good.x": ("Real", 1)}))
    lines = check(broken(), parameters=[folder / "p.ssv"], start_values={"good.u": "b", "bad.k": 3.0})
    assert rest(lines) == [
        f"k = 'true' {RULE}, not Boolean",
        "unknown parameter good.x, did you mean good.z?",
        f"u = 'b' {RULE}",
        "values of bad.k were not checked: the FMU cannot be read",
    ]


def test_the_binding_of_an_unreadable_fmu_is_read(broken, folder):
    path = broken(bad=bind(source="p.ssv"))
    (folder / "p.ssv").write_text(parameter_set({"k": ("Real", "a lot")}))
    assert any("'a lot' is not a valid value" in line and "p.ssv line" in line for line in check(path))


@pytest.mark.parametrize("typed", ["", ":Real"])
def test_nothing_is_said_of_what_only_the_unreadable_fmu_would_tell(broken, typed):
    wires = [
        connection("bad.y -> y"),
        connection("k -> bad.k"),
        connection("u -> bad.u"),
        connection("bad.y -> good.u"),
    ]
    path = broken(wires=wires, ports=f"u>{typed} k*{typed} y<{typed}")
    value = 1.0 if typed else "anything"
    assert rest(check(path, start_values={"u": value, "k": value, "y": value})) == []


def test_what_leads_on_from_an_unreadable_fmu_is_not_called_unfed(broken, folder):
    inner = system([component("bad", "bad.fmu", "y<")], [connection("bad.y -> y")], "y<", name="inner")
    broken()
    path = write(folder, system([inner, component("good", GAIN, "u>")], [connection("inner.y -> good.u")]))
    assert rest(check(path)) == []


def test_a_description_that_cannot_be_read_does_not_hide_the_files_beside_it(folder):
    (folder / "bad.ssd").write_text("<nothing")
    (folder / "p.ssv").write_text("<nothing")
    lines = check(
        folder / "bad.ssd", parameters=[folder / "p.ssv", folder / "none.ssv"], swap_map={"a": folder / "n.toml"}
    )
    assert [next(n for n in ("bad.ssd", "p.ssv", "none.ssv", "n.toml") if n in line) for line in lines] == [
        "n.toml", "bad.ssd", "p.ssv", "none.ssv",
    ]  # fmt: skip


def test_an_invalid_description_does_not_hide_what_is_wrong_in_its_files(folder):
    (folder / "bad.fmu").write_bytes(b"no archive")
    (folder / "p.ssv").write_text(parameter_set({"k": ("Real", "a lot")}))
    (folder / "m.ssm").write_text("<nothing")
    parts = [
        component("bad", "bad.fmu"),
        component("good", GAIN, "u>", bind(source="p.ssv", mapped="m.ssm")),
        system([component("deep", "none.fmu", "u>")], name="inner"),
    ]
    path = write(folder, system(parts, ['<ssd:Connection startElement="good"/>']))
    lines = check(path)
    names = ("startConnector", "bad.fmu", "none.fmu", "p.ssv", "m.ssm")
    assert [name for line in lines for name in names if name in line] == list(names)
    assert not any("none.fmu" in line for line in check(path, swap={"inner.deep": folder / GAIN}))


def test_the_proposed_coupling_is_checked_beside_wrong_values(folder):
    path = write(
        folder,
        system([component("a", GAIN, "u> y<", bind({"k": ("Boolean", "true")}))], [connection("a.y -> a.u")]),
        tail=algorithm('stepSize="0.1"', ["a.v"]),
    )
    assert check(path) == [
        f"k = 'true' {RULE}, not Boolean (component a, SystemStructure.ssd line {line_of(path, 'Boolean')})",
        f"there is no input a.v, did you mean a.u? (SystemStructure.ssd line {line_of(path, 'a.v')})",
    ]


def test_times_are_told_with_coupling_and_scenario(folder):
    path = write(folder, system([component("a", GAIN, "u> y<")]))
    (folder / "s.toml").write_text(
        '[inputs]\n"a.v" = [[0, 1]]\n[[parameters]]\ntime = 0.1\nname = "a.l"\nvalue = 1\n'
        '[[faults]]\nsignal = "a.y"\nkind = "delay"\ndelay = 0.15\n'
    )
    (folder / "u.csv").write_text("time,a.u\n0,x\n")
    with load(path) as model, pytest.raises(TwipError) as raised:
        simulate(
            model,
            start_time=1.0,
            stop_time=float("nan"),
            step_size=-1.0,
            algorithm=Algorithm(mid_step=["a.w"]),
            inputs=Inputs(scenario=folder / "s.toml", file=folder / "u.csv"),
        )
    assert [line.partition(" (")[0] for line in str(raised.value).splitlines()] == [
        "stop time nan s must be later than start time 1.0 s",
        "step size -1.0 s must be a positive number",
        "there is no input a.w, did you mean a.u?",
        "a.u = 'x' must be a finite number",
        "there is no input a.v, did you mean a.u?",
        "parameters[0]: unknown parameter a.l",
        "faults[0]: a.y is not connected",
    ]


def test_missing_times_are_told_together(folder):
    path = write(folder, system([component("a", GAIN)]), tail="")
    with load(path) as model, pytest.raises(TwipError) as raised:
        simulate(model)
    assert str(raised.value).splitlines() == [
        "stop time is not given, and SystemStructure.ssd has no DefaultExperiment with one",
        "step size is not given, and neither SystemStructure.ssd nor any FMU proposes one",
    ]


@pytest.mark.parametrize("command", ["run", "check"])
def test_times_are_told_with_what_is_wrong_in_the_system(folder, capsys, command):
    path = write(folder, system([component("a", "none.fmu")]))
    assert main([command, str(path), "--step-size", "0", "--start-time", "2", "--stop-time", "1"]) == 1
    told = capsys.readouterr().err
    for text in ("none.fmu does not exist", "stop time 1.0 s must be later", "step size 0.0 s must be a positive"):
        assert text in told


@pytest.mark.parametrize("command", ["run", "check"])
def test_times_are_told_with_the_rest_of_the_options(folder, capsys, command):
    path = write(folder, system([component("a", GAIN, "u> y<")]))
    (folder / "u.csv").write_text("time,a.u\n0,x\n")
    words = [command, str(path), "--step-size", "0.3", "--mid-step", "a.w", "--input-file", str(folder / "u.csv")]
    assert main([*words, "--no-log"] if command == "run" else words) == 1
    assert [line.removeprefix("twip: ") for line in capsys.readouterr().err.splitlines() if line] == [
        "step size 0.3 s does not divide the interval from 0.0 s to 1.0 s (3.33333333 steps)",
        "there is no input a.w, did you mean a.u?",
        "a.u = 'x' must be a finite number (u.csv line 2)",
    ]
