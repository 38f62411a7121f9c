"""A run that does not reach its end: what the caller, the sinks and the temporary folder are left with."""

import os
import signal
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import numpy as np
import pytest
from flat_options import grouped
from ssp_writer import component, connection, system, write

from twip.cosim import CsvSink, Runtime, Table, load, simulate
from twip.cosim.log import playback
from twip.cosim.run.interrupt_flag import InterruptFlag
from twip.cosim.sinks.mcap_log import McapLog
from twip.errors import TwipError


@pytest.fixture
def path(folder):
    parts = [component(name, "CosimFaulty.fmu", "u> y<") for name in ("good", "bad")]
    return write(folder, system([*parts, component("g", "CosimGain.fmu", "u>")], [connection("good.y -> g.u")]))


def run(path, fault, at=0.5, **options):
    with load(path, start_values={"bad.fault": fault, "bad.fault_time": at}) as loaded:
        table, csv = Table(loaded.channels), CsvSink(path.parent / "out.csv", loaded.channels)
        failure = None
        try:
            result = simulate(loaded, sinks=[table, csv], step_size=options.pop("step_size", 0.1), **grouped(**options))
        except TwipError as error:
            failure, result = error, None
        folder = loaded.workspace.path
    assert not folder.exists()
    assert table.closed
    return table, result, failure


@pytest.mark.parametrize("coupling", ["jacobi", "gauss-seidel"])
@pytest.mark.parametrize(
    ("fault", "message", "level"),
    [
        ("raise", "bad failed at t = 0.5 s: fmi2DoStep returned fatal: Fatal py exception encountered: [doStep]"
         " PyObject_CallMethod ValueError('the belt broke')", "fatal"),
        ("discard", "bad failed at t = 0.5 s: fmi2DoStep returned discard (computed until t = 0.5 s):"
         " the belt slipped by 3 mm", "error"),
        ("nan", "bad failed at t = 0.6 s: fmi2GetReal gave y = nan, which is not finite", "error"),
    ],
)  # fmt: skip
def test_a_failing_component_leaves_exactly_the_rows_before_it(path, coupling, fault, message, level, loop):
    table, _, failure = run(path, fault, coupling=coupling, loop=loop)
    assert str(failure) == message
    # the row at 0.5 s is the last; the step from there failed
    assert table.times.tolist() == [k * 0.1 for k in range(6)]
    assert table["good.y"].tolist() == [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]
    # under Jacobi the gain (y = 2 u, z = -u) lags by a step
    used = 5.0 if coupling == "gauss-seidel" else 4.0
    assert (path.parent / "out.csv").read_text().splitlines()[-1] == f"0.5,5.0,5.0,{2 * used},{-used}"
    assert table.events[-1].text == message
    assert table.events[0].level == level
    assert table.events[0].time == 0.5


def test_a_failure_in_a_later_chunk_keeps_the_chunks_before_and_the_rows_of_its_own(path, loop):
    table, _, failure = run(path, "raise", at=0.45, step_size=0.001, loop=loop)
    assert failure is not None
    assert len(table.times) == 451
    assert len((path.parent / "out.csv").read_text().splitlines()) == 452


def test_a_failure_during_initialization_names_the_function(path):
    table, _, failure = run(path, "initialization")
    assert str(failure).startswith("bad failed at t = 0 s: fmi2ExitInitializationMode returned fatal: ")
    assert len(table.times) == 0


def test_a_failure_during_initialization_leaves_the_files_of_the_last_run(path):
    log, out = path.parent / "run.mcap", path.parent / "out.csv"

    def attempt(fault):
        with load(path, start_values={"bad.fault": fault}) as loaded:
            simulate(loaded, sinks=[McapLog(log, loaded.channels, {}), CsvSink(out, loaded.channels)], step_size=0.1)

    with pytest.raises(TwipError):
        attempt("initialization")
    assert not log.exists()
    assert not out.exists()
    attempt("none")
    before = log.read_bytes(), out.read_bytes()
    with pytest.raises(TwipError):
        attempt("initialization")
    assert (log.read_bytes(), out.read_bytes()) == before


def test_after_a_fatal_failure_the_same_system_runs_again(path, loop):
    with load(path, start_values={"bad.fault": "raise", "bad.fault_time": 0.5}) as loaded:
        with pytest.raises(TwipError):
            simulate(loaded, step_size=0.1, runtime=Runtime(loop=loop))
        assert simulate(loaded, step_size=0.1, stop_time=0.5, runtime=Runtime(loop=loop)).steps == 5


def test_messages_of_the_components_are_events_with_their_time_and_not_printed(path, capfd, loop):
    table, result, _ = run(path, "chatter", at=0.25, step_size=0.25, loop=loop)
    assert [(e.time, e.level, e.source, e.text) for e in table.events] == [
        (t, level, "bad", text)
        for t in (0.25, 0.5, 0.75)
        for level, text in (("info", "all is well"), ("warning", "a bit warm: 90 % of the limit"))
    ]
    assert result.warnings == ()
    assert capfd.readouterr() == ("", "")


def test_a_sink_that_cannot_write_ends_the_run_with_one_line(path, loop):
    class Full(Table):
        def write(self, times, rows):
            if len(self.times) > 300:
                raise OSError(28, "No space left on device", "log.mcap")
            super().write(times, rows)

    with load(path) as loaded:
        other, full = Table(loaded.channels), Full(loaded.channels)
        with pytest.raises(TwipError, match=r"^log.mcap: cannot be written \(No space left on device\)$"):
            simulate(loaded, step_size=0.001, sinks=[full, other], runtime=Runtime(loop=loop))
    assert full.closed
    assert other.closed


def test_a_csv_path_that_cannot_be_written_is_named(path):
    (path.parent / "file").touch()
    with load(path) as loaded, pytest.raises(TwipError, match=r"file/out\.csv: cannot be written"):
        CsvSink(path.parent / "file" / "out.csv", loaded.channels)


def test_missing_folders_of_a_csv_are_created(path):
    with load(path) as loaded:
        simulate(loaded, step_size=0.5, sinks=[CsvSink(path.parent / "a" / "b" / "out.csv", loaded.channels)])
    assert len((path.parent / "a" / "b" / "out.csv").read_text().splitlines()) == 4


DISK_FILLS = """
    import resource, sys
    from twip.cosim import CsvSink, Runtime, load, simulate
    from twip.errors import TwipError

    with load(sys.argv[1]) as loaded:
        csv = CsvSink(sys.argv[2], loaded.channels)
        resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, 10_000))
        try:
            simulate(loaded, step_size=0.001, sinks=[csv], runtime=Runtime(loop="python"))
        except TwipError as error:
            print(error)
"""


def test_a_full_disk_names_the_csv_and_leaves_whole_rows(path):
    out = path.parent / "out.csv"
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(DISK_FILLS), str(path), str(out)],
        stdout=subprocess.PIPE, text=True, check=True, timeout=60,
    )  # fmt: skip
    assert done.stdout == f"{out}: cannot be written (File too large)\n"
    lines = out.read_text().splitlines(keepends=True)
    assert len(lines) > 2
    assert all(line.count(",") == 4 and line.endswith("\n") for line in lines)


def test_a_file_that_another_run_writes_is_refused_and_stays_whole(path):
    log, out = path.parent / "run.mcap", path.parent / "out.csv"
    with load(path) as loaded:
        first = [McapLog(log, loaded.channels, {}), CsvSink(out, loaded.channels)]
        with pytest.raises(TwipError) as of_log:
            McapLog(log, loaded.channels, {})
        with pytest.raises(TwipError) as of_csv:
            CsvSink(out, loaded.channels)
        assert str(of_log.value) == f"log '{log}' is being written by another run"
        assert str(of_csv.value) == f"{out} is being written by another run"
        simulate(loaded, step_size=0.1, sinks=first)
        assert len(out.read_text().splitlines()) == 12
        assert playback.read(log).complete
        # what is there is replaced as soon as nobody writes it
        simulate(loaded, step_size=0.5, sinks=[McapLog(log, loaded.channels, {}), CsvSink(out, loaded.channels)])
    assert len(out.read_text().splitlines()) == 4
    assert len(playback.read(log).times) == 3


def test_the_csv_holds_outputs_in_full_precision(path):
    table, _, _ = run(path, "none", step_size=0.1)
    lines = (path.parent / "out.csv").read_text().splitlines()
    assert lines[0] == "time,good.y,bad.y,g.y,g.z"
    read = np.array([[float(cell) for cell in line.split(",")] for line in lines[1:]])
    expected = np.column_stack([table.times, *(table[name] for name in ("good.y", "bad.y", "g.y", "g.z"))])
    np.testing.assert_array_equal(read, expected)


def test_progress_is_told_after_each_chunk(path, loop):
    seen = []
    run(path, "none", step_size=0.002, progress=seen.append, loop=loop)
    assert seen == [0.4, 0.8, 1.0]


PROGRAM = """
    import sys
    from twip.cosim import CsvSink, Observer, Runtime, Table, load, simulate

    with load(sys.argv[1], start_values={"bad.fault": "slow"}) as loaded:
        table, csv = Table(loaded.channels), CsvSink(sys.argv[2], loaded.channels)
        tell = lambda time: print("reached", time, flush=True)
        print("folder", loaded.workspace.path, flush=True)
        result = simulate(
            loaded, sinks=[table, csv], stop_time=1000, step_size=0.01,
            runtime=Runtime(loop=sys.argv[3]), observer=Observer(tell),
        )
    print("rows", len(table.times), result.steps, result.interrupted, table.closed, flush=True)
    sys.exit(128 + result.signal if result.interrupted else 0)
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_stops_between_two_steps_with_complete_output(path, tmp_path, loop, number):
    out = tmp_path / "interrupted.csv"
    process = subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(PROGRAM), str(path), str(out), loop], stdout=subprocess.PIPE, text=True
    )
    workspace = Path(process.stdout.readline().split()[1])
    assert process.stdout.readline().startswith("reached")
    time.sleep(0.3)
    sent = time.monotonic()
    os.kill(process.pid, number)
    told = next(line for line in process.stdout if line.startswith("rows"))
    assert time.monotonic() - sent < 1.0  # one step takes 0.01 s
    assert process.wait(timeout=30) == 128 + number
    process.stdout.close()
    rows, steps, interrupted, closed = told.split()[1:]
    assert (interrupted, closed) == ("True", "True")
    assert int(rows) == int(steps) + 1
    lines = out.read_text().splitlines()
    assert len(lines) == int(rows) + 1
    assert lines[-1].count(",") == lines[0].count(",")
    assert not workspace.exists()


def test_the_signal_handlers_are_restored(path, loop):
    def handlers():
        return [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)]

    before = handlers()
    _, result, _ = run(path, "none", loop=loop)
    assert (result.interrupted, result.signal) == (False, None)
    assert handlers() == before
    run(path, "raise", loop=loop)
    assert handlers() == before


def test_a_second_signal_does_what_it_did_before_and_an_ignored_one_stays_ignored():
    seen = []
    before = signal.signal(signal.SIGTERM, lambda number, _: seen.append(number))
    ignored = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with InterruptFlag() as flag:
            os.kill(os.getpid(), signal.SIGHUP)
            assert not flag
            os.kill(os.getpid(), signal.SIGTERM)
            assert (bool(flag), flag.signal, seen) == (True, signal.SIGTERM, [])
            os.kill(os.getpid(), signal.SIGTERM)
            assert seen == [signal.SIGTERM]
    finally:
        signal.signal(signal.SIGTERM, before)
        signal.signal(signal.SIGHUP, ignored)


@pytest.mark.heavy
def test_no_process_aborts_at_its_exit(path):
    """Plain pythonfmu FMUs abort some hosts at exit; where they don't, this shows only that the guard does no harm."""
    program = "import sys\nfrom twip.cosim import load, simulate\nsimulate(load(sys.argv[1]), step_size=0.1)"
    codes = [subprocess.run([sys.executable, "-c", program, str(path)], timeout=60).returncode for _ in range(50)]
    assert codes == [0] * 50
