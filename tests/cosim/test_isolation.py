"""FMUs in processes of their own: the same results, and a clean end whatever they do."""

import os
import signal
import subprocess
import sys
import textwrap
import time
import zipfile
from pathlib import Path

import numpy as np
import pytest
from c_fmu import WHAT, WHERE, chain, demand
from flat_options import grouped
from ssp_writer import bind, component, connection, edit_fmu, system, write

from twip.cli import main
from twip.cosim import Algorithm, Checkpoints, Runtime, Table, check, load, simulate
from twip.cosim.fmus import isolation
from twip.cosim.log import playback
from twip.cosim.sinks.mcap_log import McapLog
from twip.errors import TwipError

SEGFAULT = "crashed: SIGSEGV (Segmentation fault)"


def children(pid):
    """Return the processes that `pid` has started, zombies too."""
    try:
        return [int(c) for task in Path(f"/proc/{pid}/task").iterdir() for c in (task / "children").read_text().split()]
    except FileNotFoundError:
        return []


def gone(pids):
    """Tell whether none of the processes lives."""
    return not any(Path(f"/proc/{pid}/stat").exists() for pid in pids)


def run(path, start_values, log=None, **options):
    before = children(os.getpid())
    with load(path, start_values=start_values) as loaded:
        table, failure = Table(loaded.channels), ""
        sinks = [table] if log is None else [table, McapLog(log, loaded.channels, {})]
        try:
            simulate(
                loaded,
                sinks=sinks,
                step_size=0.1,
                **grouped(**{"coupling": "gauss-seidel", "isolate": True, **options}),
            )
        except TwipError as error:
            failure = str(error)
    assert children(os.getpid()) == before
    assert table.closed
    return table, failure


@pytest.mark.parametrize(
    ("where", "what", "said"),
    [
        ("step", "crash", f"t = 0.5 s: doStep {SEGFAULT}: a bit warm"),
        ("step", "abort", "t = 0.5 s: doStep crashed: SIGABRT (Aborted)"),
        ("step", "quit", "t = 0.5 s: doStep ended the process with exit status 3"),
        ("step", "loop", "t = 0.5 s: doStep did not return within 1 s"),
        ("set", "crash", f"t = 0.5 s: setting the inputs {SEGFAULT}: a bit warm"),
        ("get", "crash", f"t = 0.5 s: getting the outputs {SEGFAULT}: a bit warm"),
    ],
)
def test_a_crash_or_hang_in_a_step_leaves_the_rows_before_it(faulty_folder, tmp_path, where, what, said):
    log = tmp_path / "run.mcap"
    limit = 1.0 if what == "loop" else 30.0
    table, failure = run(chain(faulty_folder), demand(where, what, 0.5), log, time_limit=limit)
    assert failure == f"bad failed at {said}"
    rows = 5 if where == "get" else 6
    assert table.times.tolist() == [k * 0.1 for k in range(rows)]
    assert table["bad.z"].tolist() == [2.0 * k for k in range(rows)]
    logged = playback.read(log)
    assert logged.complete
    assert logged["bad.z"].tolist() == table["bad.z"].tolist()
    assert failure in [event.text for event in logged.events]


@pytest.mark.parametrize(
    ("where", "what", "said"),
    [
        ("enter", "crash", f"entering initialization mode {SEGFAULT}: a bit warm"),
        ("exit", "quit", "leaving initialization mode ended the process with exit status 3"),
        ("enter", "loop", "entering initialization mode did not return within 3 s"),
    ],
)
def test_a_crash_or_hang_in_the_initialization_leaves_no_row(faulty_folder, monkeypatch, where, what, said):
    monkeypatch.setattr(isolation, "START_LIMIT", 3.0)
    table, failure = run(chain(faulty_folder), demand(where, what), time_limit=0.1)
    assert failure == f"bad failed at t = 0 s: {said}"
    assert len(table.times) == 0


@pytest.mark.parametrize(
    ("what", "said"),
    [("crash", f"{SEGFAULT}: a bit warm"), ("quit", "ended the process with exit status 3")],
)
def test_a_crash_at_the_instantiation(faulty_folder, what, said):
    name = f"instantiate_{WHAT[what]}"
    table, failure = run(chain(faulty_folder, bad=name), {})
    assert failure == f"{name} failed at t = 0 s: instantiation {said}"
    assert len(table.times) == 0


@pytest.mark.parametrize(
    ("where", "what", "said"),
    [
        ("terminate", "crash", f"termination {SEGFAULT}: a bit warm"),
        ("free", "loop", "termination did not return within 1 s"),
        ("free", "quit", "termination ended the process with exit status 3"),
    ],
)
def test_a_crash_or_hang_at_the_end_is_a_warning(faulty_folder, where, what, said):
    table, failure = run(chain(faulty_folder), demand(where, what), time_limit=1.0)
    assert failure == ""
    assert len(table.times) == 11
    assert [(e.level, e.text) for e in table.events][-1] == ("warning", f"bad failed at t = 1 s: {said}")


def test_what_an_fmu_prints_and_logs_arrives(faulty_folder, capfd):
    table, failure = run(chain(faulty_folder), demand("step", "print", 0.75), time_limit=30.0)
    assert (failure, len(table.times)) == ("", 11)
    assert capfd.readouterr().out == "printed by bad\n" * 2
    table, failure = run(chain(faulty_folder), demand("step", "talk", 0.85))
    assert [(e.time, e.level, e.source, e.text) for e in table.events] == [
        (0.9, "info", "bad", f"line {i}") for i in range(1000)
    ]


def test_a_python_fmu_that_raises_is_told_as_in_one_process(folder):
    path = write(folder, system([component("bad", "CosimFaulty.fmu", "u> y<")]))
    said = []
    for isolate in (False, True):
        with load(path, start_values={"bad.fault": "raise", "bad.fault_time": 0.5}) as loaded:
            table = Table(loaded.channels)
            with pytest.raises(TwipError) as failure:
                simulate(loaded, sinks=[table], step_size=0.1, runtime=Runtime(isolate=isolate))
            said.append((str(failure.value), table.times.tolist(), table.events))
    assert said[0] == said[1]


@pytest.mark.parametrize("coupling", ["jacobi", "gauss-seidel"])
def test_the_results_are_those_of_one_process(folder, coupling):
    parts = [
        component("a", "CosimIntegrator.fmu", "u> x<"),
        component("b", "CosimGain.fmu", "u> y< z<"),
        component("m", "CosimMixed.fmu", "n> on> smooth> total< inverted< seen<"),
    ]
    wires = [connection("a.x -> b.u"), connection("b.z -> a.u"), connection("b.y -> m.smooth")]
    path = write(folder, system(parts, wires))
    tables = []
    for isolate in (False, True):
        with load(path, start_values={"a.x_start": 0.3, "b.k": 1.7, "m.n": 4}) as loaded:
            tables.append(Table(loaded.channels))
            simulate(
                loaded,
                sinks=[tables[-1]],
                step_size=0.01,
                algorithm=Algorithm(coupling=coupling),
                runtime=Runtime(isolate=isolate),
            )
            names = loaded.columns
    assert len(tables[0].times) == 101
    for name in names:
        np.testing.assert_array_equal(tables[0][name], tables[1][name])


@pytest.fixture
def sleepers(folder):
    """Four FMUs that sleep for 10 ms in every step, each fed by the one before."""
    given = bind({"fault": ("String", "slow")})
    elements = [component(name, "CosimFaulty.fmu", "u> y<", given) for name in "abcd"]
    wires = [connection("a.y -> b.u"), connection("b.y -> c.u"), connection("c.y -> d.u")]
    return write(folder, system(elements, wires))


def test_under_jacobi_they_work_side_by_side(sleepers):
    walls, rows = {}, {}
    for coupling in ("jacobi", "gauss-seidel"):
        with load(sleepers) as loaded:
            result = simulate(
                loaded,
                stop_time=2.0,
                step_size=0.1,
                algorithm=Algorithm(coupling=coupling),
                runtime=Runtime(isolate=True),
            )
        walls[coupling], rows[coupling] = result.wall_time, result.table.values
    assert walls["gauss-seidel"] >= 20 * 4 * 0.01
    assert walls["jacobi"] < 0.6 * walls["gauss-seidel"]  # 0.25 and what the processes' talk costs
    with load(sleepers) as loaded:
        alone = simulate(
            loaded, stop_time=2.0, step_size=0.1, algorithm=Algorithm(coupling="jacobi"), runtime=Runtime(loop="python")
        )
    assert rows["jacobi"].tobytes() == alone.table.values.tobytes()


def told(path, isolate, **start_values):
    """Return the failure, the times of the rows, and what was said."""
    messages, table = [], None
    with load(path, start_values=start_values) as loaded:
        table = Table(loaded.channels)
        log = path.parent / "run.mcap"
        with pytest.raises(TwipError) as failure:
            simulate(
                loaded,
                stop_time=1.0,
                step_size=0.1,
                algorithm=Algorithm(coupling="jacobi"),
                runtime=Runtime(loop="python", isolate=isolate),
                sinks=[table, McapLog(log, loaded.channels, {})],
            )
        messages = [(event.time, event.source, event.text) for event in playback.read(log).events]
    return str(failure.value), table.times.tolist(), messages


def test_when_one_fails_the_work_of_those_beside_it_is_not_told(sleepers):
    """B fails at 0.5 s; c, which works at the same time, would warn from then on, and d would fail too."""
    given = {"a.fault": "none", "b.fault": "discard", "c.fault": "chatter", "d.fault": "raise"}
    given |= {f"{name}.fault_time": 0.5 for name in "bcd"}
    assert told(sleepers, True, **given) == told(sleepers, False, **given)


def test_when_one_fails_beside_one_that_hangs_the_run_ends_in_time(faulty_folder):
    given = {**demand("step", "crash", 0.5), "good.where": WHERE["step"], "good.what": WHAT["loop"], "good.at": 0.5}
    path = write(faulty_folder, system([component(name, "faulty.fmu", "u> y< z<") for name in ("bad", "good")], []))
    begin = time.monotonic()
    table, failure = run(path, given, coupling="jacobi", time_limit=1.0)
    assert failure == f"bad failed at t = 0.5 s: doStep {SEGFAULT}: a bit warm"
    assert len(table.times) == 6
    assert time.monotonic() - begin < 20.0


def test_what_fmus_have_added_to_the_path_is_left_out(faulty_folder, monkeypatch):
    """pythonfmu adds a folder for every instance; a variable of the environment holds 128 KiB at most."""
    monkeypatch.setattr(sys, "path", [*sys.path, *(f"/fmu/{n}/resources" for n in range(10_000))])
    table, failure = run(chain(faulty_folder), {}, stop_time=0.2)
    assert (len(table.times), failure) == (3, "")


@pytest.mark.heavy
def test_the_robot_stands_up_alike(built):
    tables = []
    for isolate in (False, True):
        with load(built / "ssp" / "twip.ssp") as loaded:
            tables.append(Table(loaded.channels))
            simulate(loaded, sinks=[tables[-1]], stop_time=2.0, runtime=Runtime(isolate=isolate))
            names = loaded.columns
    assert len(tables[0].times) == 2001
    for name in names:
        np.testing.assert_array_equal(tables[0][name], tables[1][name])


@pytest.mark.parametrize(("first", "second"), [(True, False), (False, True)])
def test_a_checkpoint_serves_both_ways(faulty_folder, tmp_path, first, second):
    path, kept = chain(faulty_folder), tmp_path / "run.checkpoint"
    with load(path) as loaded:
        whole, rest = Table(loaded.channels), Table(loaded.channels)
        simulate(loaded, sinks=[whole], step_size=0.1)
        simulate(
            loaded, step_size=0.1, stop_time=0.5, checkpoints=Checkpoints(file=kept), runtime=Runtime(isolate=first)
        )
        simulate(
            loaded, sinks=[rest], step_size=0.1, checkpoints=Checkpoints(resume=kept), runtime=Runtime(isolate=second)
        )
    assert rest.times.tolist() == whole.times[5:].tolist()
    for name in ("good.y", "bad.z"):
        assert rest[name].tolist() == whole[name][5:].tolist()


@pytest.mark.parametrize(
    ("where", "at", "said"), [("save", 0.45, "saving the state"), ("restore", 0.0, "restoring the state")]
)
def test_a_crash_around_a_checkpoint(faulty_folder, tmp_path, where, at, said):
    kept = tmp_path / "run.checkpoint"
    if where == "restore":
        with load(chain(faulty_folder), start_values=demand(where, "crash")) as loaded:
            simulate(
                loaded,
                step_size=0.1,
                stop_time=0.5,
                algorithm=Algorithm(coupling="gauss-seidel"),
                checkpoints=Checkpoints(file=kept),
            )
    table, failure = run(
        chain(faulty_folder), demand(where, "crash", at), **{"save": {"checkpoint": kept, "checkpoint_every": 0.5},
        "restore": {"resume": kept}}[where],
    )  # fmt: skip
    assert failure == f"bad failed at t = 0.5 s: {said} {SEGFAULT}: a bit warm"
    assert len(table.times) == (6 if where == "save" else 0)


def test_an_fmu_that_allows_one_instance_per_process(faulty_folder, capsys):
    with zipfile.ZipFile(faulty_folder / "faulty.fmu") as archive:
        description = archive.read("modelDescription.xml").replace(
            b'OnlyOncePerProcess="false"', b'OnlyOncePerProcess="true"'
        )
    once = edit_fmu(
        faulty_folder / "faulty.fmu", faulty_folder / "once.fmu", files={"modelDescription.xml": description}
    )
    parts = [component(name, once.name, "u> y< z<") for name in "ab"]
    path = write(faulty_folder, system(parts, [connection("a.y -> b.u")]))
    line = (
        "FMU once.fmu allows one instance per process, but a, b share it (isolated, with --isolate, each has its own)"
    )
    assert check(path) == [line]
    assert main(["check", str(path), "--step-size", "0.1"]) == 1
    assert capsys.readouterr().err == f"twip: {line}\n"
    with load(path) as loaded, pytest.raises(TwipError) as refused:
        simulate(loaded, step_size=0.1)
    assert str(refused.value) == line
    copied = faulty_folder / "copy.fmu"
    copied.write_bytes(once.read_bytes())  # a copy of the file is no other FMU
    twins = [component("a", once.name, "u> y< z<"), component("b", copied.name, "u> y< z<")]
    assert check(write(faulty_folder, system(twins))) == [line]
    path = write(faulty_folder, system(parts, [connection("a.y -> b.u")]))
    table, failure = run(path, {})
    assert failure == ""
    assert table["b.z"].tolist() == [2.0 * k for k in range(11)]


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (
            {"isolate": True, "loop": "compiled"},
            "loop 'compiled' calls FMUs in this process: isolated ones need loop 'python'",
        ),
        (
            {"time_limit": 5.0},
            "a time limit needs isolated FMUs (--isolate): a call in this process cannot be stopped",
        ),
        ({"isolate": True, "time_limit": 0.0}, "time limit 0.0 s must be a positive number"),
        ({"isolate": True, "time_limit": float("nan")}, "time limit nan s must be a positive number"),
    ],
)
def test_options_that_do_not_go_together(faulty_folder, options, said):
    with load(chain(faulty_folder)) as loaded, pytest.raises(TwipError) as refused:
        simulate(loaded, **grouped(**options))
    assert str(refused.value) == said


def test_the_command_line_tells_and_keeps_the_log(faulty_folder, tmp_path, capsys):
    path, log = chain(faulty_folder), tmp_path / "run.mcap"
    demanded = [str(word) for item in demand("step", "abort", 0.5).items() for word in item]
    words = ["run", str(path), "--isolate", "--step-size", "0.1", "--log", str(log), "--start-values", *demanded]
    assert main(words) == 1
    assert capsys.readouterr().err == "twip: bad failed at t = 0.5 s: doStep crashed: SIGABRT (Aborted)\n"
    assert len(playback.read(log).times) == 6


PROGRAM = """
    import sys
    from twip.cosim import CsvSink, Observer, Runtime, load, simulate

    start = {"bad.where": 5, "bad.what": int(sys.argv[3]), "bad.at": 50}
    with load(sys.argv[1], start_values=start) as loaded:
        csv = CsvSink(sys.argv[2], loaded.channels)
        tell = lambda time: print("reached", time, flush=True)
        result = simulate(
            loaded, sinks=[csv], stop_time=1e5, step_size=0.1, observer=Observer(tell),
            runtime=Runtime(isolate=True, time_limit=60),
        )
    sys.exit(128 + result.signal if result.interrupted else 0)
"""


@pytest.fixture
def program(faulty_folder, tmp_path):
    """Starts the program above in a session of its own; kills what is left of it."""
    started = []

    def start(what):
        out = tmp_path / "out.csv"
        arguments = [str(chain(faulty_folder)), str(out), str(WHAT.get(what, 0))]
        process = subprocess.Popen(
            [sys.executable, "-c", textwrap.dedent(PROGRAM), *arguments],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
        )  # fmt: skip
        started.append(process)
        assert process.stdout.readline().startswith("reached")
        return process, out, children(process.pid)

    yield start
    for process in started:
        process.kill()
        process.communicate(timeout=30)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_run_between_two_steps_and_all_its_processes(program, number):
    process, out, pids = program(None)
    assert len(pids) == 2
    os.killpg(process.pid, number)  # as a terminal does: to all in the foreground
    _, errors = process.communicate(timeout=30)
    assert (process.returncode, errors) == (128 + number, "")
    assert gone(pids)
    lines = out.read_text().splitlines()
    assert all(line.count(",") == lines[0].count(",") for line in lines)


@pytest.mark.parametrize("what", [None, "loop"])
def test_processes_do_not_outlive_a_killed_run(program, what):
    process, _, pids = program(what)
    assert len(pids) == 2
    if what == "loop":
        time.sleep(1.0)  # the step from 50 s hangs by now
    process.kill()
    process.wait(timeout=30)
    until = time.monotonic() + 10.0
    while not gone(pids) and time.monotonic() < until:
        time.sleep(0.01)
    assert gone(pids)


def test_two_interrupts_end_a_run_that_hangs(program):
    process, _, pids = program("loop")
    time.sleep(1.0)
    for _ in range(2):
        process.send_signal(signal.SIGINT)
        time.sleep(0.3)
    process.communicate(timeout=30)
    assert process.returncode != 0
    assert gone(pids)
