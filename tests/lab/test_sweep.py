"""Sweeps of a small system: what runs, what comes out, and that nothing but the plan decides it."""

import json
import os
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pyarrow.parquet as parquet
import pytest
from sweep_system import decayed, make_system

from twip.cosim.fmus.component import Instance
from twip.errors import TwipError
from twip.lab.sweep.axis import Axis
from twip.lab.sweep.design import run_seed
from twip.lab.sweep.journal import Journal
from twip.lab.sweep.parquet import Results
from twip.lab.sweep.plan import ParameterSet, Plan
from twip.lab.sweep.run import run_sweep
from twip.lab.sweep.worker import Session

RUNS = 24


@pytest.fixture(scope="module")
def system(tmp_path_factory):
    return make_system(tmp_path_factory.mktemp("decay"))


@pytest.fixture
def plan(system):
    """Two parameter sets, a grid of three, two samples of a distribution, two repetitions."""
    return Plan(
        system,
        (Axis.parse("d.x_start", "1:5:3"), Axis.parse("seconds", "uniform(1, 2)", ["d.rate"])),
        design="lhs",
        samples=4,
        repeat=2,
        metrics=("final:d.x", "final:d.drawn"),
        success=("final:d.x < 0.5",),
        step_size=0.125,
    )


def sweep(plan, path, **options):
    outcome = run_sweep(plan, path, **{"jobs": 1, **options})
    return outcome, Results.read(path)


@pytest.fixture(scope="module")
def reference(system, tmp_path_factory):
    """The bytes of the sweep that the tests below do in other ways, done in one process in order."""
    path = tmp_path_factory.mktemp("reference") / "sweep.parquet"
    run_sweep(many(system), path, jobs=1)
    return path.read_bytes()


def many(system, **changes):
    axes = (Axis.parse("d.x_start", "1:12:12"), Axis.parse("d.rate", "0.5,2"))
    return Plan(system, axes, metrics=("final:d.x", "max:d.drawn"), step_size=0.125, **changes)


def test_rows_hold_inputs_seed_verdict_and_metrics(plan, tmp_path):
    outcome, results = sweep(plan, tmp_path / "out.parquet")
    columns = results.columns
    assert list(columns) == [
        *("run", "d.x_start", "seconds", "seed", "verdict", "error", "final:d.x", "final:d.drawn", "start_values"),
    ]
    assert columns["run"] == list(range(RUNS))
    assert (outcome.runs, outcome.finished, outcome.errors, outcome.reuse) == (RUNS, RUNS, 0, True)
    assert columns["d.x_start"] == [x for x in (1.0, 3.0, 5.0) for _ in range(8)]
    for k in range(RUNS):
        expected = decayed(columns["d.x_start"][k], columns["seconds"][k])
        assert columns["final:d.x"][k] == pytest.approx(expected, rel=1e-14)  # eight products of one exponential
        assert columns["seed"][k] == run_seed(1, k)
        assert columns["final:d.drawn"][k] == run_seed(1, k) / 2.0**31
        assert columns["verdict"][k] == ("pass" if columns["final:d.x"][k] < 0.5 else "fail")
        words = columns["start_values"][k].split()
        assert words[::2] == ["d.x_start", "d.rate", "d.seed"]
        assert [float(w) for w in words[1::2]] == [columns[n][k] for n in ("d.x_start", "seconds", "seed")]
    assert outcome.passed == columns["verdict"].count("pass")
    assert 0 < outcome.passed < RUNS
    told = json.loads(parquet.read_schema(tmp_path / "out.parquet").metadata[b"twip"])
    assert len(told["sweep"]["provenance"][""]["component d"]["sha256"]) == 64
    assert told["versions"].keys() >= {"python", "twip", "numpy", "fmpy"}


def test_latin_hypercube_puts_one_sample_into_each_quarter(plan, tmp_path):
    _, results = sweep(plan, tmp_path / "out.parquet")
    samples = results.columns["seconds"][:8:2]
    assert sorted(int((s - 1.0) / 0.5) for s in samples) == [0, 1, 2, 3]
    assert results.columns["seconds"] == [s for s in samples for _ in range(2)] * 3


def test_parameter_sets_and_factors_multiply_what_is_there(system, tmp_path):
    sets = (ParameterSet("as it is"), ParameterSet("quick", (system.parent / "rate3.ssv",)))
    plan = Plan(system, (Axis.parse("d.rate", "x0.5,2"),), sets, metrics=("final:d.x",), step_size=0.125)
    _, results = sweep(plan, tmp_path / "out.parquet")
    assert results.columns["parameters"] == ["as it is"] * 2 + ["quick"] * 2
    assert results.columns["d.rate"] == [0.5, 2.0, 0.5, 2.0]
    # rates 1 and 3 times the factors
    np.testing.assert_allclose(results.columns["final:d.x"], [decayed(1, r) for r in (0.5, 2, 1.5, 6)], rtol=1e-14)


@pytest.mark.parametrize("options", [{"jobs": 2, "shuffle": True}, {"jobs": 1, "shuffle": True}])
def test_the_file_is_the_same_however_the_runs_are_done(system, reference, tmp_path, options):
    run_sweep(many(system), tmp_path / "out.parquet", **options)
    assert (tmp_path / "out.parquet").read_bytes() == reference


KILLED = """
import sys
from pathlib import Path
sys.path.insert(0, sys.argv[3])
from test_sweep import many
from twip.lab.sweep.run import run_sweep
import twip.lab.sweep.engine as engine
import time, signal, os
engine.BATCH_TIME = 0.0
def stop(done, total):
    if done >= 7:
        os.kill(os.getpid(), signal.SIGKILL)
run_sweep(many(Path(sys.argv[1])), Path(sys.argv[2]), jobs=int(sys.argv[4]), progress=stop)
"""


@pytest.mark.parametrize("jobs", [1, pytest.param(2, marks=pytest.mark.heavy)])
def test_a_killed_sweep_is_resumed_to_the_same_file(system, reference, tmp_path, jobs):
    out = tmp_path / "out.parquet"
    words = [sys.executable, "-c", KILLED, str(system), str(out), str(Path(__file__).parent), str(jobs)]
    killed = subprocess.run(words, capture_output=True, timeout=60)
    assert killed.returncode == -signal.SIGKILL
    assert not out.exists()
    journal = tmp_path / "out.parquet.runs"
    with journal.open("ab") as file:
        file.write(b'{"number": 20, "verd')  # a line that the crash has cut off
    with pytest.raises(TwipError, match="--resume does the rest"):
        run_sweep(many(system), out, jobs=1)
    outcome = run_sweep(many(system), out, jobs=1, resume=True)
    assert 1 <= outcome.done_now < RUNS
    assert out.read_bytes() == reference
    assert not journal.exists()


@pytest.mark.parametrize("length", [0, 5, 60])
@pytest.mark.parametrize("resume", [False, True])
def test_a_journal_that_is_cut_off_in_its_first_line_is_begun_anew(system, reference, tmp_path, length, resume):
    out, journal = tmp_path / "out.parquet", tmp_path / "out.parquet.runs"
    Journal(journal, many(system).describe(many(system).systems()), resume=False).close(forget=False)
    whole = journal.read_bytes()
    assert whole.index(b"\n") > 60
    journal.write_bytes(whole[:length])
    assert run_sweep(many(system), out, jobs=1, resume=resume).done_now == RUNS
    assert out.read_bytes() == reference
    assert not journal.exists()


@pytest.mark.parametrize("content", [b"mine", b"mine\n", b'{"format": "other"}\n', b'{"format": "twip sweep 1"}\n'])
def test_a_file_that_is_no_journal_is_kept_and_the_way_out_told(system, tmp_path, content):
    journal = tmp_path / "out.parquet.runs"
    journal.write_bytes(content)
    for resume in (False, True):
        with pytest.raises(TwipError, match=r"runs is no journal of a sweep: remove it, or take another --out$"):
            run_sweep(many(system), tmp_path / "out.parquet", jobs=1, resume=resume)
    assert journal.read_bytes() == content


def test_a_full_disk_at_the_first_line_of_a_journal_blocks_no_later_sweep(system, tmp_path):
    out = tmp_path / "out.parquet"
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20, limits[1]))
    try:
        with pytest.raises(TwipError, match=r"out\.parquet\.runs: cannot be written \(File too large\)"):
            run_sweep(many(system), out, jobs=1)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, handler)
    assert run_sweep(many(system), out, jobs=1).done_now == RUNS


def test_only_the_same_sweep_is_resumed(system, tmp_path):
    out = tmp_path / "out.parquet"
    with pytest.raises(TwipError, match="there is no unfinished sweep to resume"):
        run_sweep(many(system), out, jobs=1, resume=True)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("twip.lab.sweep.run.write", interrupt)  # as the file is about to be written
        with pytest.raises(KeyboardInterrupt):
            run_sweep(many(system), out, jobs=1)
    with pytest.raises(TwipError, match=r"belongs to another sweep: seed, FMUs, parameters or start values differ"):
        run_sweep(many(system, seed=2, start_values={"d.fault": "slow"}), out, jobs=1, resume=True)
    assert run_sweep(many(system), out, jobs=1, resume=True).done_now == 0


def interrupt(*_):
    raise KeyboardInterrupt


def test_ctrl_c_keeps_what_is_finished(system, reference, tmp_path):
    out = tmp_path / "out.parquet"

    def progress(done, _total):
        if done >= 5:
            raise KeyboardInterrupt

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("twip.lab.sweep.engine.BATCH_TIME", 0.0)
        outcome = run_sweep(many(system), out, jobs=1, progress=progress)
    assert (outcome.interrupted, outcome.finished) == (True, 5)
    results = Results.read(out)
    assert (results.columns["run"], results.runs) == ([0, 1, 2, 3, 4], RUNS)
    assert run_sweep(many(system), out, jobs=1, resume=True).done_now == RUNS - 5
    assert out.read_bytes() == reference


def test_a_failed_run_is_a_row_with_its_error(system, tmp_path):
    axes = (Axis.parse("d.fault", "none,raise"), Axis.parse("d.x_start", "1,2"))
    _, results = sweep(Plan(system, axes, metrics=("final:d.x",), step_size=0.25), tmp_path / "out.parquet")
    assert results.columns["verdict"] == ["done", "done", "error", "error"]
    assert results.columns["final:d.x"][2:] == [None, None]
    assert "d failed at t = 0 s: fmi2DoStep returned fatal" in results.columns["error"][2]
    assert results.columns["error"][0] is None


def test_a_run_that_kills_its_process_is_a_row_and_the_others_are_done(system, tmp_path):
    start = {"d.fault": "die at 2"}
    plan = Plan(system, (Axis.parse("d.x_start", "1:6:6"),), start_values=start, metrics=("final:d.x",), step_size=0.25)
    _, results = sweep(plan, tmp_path / "out.parquet", jobs=2)
    assert results.columns["verdict"] == ["done", "error", *["done"] * 4]
    assert results.columns["error"][1] == "its process ended: killed by SIGKILL"
    finals = [x for x in results.columns["final:d.x"] if x is not None]
    np.testing.assert_allclose(finals, [decayed(x, 1) for x in (1, 3, 4, 5, 6)], rtol=1e-14)


@pytest.mark.heavy
def test_a_worker_that_is_killed_from_outside_costs_nothing(system, tmp_path):
    plan = many(system, start_values={"d.fault": "slow"})
    killed = []

    def progress(done, _total):
        if done >= 3 and not killed:
            children = Path(f"/proc/self/task/{os.getpid()}/children").read_text().split()
            killed.extend(c for c in children if b"loky.backend.popen" in Path(f"/proc/{c}/cmdline").read_bytes())
            os.kill(int(killed[0]), signal.SIGKILL)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("twip.lab.sweep.engine.BATCH_TIME", 0.0)
        outcome = run_sweep(plan, tmp_path / "out.parquet", jobs=2, progress=progress)
    assert killed
    assert (outcome.finished, outcome.errors) == (RUNS, 0)
    run_sweep(plan, tmp_path / "again.parquet", jobs=1)
    assert (tmp_path / "out.parquet").read_bytes() == (tmp_path / "again.parquet").read_bytes()


def forgetful(instance):
    """End a run without resetting the FMU."""
    instance._initialized = False
    return True


def test_an_fmu_that_a_reset_does_not_renew_is_instantiated_for_each_run(system, tmp_path, monkeypatch):
    axes = (Axis.parse("d.x_start", "1,2,4"),)
    plan = Plan(system, axes, start_values={"d.fault": "remember"}, metrics=("final:d.x",), step_size=0.25)
    assert sweep(plan, tmp_path / "renewed.parquet")[0].reuse
    monkeypatch.setattr(Instance, "reset", forgetful)
    told = []
    outcome, _ = sweep(plan, tmp_path / "out.parquet", notice=told.append)
    assert not outcome.reuse
    assert "an FMU is not as new after a reset: every run instantiates all" in told
    assert (tmp_path / "out.parquet").read_bytes() == (tmp_path / "renewed.parquet").read_bytes()


def test_workers_refuse_an_fmu_that_has_changed(system, tmp_path):
    outcome, _ = sweep(many(system), tmp_path / "out.parquet")
    other = {**vars(outcome.job), "fingerprints": {"d": "0" * 64}}
    with pytest.raises(TwipError, match=r"d: SweepDecay\.fmu is another one than when the sweep began"):
        Session(type(outcome.job)(**other))


def test_a_second_sweep_into_the_same_file_is_refused(system, tmp_path):
    out = tmp_path / "out.parquet"

    def progress(done, _total):
        if done:
            with pytest.raises(TwipError, match="is being written by another run"):
                run_sweep(many(system), out, jobs=1, resume=True)

    assert run_sweep(many(system), out, jobs=1, progress=progress).finished == RUNS


DASK = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard"]


@pytest.fixture(scope="module")
def scheduler(tmp_path_factory):
    """The address of a Dask scheduler on TCP and its two workers as processes."""
    folder = tmp_path_factory.mktemp("dask")
    file = folder / "scheduler.json"
    environment = {**os.environ, "DASK_DISTRIBUTED__WORKER__DAEMON": "False"}
    options = {"env": environment, "cwd": folder, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    processes = [subprocess.Popen([*DASK, "--scheduler-file", str(file)], **options)]
    try:
        deadline = time.monotonic() + 30
        while not file.exists():
            assert time.monotonic() < deadline
            time.sleep(0.05)
        address = json.loads(file.read_text())["address"]
        worker = [sys.executable, "-m", "distributed.cli.dask_worker", address, "--nthreads", "1", "--no-dashboard"]
        processes += [subprocess.Popen([*worker, "--no-nanny"], **options) for _ in range(2)]
        yield address, processes[1:]
    finally:
        for process in processes:
            process.kill()
            process.wait()


def test_a_cluster_gives_the_same_file_also_when_a_worker_is_killed(system, reference, tmp_path, scheduler):
    address, workers = scheduler
    run_sweep(many(system), tmp_path / "whole.parquet", dask=address)
    assert (tmp_path / "whole.parquet").read_bytes() == reference

    def progress(done, _total):
        if done >= RUNS // 3 and workers[0].poll() is None:
            workers[0].kill()
            workers[0].wait()

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("twip.lab.sweep.engine.BATCH_TIME", 0.0)
        run_sweep(many(system), tmp_path / "out.parquet", dask=address, progress=progress)
    assert workers[0].returncode == -signal.SIGKILL
    assert (tmp_path / "out.parquet").read_bytes() == reference
