"""What a sweep costs: the overhead of a run, the memory of a worker, and the throughput of one and two processes.

    python benchmarks/sweep.py overhead        # CPU time per run of everything but stepping
    python benchmarks/sweep.py memory          # memory of one process over 2000 runs
    python benchmarks/sweep.py throughput      # the same runs in one process and in two
    python benchmarks/sweep.py scaling         # CPU time of each further run in one process and in two
    python benchmarks/sweep.py thousand        # 1000 runs of 5 s

Run from the project's root after `twip build`. The overhead is CPU time, which other programs disturb little; the
throughput is wall time and needs a quiet machine.
"""

import argparse
import os
import tempfile
import time
from pathlib import Path

from twip.lab.sweep.axis import Axis
from twip.lab.sweep.plan import Plan
from twip.lab.sweep.run import Outcome, run_sweep
from twip.lab.sweep.worker import Session, Task

RUNS = 200


def plan(count: int, stop_time: float = 5.0) -> Plan:
    """Return runs of the robot with different masses, pitches and seeds."""
    axes = (Axis.parse("plant.body_mass", "1:3:5"), Axis.parse("plant.pitch_start", "0:0.4:5"))
    return Plan(Path("ssp/twip.ssp"), axes, repeat=count // 25, stop_time=stop_time)


def resident() -> float:
    """Return the resident memory of this process in MB."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def session(stop_time: float) -> tuple[Session, list[Task]]:
    """Return a warm session that reuses instances, and its tasks."""
    with tempfile.TemporaryDirectory() as folder:
        outcome = run_sweep(plan(25, stop_time), Path(folder) / "warm.parquet", jobs=1)
    assert outcome.reuse
    opened = Session(outcome.job)
    tasks = [Task(p.number, p.parameter_set, p.start_values) for p in outcome.points]
    opened.row(tasks[0])
    return opened, tasks


def overhead() -> None:
    """Print the CPU time of a run without its steps: a run of one step, and the metrics of a whole one."""
    opened, tasks = session(5.0)
    table = opened.table(tasks[0])
    begin = time.process_time()
    for k in range(RUNS):
        opened.table(tasks[k % len(tasks)], 0.001)
    short = (time.process_time() - begin) / RUNS
    begin = time.process_time()
    for _ in range(RUNS):
        opened.judge.metrics(table)
    judged = (time.process_time() - begin) / RUNS
    begin = time.process_time()
    for k in range(50):
        opened.row(tasks[k % len(tasks)])
    whole = (time.process_time() - begin) / 50
    print(
        f"run of one step {1e3 * short:.1f} ms, metrics {1e3 * judged:.1f} ms: overhead {1e3 * (short + judged):.1f} ms"
    )
    print(f"whole run of 5 s with metrics {1e3 * whole:.0f} ms of CPU time")


def memory() -> None:
    """Print the resident memory over 2000 runs of 1.2 s in one process."""
    opened, tasks = session(1.2)
    for k in range(2001):
        opened.row(tasks[k % len(tasks)])
        if k % 250 == 0:
            print(f"after {k:4} runs {resident():.1f} MB", flush=True)


def done(count: int, jobs: int) -> Outcome:
    """Do a sweep of `count` runs of 5 s."""
    with tempfile.TemporaryDirectory() as folder:
        return run_sweep(plan(count), Path(folder) / "runs.parquet", jobs=jobs)


def throughput() -> None:
    """Print the runs per second of one process and of two, three times in turn."""
    for _ in range(3):
        one, two = done(300, 1), done(300, 2)
        rates = [o.done_now / o.seconds for o in (one, two)]
        print(
            f"1 process {rates[0]:.1f} runs/s, 2 processes {rates[1]:.1f} runs/s: {rates[1] / rates[0]:.2f} times",
            flush=True,
        )


def cpu_time() -> tuple[float, float]:
    """Return the CPU time in s of this process and of its processes that have ended."""
    times = os.times()
    return times.user + times.system, times.children_user + times.children_system


def scaling() -> None:
    """Print the CPU time of each further run: what two free processors would gain, however busy they are now."""
    costs = []
    for jobs in (1, 2):
        spent = []
        for count in (200, 600):
            begin = cpu_time()
            done(count, jobs)
            spent.append([after - before for after, before in zip(cpu_time(), begin, strict=True)])
        own, children = ((long - short) / 400 for long, short in zip(spent[1], spent[0], strict=True))
        costs.append(own + children)
        print(
            f"{jobs} processes: {1e3 * own:.1f} ms in this one, {1e3 * children:.1f} ms in workers, per run", flush=True
        )
    print(f"two free processors would do {2 * costs[0] / costs[1]:.2f} times the runs of one")


def thousand() -> None:
    """Print the wall time of 1000 runs of 5 s at 1 ms with all metrics, start-up included."""
    begin = time.perf_counter()
    outcome = done(1000, 2)
    print(f"{outcome.finished} runs of 5 s: {time.perf_counter() - begin:.0f} s in all, {outcome.errors} errors")


if __name__ == "__main__":
    parts = {part.__name__: part for part in (overhead, memory, throughput, scaling, thousand)}
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("parts", nargs="*", choices=[*parts, []], help="what to measure; default: all")
    for name in parser.parse_args().parts or parts:
        print(name)
        parts[name]()
