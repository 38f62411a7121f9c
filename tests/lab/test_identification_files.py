"""Bench data from files, mistakes in them, and the parameter sets that come out."""

import numpy as np
import pytest
from identification_motor import KT, Motor

from twip.cosim import load
from twip.cosim.ssp.parameter_file import parameters_of
from twip.errors import TwipError
from twip.lab.identification import Recording, SteadySamples, identify
from twip.lab.identification.columns import Columns
from twip.lab.identification.experiments import held_out, run_up, staircase
from twip.lab.identification.parameter_set import bench_parameters, robot_parameters, wheel_inertia, write
from twip.lab.identification.reading import read_data
from twip.robot.parameters import value

MOTOR = Motor()
STEPS = ((4.0, 0.0), *((6.0, i) for i in (0.07, 0.09, 0.11)))


def read(path, zero=0.0, **columns):
    return read_data(path, Columns(columns), 2048.0, zero)


def series(path, header="time,current,encoder_count", factors=(1.0, 1.0, 1.0), delimiter=",", rows=400):
    recording = MOTOR.record(STEPS, 1, zero=0.0)
    chosen = slice(None) if rows is None else slice(4500, 4500 + rows)
    columns = (recording.time, recording.current, np.round(recording.angle / recording.angle_step))
    lines = [header]
    for cells in zip(*(column[chosen] / f for column, f in zip(columns, factors, strict=True)), strict=True):
        lines.append(delimiter.join(f"{cell:.9g}" for cell in cells))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("header", "factors", "delimiter", "columns"),
    [
        ("time,current,encoder_count", (1.0, 1.0, 1.0), ",", {}),
        ("t [ms];current [mA];count", (1e-3, 1e-3, 1.0), ";", {}),
        ("clock\tI:motor\tenc", (1e-3, 1e-3, 1.0), "\t", {"time": "clock:ms", "current": "I:motor:mA", "count": "enc"}),
    ],
)
def test_columns_by_usual_and_by_own_names_with_units(tmp_path, header, factors, delimiter, columns):
    expected = read(series(tmp_path / "plain.csv"))
    found = read(series(tmp_path / "bench.csv", header, factors, delimiter), **columns)
    assert isinstance(found, Recording)
    assert found.time == pytest.approx(expected.time, rel=1e-7)
    assert found.current == pytest.approx(expected.current, rel=1e-7)
    assert np.array_equal(found.angle, expected.angle)


def test_a_column_of_words_does_not_matter(tmp_path):
    path = tmp_path / "bench.csv"
    path.write_text("time,current,speed,phase\n" + "".join(f"{k * 0.01},0.1,{k},up\n" for k in range(200)))
    assert read(path).speed[7] == 7.0


def test_rows_that_jitter_are_put_on_equal_times(tmp_path):
    random = np.random.default_rng(1)
    time = np.arange(500) * 0.01 + random.uniform(-1e-3, 1e-3, 500)
    path = tmp_path / "bench.csv"
    path.write_text("time,current,speed\n" + "".join(f"{t},{0.1 + t},{2 * t}\n" for t in np.delete(time, 250)))
    found = read(path)
    assert np.ptp(np.diff(found.time)) < 1e-12
    assert found.current == pytest.approx(0.1 + found.time, rel=1e-9)
    assert found.speed == pytest.approx(2 * found.time, rel=1e-9)


def test_a_file_without_time_holds_steady_samples(tmp_path):
    path = tmp_path / "samples.csv"
    path.write_text("I,n\n0.07,1000\n0.08,2000\n0.09,3000\n")
    found = read(path, current="I", speed="n:rpm")
    assert isinstance(found, SteadySamples)
    assert found.speed == pytest.approx(np.array([1, 2, 3]) * 1000 * 2 * np.pi / 60)


ROWS = [f"{k * 0.01},0.1,{k}" for k in range(200)]


@pytest.mark.parametrize(
    ("lines", "columns", "message"),
    [
        ([], {}, "bench.csv: the file is empty"),
        (["time,current,speed"], {}, "bench.csv: there are no rows below the header"),
        (["time,amperes,speed", *ROWS], {}, "bench.csv: no column for the current; name it by --current"),
        (["time,current,w", *ROWS], {}, "bench.csv: no column for the shaft; name it by --count"),
        (["time,current,speed", *ROWS], {"current": "curent"}, "no column 'curent', did you mean 'current'"),
        (["time,current,speed", *ROWS], {"current": "current:kg"}, "unit 'kg' must be one of A, mA"),
        (["time [h],current,speed", *ROWS], {}, "unit 'h' of column 'time [h]' must be one of s, ms"),
        (
            ["time,current,speed", *ROWS[:9], "0.09,oops,9", *ROWS[10:]],
            {},
            "bench.csv line 11: current must be a finite",
        ),
        (
            ["time,current,speed", *ROWS[:9], "0.09,nan,9", *ROWS[10:]],
            {},
            "bench.csv line 11: current must be a finite",
        ),
        (
            ["time,current,speed", *ROWS[:9], "0.09,0.1", *ROWS[10:]],
            {},
            "bench.csv line 11: 2 cells where the header has 3",
        ),
        (
            ["time,current,speed", *ROWS[:9], ROWS[3], *ROWS[10:]],
            {},
            "line 11: time 0.03 s follows 0.08 s, it must incr",
        ),
        (["time,current,speed", *ROWS[:20], *ROWS[60:]], {}, "line 22: 0.41 s after the row before"),
        (["time,current,speed", *ROWS[:50]], {}, "50 rows are too few"),
        (["current,encoder_count", *(f"0.1,{k}" for k in range(9))], {}, "need a speed, not counts"),
    ],
)
def test_mistakes_are_one_line_that_says_where(tmp_path, lines, columns, message):
    path = tmp_path / "bench.csv"
    path.write_text("".join(f"{line}\n" for line in lines))
    with pytest.raises(TwipError) as error:
        read(path, **columns)
    assert "\n" not in str(error.value)
    assert message in str(error.value)


def test_files_that_are_not_there_or_no_text(tmp_path):
    with pytest.raises(TwipError, match="cannot be read"):
        read(tmp_path / "missing.csv")
    (tmp_path / "binary.csv").write_bytes(b"\xff\xfe\x00\x01")
    with pytest.raises(TwipError, match="no text in UTF-8"):
        read(tmp_path / "binary.csv")
    (tmp_path / "broken.mcap").write_bytes(b"\x89MCAP0\r\n and then rubbish")
    with pytest.raises(TwipError, match="is not a log of twip"):
        read(tmp_path / "broken.mcap")


@pytest.fixture(scope="module")
def found():
    return identify([MOTOR.record(e.steps, [1, k]) for k, e in enumerate((staircase(), run_up()))], KT)


def test_the_wheels_inertia_is_what_rotor_and_gear_leave():
    rest = value("rotor_inertia") + value("gear_inertia")
    assert wheel_inertia(1.5450e-6, value("gear_ratio"), rest) == pytest.approx(1.7046e-4, rel=1e-4)


def test_the_robot_takes_the_parameter_set(built, tmp_path, found):
    parameters = robot_parameters({"left": found, "right": found})
    write(tmp_path / "both.ssv", "both", parameters)
    with load(built / "ssp" / "twip.ssp", parameters=[tmp_path / "both.ssv"]) as system:
        values = {entry.name: entry.value for entry in parameters_of(system)}
    for side in ("left", "right"):
        for name in ("coulomb_forward", "coulomb_reverse", "viscous_forward", "viscous_reverse"):
            expected = pytest.approx(found[name].found(), rel=1e-5)
            assert values[f"{side}.{name}"] == expected
            assert values[f"controller.{side}.{name}"] == expected
        for way in ("forward", "reverse"):  # not identifiable: no Stribeck effect rather than the old robot's
            assert values[f"{side}.static_{way}"] == values[f"{side}.coulomb_{way}"]
    for block in ("plant", "controller"):
        assert values[f"{block}.wheel_inertia"] == pytest.approx(1.7046e-4, rel=0.01)
    assert not any("stribeck_speed" in name for name in parameters)


def test_an_inertia_below_that_of_rotor_and_gear_is_not_written(found):
    assert "plant.wheel_inertia" not in robot_parameters({"left": found}, rotor_and_gear=2e-6)


def test_the_bench_takes_the_parameter_set(built, tmp_path, found):
    write(tmp_path / "bench.ssv", "bench", bench_parameters(found))
    with load(built / "ssp" / "bench.ssp", parameters=[tmp_path / "bench.ssv"]) as system:
        values = {entry.name: entry.value for entry in parameters_of(system)}
    assert values["bench.bench_inertia"] == pytest.approx(1.545e-6, rel=0.01)
    assert values["motor.coulomb_reverse"] == pytest.approx(5.333e-4, rel=0.01)


@pytest.mark.parametrize("experiment", [staircase(), run_up(), held_out()], ids=lambda e: e.name)
def test_the_input_series_under_version_control_are_the_experiments(built, tmp_path, experiment):
    experiment.write(tmp_path / "series.csv")
    shipped = built / "ssp" / "inputs" / f"bench_{experiment.name}.csv"
    assert shipped.read_bytes() == (tmp_path / "series.csv").read_bytes()
