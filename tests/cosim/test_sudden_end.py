"""FMUs that end, copy or cripple the process of the run: it is told, and the status is not 0."""

import signal
import subprocess
import sys

import pytest
from c_fmu import chain, demand
from ssp_writer import component, system, write

from twip.cosim.log import playback

ADVICE = "; with --isolate such an FMU ends the run cleanly\n"


def run(path, demands, *options):
    """Run the command in a process of its own."""
    given = [word for name, value in demands.items() for word in (name, str(value))]
    words = ["run", str(path), "--stop-time", "10", "--step-size", "0.01", "--log", "run.mcap", *options]
    return subprocess.run(
        [sys.executable, "-m", "twip.cli", *words, *(["--start-values", *given] if given else [])],
        cwd=path.parent, capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip


@pytest.mark.parametrize(("what", "said"), [("leave", "exit(0)"), ("vanish", "_exit(0)"), ("quit", "exit(3)")])
def test_an_exit_in_a_step_is_told_and_fails(faulty_folder, what, said, loop):
    done = run(chain(faulty_folder), demand("step", what, 5.0), "--loop", loop)
    assert done.stderr == f"twip: good, bad (faulty.fmu) called {said} at t = 5 s and ended the process{ADVICE}"
    assert done.returncode == (3 if what == "quit" else 1)
    left = playback.read(faulty_folder / "run.mcap")
    assert not left.complete
    assert len(left.times) == 400


@pytest.mark.parametrize("where", ["enter", "terminate", "free"])
def test_an_exit_outside_of_steps_is_told_too(faulty_folder, where):
    done = run(chain(faulty_folder), demand(where, "leave"))
    assert done.stderr.startswith("twip: good, bad (faulty.fmu) called exit(0) at t = ")
    assert done.returncode == 1


@pytest.mark.parametrize(("what", "name"), [("crash", "SIGSEGV"), ("abort", "SIGABRT")])
def test_a_crash_is_told_and_remains_one(faulty_folder, what, name, loop):
    done = run(chain(faulty_folder), demand("step", what, 5.0), "--loop", loop)
    assert done.stderr.endswith(
        f"twip: good, bad (faulty.fmu) crashed with {name} at t = 5 s and ended the process{ADVICE}"
    )
    assert done.returncode == -signal.Signals[name]


SLAVE = """
import ctypes, os
from pythonfmu import Fmi2Causality, Fmi2Slave, Real
class {name}(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.y = 0.0
        self.register_variable(Real("y", causality=Fmi2Causality.output))
    def do_step(self, time, step):
        if time > 0.995:
            {deed}
        return True
"""


@pytest.mark.parametrize(("deed", "said"), [("os._exit(0)", "os._exit(0)"), ("ctypes.CDLL(None).exit(0)", "exit")])
def test_python_code_of_an_fmu_is_named(tmp_path, deed, said):
    for name in ("Harmless", "Rude"):
        source = SLAVE.format(name=name, deed="pass" if name == "Harmless" else deed)
        (tmp_path / f"{name.lower()}.py").write_text(source)
        builder = "import sys; from pythonfmu.builder import FmuBuilder; FmuBuilder.build_FMU(sys.argv[1], dest='.')"
        command = [sys.executable, "-c", builder, f"{name.lower()}.py"]
        subprocess.run(command, check=True, capture_output=True, cwd=tmp_path)
    path = write(tmp_path, system([component("a", "Harmless.fmu", "y<"), component("b", "Rude.fmu", "y<")]))
    done = run(path, {})
    assert done.stderr.endswith(f"twip: b (Rude.fmu) called {said} at t = 1 s and ended the process{ADVICE}")
    assert done.returncode == 1


def test_closed_descriptors_are_told(faulty_folder):
    done = run(chain(faulty_folder), demand("step", "close", 5.0))
    assert done.stderr.splitlines()[-1] == (
        "twip: log 'run.mcap' cannot be written: an FMU or something else in this process has closed its descriptor"
    )
    assert done.returncode == 1


@pytest.mark.parametrize("option", [[], ["--json"]])
def test_a_closed_standard_output_is_told_and_the_log_is_whole(faulty_folder, option):
    done = run(chain(faulty_folder), demand("step", "mute", 5.0), *option)
    assert done.stderr == "twip: standard output cannot be written: Bad file descriptor\n"
    assert done.returncode == 1
    assert playback.read(faulty_folder / "run.mcap").complete


def test_a_log_that_is_removed_meanwhile_is_told(faulty_folder):
    done = run(chain(faulty_folder), demand("step", "remove", 9.99))
    assert done.stderr.splitlines()[-1] == (
        "twip: log 'run.mcap' cannot be written: something else has removed, moved or replaced it meanwhile"
    )
    assert done.returncode == 1


@pytest.mark.parametrize("isolate", [False, True])
def test_a_fork_leaves_one_writer(faulty_folder, isolate):
    done = run(chain(faulty_folder), demand("step", "fork", 5.0), *(["--isolate"] if isolate else []))
    assert done.returncode == 0, done.stderr
    assert (" has forked process " in done.stderr) is not isolate
    left = playback.read(faulty_folder / "run.mcap")
    assert left.complete
    assert left.times.tolist() == [k * 10_000_000 / 1e9 for k in range(1001)]
    assert left["bad.y"].tolist() == [float(k) for k in range(1001)]


AFTERWARDS = """
import ctypes, os, sys
from twip.cosim import load, simulate
with load(sys.argv[1]) as loaded:
    simulate(loaded, step_size=0.1, stop_time=1.0)
{deed}
"""


@pytest.mark.parametrize(
    ("deed", "status"),
    [
        ("", 0),
        ("os._exit(0)", 0),
        ("ctypes.CDLL(None).exit(0)", 0),
        ("sys.exit(4)", 4),
        ("import subprocess\ntry: subprocess.run(['/no/such'])\nexcept OSError: sys.exit(5)", 5),
        ("os.kill(os.getpid(), 11)", -11),
    ],
)
def test_after_a_run_a_process_ends_as_it_likes(faulty_folder, deed, status):
    program = AFTERWARDS.format(deed=deed)
    command = [sys.executable, "-c", program, chain(faulty_folder)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode, done.stderr) == (status, "")
