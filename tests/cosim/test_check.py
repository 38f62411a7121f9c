"""`twip check`: what it says of systems, FMUs and parameter sets, and its exit status."""

import shutil

import pytest
from ssp_writer import (
    bind,
    component,
    connection,
    dictionary,
    edit_fmu,
    line_of,
    linear,
    mapping,
    parameter_mapping,
    parameter_set,
    system,
    units,
    write,
)

from twip.cli import main


@pytest.fixture
def path(folder):
    gain = edit_fmu(
        folder / "CosimGain.fmu",
        folder / "g.fmu",
        dependencies={"y": ["u"], "z": ["u"]},
        variables={"u": {"unit": "rad"}, "k": {"min": -9, "max": 9}},
        definitions="rad rad=1",
    ).name
    parts = [
        component("b", gain, "u> y<"),
        component("a", gain, "u> y<", bind({"u": ("Real", 1.5)})),
        component("c", gain, "u> y<"),
        component("d", gain, "u> y<"),
    ]
    wires = [
        connection("a.y -> b.u"),
        connection("drive -> c.u"),
        connection("d.y -> d.u", linear(factor=0.25)),
    ]
    return write(folder, system(parts, wires, "drive>"))


def check(capsys, *words):
    status = main(["check", *map(str, words)])
    said = capsys.readouterr()
    return status, said.out.splitlines(), said.err.splitlines()


def test_a_system_is_described_whole(path, capsys):
    status, said, wrong = check(capsys, path, "--step-size", 0.25)
    assert (status, wrong) == (0, [])
    fmu = "g.fmu, FMI 2.0, 1 input, 2 outputs, 1 parameter, by PythonFMU"
    found = {line[:19].strip(): line[20:] for line in said if not line.startswith("  ")}
    assert found["system"] == "test (SystemStructure.ssd), 13 recorded variables"
    assert found["time"] == "0 s to 1 s, 4 steps of 0.25 s"
    assert found["coupling"] == "jacobi"
    assert found["connections"] == "3"
    assert found["components"] == "4, in the order of evaluation"
    below = [line.split() for line in said if line.startswith("  ")]
    assert [words[0] for words in below[:4]] == ["a", "c", "b", "d"]
    assert all(fmu in line for line in said[4:8])
    assert found["algebraic loops"] == "1"
    assert ["d.y", "→", "d.u"] in below
    assert found["unconnected inputs"] == "2, which keep their values"
    assert ["a.u", "1.5", "rad"] in below
    assert ["c.u", "0.5", "rad"] in below  # behind a connector that nobody drives
    assert said[-1] == "it would run"


def test_inputs_and_scenario_are_part_of_it(path, capsys):
    (path.parent / "in.csv").write_text("time,drive\n0,1\n")
    (path.parent / "s.toml").write_text('[[faults]]\nsignal = "b.u"\nkind = "stuck"\nstart = 2\n')
    options = ["--step-size", 0.25, "--input-file", path.parent / "in.csv", "--scenario", path.parent / "s.toml"]
    status, said, _ = check(capsys, path, *options)
    assert status == 0
    assert "unconnected inputs  1, which keep their values" in said
    assert "  faults[0]         b.u is stuck at its last value from 2.0 s to end" in said
    assert "  faults[0]: 2 s is not before the stop time, the fault does not occur" in said


def test_what_is_wrong_is_told_together_and_the_status_is_1(path, capsys):
    (path.parent / "s.toml").write_text('[[faults]]\nsignal = "b.v"\nkind = "stuck"\n[[faults]]\nsignal = "b.u"\n')
    options = ["--step-size", 0.25, "--mid-step", "b.w", "--scenario", path.parent / "s.toml"]
    status, said, wrong = check(capsys, path, *options)
    assert (status, said) == (1, [])
    assert wrong == [
        "twip: there is no input b.w, did you mean b.u?",
        "twip: faults[0]: there is no signal b.v, did you mean b.u? (s.toml line 2)",
        "twip: faults[1] has no kind (s.toml line 4)",
    ]
    status, said, wrong = check(capsys, path)
    assert (status, said) == (1, [])
    assert wrong == ["twip: step size is not given, and neither SystemStructure.ssd nor any FMU proposes one"]


def test_an_fmu_is_described(path, capsys):
    status, said, wrong = check(capsys, path.parent / "g.fmu")
    assert (status, wrong) == (0, [])
    assert said[0] == "FMU                 g.fmu, FMI 2.0 co-simulation"
    assert "  u                 0.5 rad, Real, continuous" in said
    assert "  y                 Real, continuous, follows u at once" in said
    assert "  k                 2, Real, fixed, from -9 to 9" in said
    assert said[-1] == "nothing is wrong"


def test_an_fmu_that_cannot_be_used_is_refused(path, capsys):
    (path.parent / "broken.fmu").write_bytes(b"PK")
    status, said, wrong = check(capsys, path.parent / "broken.fmu")
    assert (status, said) == (1, [])
    assert len(wrong) == 1
    assert "FMU broken.fmu is not a readable zip archive" in wrong[0]
    assert check(capsys, path.parent / "none.fmu")[0] == 1


def test_a_parameter_set_is_described(path, capsys):
    (path.parent / "p.ssv").write_text(parameter_set({"a.k": ("Real", 3, "m"), "b.k": ("Integer", 3)}))
    status, said, _ = check(capsys, path.parent / "p.ssv")
    assert status == 0
    assert said == [
        "parameter set       p.ssv, 2 parameters", "  a.k               3 m (Real)", "  b.k               3 (Integer)",
        "warnings            1", "  unit m has no definition in the file (p.ssv line 3)", "nothing is wrong",
    ]  # fmt: skip
    (path.parent / "p.ssv").write_text("<a>")
    status, said, wrong = check(capsys, path.parent / "p.ssv")
    assert (status, said, len(wrong)) == (1, [], 1)


@pytest.mark.parametrize(("name", "option"), [("s.toml", "--scenario"), ("in.csv", "--input-file")])
def test_a_scenario_is_checked_with_its_system_only(capsys, name, option):
    status, _, wrong = check(capsys, name)
    assert status == 1
    assert wrong == [f"twip: {name} can be checked with its system only: twip check SYSTEM {option} {name}"]


def test_a_parameter_mapping_is_described(tmp_path, capsys):
    table = mapping("Integer", {1: 2, 3: 4})
    entries = [("a", "x.k"), ("b", "x.u", linear(2.0, -1.0)), ("c", "x.n", table)]
    (tmp_path / "m.ssm").write_text(parameter_mapping(entries))
    assert check(capsys, tmp_path / "m.ssm") == (0, [
        "parameter mapping   m.ssm, 3 entries",
        "  a                 → x.k",
        "  b                 → x.u, times 2 plus -1",
        "  c                 → x.n, by a table of 2 integer values", "nothing is wrong",
    ], [])  # fmt: skip


def test_a_wrong_parameter_mapping_is_refused_with_every_line(tmp_path, capsys):
    path = tmp_path / "m.ssm"
    table = mapping("Boolean", {"true": "true", "1": "0"})
    path.write_text(parameter_mapping([("a", "k"), ("b", "k"), ("c", "l", table)]))
    again, twice = (line_of(path, f'source="{name}"') for name in "bc")
    status, said, wrong = check(capsys, path)
    assert (status, said) == (1, [])
    assert wrong == [
        f"twip: two parameters are mapped to k (m.ssm line {again})",
        f"twip: the mapping has two entries for 1 (m.ssm line {twice})",
    ]


def test_a_signal_dictionary_is_described(tmp_path, capsys):
    path = tmp_path / "d.ssb"
    path.write_text(dictionary({"s": '<ssc:Real unit="m"/>', "t": "<ssc:Boolean/>"}, units("m m=1", "ssb")))
    assert check(capsys, path) == (0, [
        "signal dictionary   d.ssb, 2 signals", "  s                 Real in m", "  t                 Boolean",
        "nothing is wrong",
    ], [])  # fmt: skip
    path.write_text(path.read_text().replace("<ssc:Boolean/>", "<ssc:Complex/>"))
    status, _, wrong = check(capsys, path)
    assert status == 1
    assert f"(d.ssb line {line_of(path, 'Complex')})" in wrong[0]


@pytest.mark.parametrize("name", ["none.ssv", "none.ssm", "none.ssb", "none.fmu"])
def test_a_file_that_is_not_there_is_refused_in_one_line(tmp_path, capsys, name):
    status, said, wrong = check(capsys, tmp_path / name)
    assert (status, said, len(wrong)) == (1, [], 1)


@pytest.mark.parametrize("ending", ["ssv", "ssm", "ssb", "fmu", "csv", "toml", "mcap", "SSV"])
def test_what_is_no_system_is_called_by_its_name(tmp_path, capsys, ending):
    path = tmp_path / f"c.{ending}"
    path.write_text("<nothing/>")
    assert main(["run", str(path)]) == 1
    said = capsys.readouterr().err.splitlines()
    assert len(said) == 1
    assert f"c.{ending} is a" in said[0]
    assert "a system is an .ssp archive, its unpacked folder or an .ssd file (" in said[0]


def test_an_unpacked_fmu_is_described(path, tmp_path, capsys):
    shutil.unpack_archive(path.parent / "g.fmu", tmp_path / "folder", "zip")
    status, said, wrong = check(capsys, tmp_path / "folder")
    assert (status, wrong) == (0, [])
    assert said[0] == "FMU                 folder, FMI 2.0 co-simulation"
    other = tmp_path / "system.txt"
    other.write_text("no zip")
    assert check(capsys, other)[2] == [
        f"twip: {other}: not a readable zip archive; a system is an .ssp archive, its unpacked folder or an .ssd file"
    ]
