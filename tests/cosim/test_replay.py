"""A log played by an FMU gives the recorded bits at the recorded steps, and moves whoever takes them as before."""

import zipfile

import fmpy
import numpy as np
import pytest
from flat_options import grouped
from fmpy.validation import validate_fmu
from ssp_writer import component, connection, system, write

from twip.cli import main
from twip.cosim import Algorithm, Table, load, simulate
from twip.cosim.log.playback import read
from twip.cosim.sinks.mcap_log import McapLog
from twip.errors import TwipError
from twip.fmi.declare import Variable
from twip.fmi.replay import Recording, write_replay
from twip.lab.replay import replay

TAIL = '<ssd:DefaultExperiment startTime="0" stopTime="1"/>'


def recorded(ssd, path, **options):
    """Run a system and log it."""
    with load(ssd) as loaded:
        simulate(loaded, sinks=[McapLog(path, loaded.channels, loaded.provenance())], **grouped(**options))
    return path


def table_of(ssd, **options):
    """Run a system and return its table."""
    with load(ssd) as loaded:
        table = Table(loaded.channels)
        simulate(loaded, sinks=[table], **grouped(**options))
    return table


def counted(name, kind="Real", variability="discrete", unit=None):
    return Variable(name, "output", variability, kind, unit, description="recorded")


def wire(text):
    """Turn `left.encoder_count -> estimator.left.encoder_count` into a connection of two components' variables."""
    (a, x), (b, y) = (end.split(".", 1) for end in text.split(" -> "))
    return f'<ssd:Connection startElement="{a}" startConnector="{x}" endElement="{b}" endConnector="{y}"/>'


@pytest.fixture
def steps(tmp_path):
    """A record of 0, 10, 20 at 0, 1, 2 s, held, linear, as an Integer and as a Boolean."""
    signals = (counted("held", unit="rad"), counted("line", variability="continuous"), counted("n", "Integer"),
               counted("on", "Boolean"))  # fmt: skip
    columns = ([0.0, 10.0, 20.0], [0.0, 10.0, 20.0], [0.0, 10.0, 20.0], [0.0, 1.0, 0.0])
    path = tmp_path / "steps.fmu"
    write_replay(Recording("steps", "three rows", signals, [0.0, 1.0, 2.0], columns), path)
    return path


def test_between_rows_signals_are_held_or_linear(steps):
    assert validate_fmu(str(steps)) == []
    rows = fmpy.simulate_fmu(str(steps), stop_time=3.0, step_size=0.25, output_interval=0.25)
    assert list(rows["time"]) == [0.25 * k for k in range(13)]
    assert list(rows["held"]) == [0.0] * 4 + [10.0] * 4 + [20.0] * 5
    assert list(rows["line"]) == [2.5 * k for k in range(9)] + [20.0] * 4
    assert list(rows["n"]) == [0] * 4 + [10] * 4 + [20] * 5
    assert list(rows["on"]) == [False] * 4 + [True] * 4 + [False] * 5


def test_a_state_is_where_the_play_is(steps):
    description = fmpy.read_model_description(str(steps))
    unpacked = fmpy.extract(str(steps))
    fmu = fmpy.instantiate_fmu(unpacked, description)
    fmu.setupExperiment(startTime=0.0)
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    fmu.doStep(0.0, 1.5)
    state = fmu.getFMUState()
    data = fmu.serializeFMUState(state)
    fmu.doStep(1.5, 1.5)
    assert fmu.getReal([0, 1]) == [20.0, 20.0]
    fmu.setFMUState(fmu.deserializeFMUState(data))
    assert fmu.getReal([0, 1]) == [10.0, 15.0]
    fmu.terminate()
    fmu.freeInstance()


def test_the_same_record_gives_the_same_bytes(steps, tmp_path):
    first = steps.read_bytes()
    signals = (counted("held", unit="rad"),)
    write_replay(Recording("steps", "one signal", signals, [0.0], ([1.0],)), steps)
    other = steps.read_bytes()
    write_replay(Recording("steps", "one signal", signals, [0.0], ([1.0],)), steps)
    assert steps.read_bytes() == other != first


def test_a_recorded_component_moves_the_others_as_before(folder, tmp_path):
    chain = [component("place", "CosimIntegrator.fmu", "u> x<")], [connection("source.x -> place.u")]
    source = component("source", "CosimIntegrator.fmu", "u> x<")
    original = write(folder, system([source, *chain[0]], chain[1]), tail=TAIL)
    signal = tmp_path / "in.csv"
    signal.write_text("time,source.u\n0,1\n0.3,-2\n0.7,5\n", encoding="utf-8")
    log = recorded(original, tmp_path / "log.mcap", step_size=0.01, input_file=signal, coupling="gauss-seidel")
    expected = read(log)
    assert main(["replay", str(log), "--as", str(folder / "source.fmu")]) == 0
    played = write(folder, system([component("source", "source.fmu", "x<"), *chain[0]], chain[1]), tail=TAIL)
    table = table_of(played, step_size=0.01, coupling="gauss-seidel")
    for name in ("source.x", "place.x"):
        assert np.array_equal(table[name], expected[name]), name
    finer = table_of(played, step_size=0.005, coupling="gauss-seidel")
    assert np.array_equal(np.array(finer["source.x"])[::2], expected["source.x"])


def test_what_cannot_be_played_is_told(folder, tmp_path):
    log = recorded(write(folder, system([component("a", "CosimGain.fmu")]), tail=TAIL), tmp_path / "log.mcap",
                   step_size=0.5)  # fmt: skip
    for words, message in (
        ((log, "b", tmp_path / "b.fmu"), "there is no component 'b'; there are a"),
        ((log, "a", tmp_path / "1 a.fmu"), "must be an identifier"),
        ((tmp_path / "none.mcap", "a", tmp_path / "a.fmu"), "cannot be read"),
    ):
        with pytest.raises(TwipError, match=message):
            replay(*words)


def test_the_estimator_estimates_the_same_from_recorded_sensors(built, tmp_path):
    log = recorded(built / "ssp" / "twip.ssp", tmp_path / "robot.mcap", stop_time=1.3)
    expected = read(log)
    for name in ("imu", "left", "right"):
        assert replay(log, name, tmp_path / f"{name}.fmu") == []
    (tmp_path / "estimator.fmu").symlink_to(built / "fmus" / "estimator.fmu")
    with load(built / "ssp" / "twip.ssp") as robot:
        estimator = next(c for c in robot.components if c.name == "estimator")
        start = {f"estimator.{v.variable.name}": v.value for v in estimator.start_values}
        columns = robot.columns
        wires = [
            f"{columns[c.source]} -> {columns[c.destination]}"
            for c in robot.copies
            if columns[c.destination].startswith("estimator.")
        ]
    ports = {name: " ".join(f"{w.split(' -> ')[0].split('.', 1)[1]}<" for w in wires if w.startswith(f"{name}."))
             for name in ("imu", "left", "right")}  # fmt: skip
    inputs = " ".join(f"{w.split(' -> ')[1].split('.', 1)[1]}>" for w in wires)
    ssd = write(
        tmp_path,
        system([*(component(n, f"{n}.fmu", p) for n, p in ports.items()),
                component("estimator", "estimator.fmu", inputs)], [wire(w) for w in wires]),
        tail=TAIL,
    )  # fmt: skip
    with load(ssd, start_values=start) as played:
        table = Table(played.channels)
        simulate(played, stop_time=1.3, step_size=0.001, algorithm=Algorithm(coupling="gauss-seidel"), sinks=[table])
    names = [n for n in played.columns if n.startswith("estimator.")]
    assert len(names) > 10
    for name in names:
        assert np.array_equal(table[name], expected[name]), name


def test_the_fmu_carries_its_record_and_terms(steps):
    with zipfile.ZipFile(steps) as archive:
        names = archive.namelist()
    assert sum(name.endswith("/record.bin") for name in names) == 1
    assert "documentation/licenses/twip.txt" in names


def test_the_command_tells_in_one_line_what_it_cannot_write(folder, tmp_path, capsys):
    log = recorded(write(folder, system([component("a", "CosimGain.fmu", "u> y<")]), tail=TAIL),
                   tmp_path / "log.mcap", step_size=0.5)  # fmt: skip
    (tmp_path / "file").write_text("in the folder's place")
    (tmp_path / "taken.fmu").mkdir()
    for output, told in (
        (tmp_path / "file" / "a.fmu", f"{tmp_path / 'file'}: cannot be written: File exists"),
        (tmp_path / "taken.fmu", f"{tmp_path / 'taken.fmu'}: cannot be written: Is a directory"),
        (tmp_path / "a", f"{tmp_path / 'a'}: the ending must be .fmu"),
    ):
        assert main(["replay", str(log), "--as", str(output), "--component", "a"]) == 1
        assert capsys.readouterr().err == f"twip: {told}\n"
