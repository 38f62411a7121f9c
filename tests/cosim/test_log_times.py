"""Times that whole nanoseconds since the start cannot hold: refused before the run, where a log is written."""

import numpy as np
import pytest
from flat_options import grouped
from ssp_writer import component, system, write

from twip.cli import main
from twip.cosim import CsvSink, McapLog, Runtime, Table, load, read_log, simulate
from twip.cosim.model.signals import Channel, Signal
from twip.errors import TwipError

GAIN = "CosimGain.fmu"
CHANNELS = [Channel("plant", (Signal("x", "Real", "m", "output"),))]


def one(folder):
    return write(folder, system([component("a", GAIN)]))


TOO_LONG = "is longer than the 9223372037 s that its times reach, 2^63 nanoseconds"
TOO_SHORT = "1e-09 s, the resolution of its times: 1e+03 rows would share one"


@pytest.mark.parametrize(
    ("start", "stop", "step", "said"),
    [
        (
            0.0,
            1e-9,
            1e-12,
            "step size 1e-12 s is below 1e-09 s, the resolution of its times: 1e+03 rows would share one",
        ),
        (5.0, 1e10 + 5.0, 1e7, f"from 5.0 s to 10000000005.0 s {TOO_LONG}"),
        (0.0, 1e308, 1e307, f"from 0.0 s to 1e+308 s {TOO_LONG}"),
    ],
)
def test_a_log_refuses_times_before_the_run(folder, tmp_path, start, stop, step, said):
    path, progress = tmp_path / "a.mcap", []
    path.write_bytes(b"an earlier log")
    with load(one(folder)) as loaded:
        for sinks in (
            McapLog(path, loaded.channels, {}, start_time=start),
            lambda grid: [McapLog(path, loaded.channels, {}, start_time=grid.start)],
        ):
            options = {"start_time": start, "stop_time": stop, "step_size": step, "progress": progress.append}
            with pytest.raises(TwipError) as failure:
                simulate(loaded, sinks=sinks, **grouped(**options))
            assert str(failure.value) == f"log {str(path)!r}: {said}"
            assert not progress
            assert path.read_bytes() == b"an earlier log"


@pytest.mark.parametrize(("stop", "step"), [(1e-9, 1e-12), (1e10, 1e7), (1e308, 1e307)])
def test_without_a_log_such_times_are_simulated(folder, tmp_path, stop, step, loop):
    with load(one(folder)) as loaded:
        table = Table(loaded.channels)
        csv = CsvSink(tmp_path / "a.csv", loaded.channels)
        result = simulate(loaded, stop_time=stop, step_size=step, sinks=[table, csv], runtime=Runtime(loop=loop))
    assert result.time == table.times[-1] == stop
    assert len(set(table.times.tolist())) == round(stop / step) + 1
    assert len((tmp_path / "a.csv").read_text().splitlines()) == round(stop / step) + 2


def test_the_command_says_it_in_one_line(folder, tmp_path, capsys):
    words = ["run", str(one(folder)), "--stop-time", "1e308", "--step-size", "1e308", "--log", str(tmp_path / "a.mcap")]
    assert main(words) == 1
    error = capsys.readouterr().err.strip()
    assert error.count("\n") == 0
    assert "a.mcap': from 0.0 s to 1e+308 s is longer than" in error


def test_steps_of_a_nanosecond_and_the_longest_run_fit(folder, tmp_path):
    with load(one(folder)) as loaded:
        for name, stop, step in (("a", 1e-6, 1e-9), ("b", 9.2e9, 9.2e7)):
            log = McapLog(tmp_path / f"{name}.mcap", loaded.channels, {})
            simulate(loaded, stop_time=stop, step_size=step, sinks=[log])
            times = read_log(tmp_path / f"{name}.mcap").times
            assert len(set(times.tolist())) == round(stop / step) + 1
            assert times[-1] == pytest.approx(stop, abs=1e-9, rel=1e-15)


def test_variable_steps_below_a_nanosecond_are_told_once(tmp_path):
    with McapLog(tmp_path / "a.mcap", CHANNELS, {}) as log:
        log.check_times(0.0, 1.0, 1e-6)
        log.write(np.array([0.0, 1e-3, 1e-3 + 1e-11]), np.zeros((3, 1)))
        log.write(np.array([1e-3 + 2e-11, 0.5, 0.5, 1.0]), np.zeros((4, 1)))  # two rows of one time are no news
    messages = [(m.time, m.level, m.text) for m in read_log(tmp_path / "a.mcap").events]
    assert messages == [
        (0.001, "warning", "rows less than 1 ns apart share a time in the log, which keeps whole nanoseconds")
    ]
