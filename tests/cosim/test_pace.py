"""Runs in real time: deadlines by a clock that the test owns, and by the computer's."""

import os
import signal
import threading
import time

import pytest
from ssp_writer import component, system, write

from twip.cosim import Runtime, Table, load, simulate
from twip.cosim.run.interrupt_flag import InterruptFlag
from twip.cosim.run.pace import Pacer, RealTime
from twip.errors import TwipError


class Steps:
    """A clock that stands still except while somebody sleeps, or works for as long as the test says."""

    def __init__(self):
        self.time = 100.0
        self.slept = []

    def now(self):
        return self.time

    def sleep(self, duration):
        self.slept.append(duration)
        self.time += duration


@pytest.fixture
def path(folder):
    return write(folder, system([component("a", "CosimIntegrator.fmu"), component("f", "CosimFaulty.fmu")]))


def test_a_late_chunk_moves_no_later_deadline():
    clock, flag = Steps(), InterruptFlag()
    pacer = Pacer(2.0, clock)
    assert pacer.chunk(0.001) == 20  # 10 ms of wall time at two simulated seconds per second
    assert pacer.chunk(5.0) == 1
    pacer.start(1.0)
    for at, work in ((1.5, 0.0), (2.0, 0.375), (2.5, 0.0), (3.0, 0.25)):
        clock.time += work
        pacer.wait(at, flag)
        if at == 2.0:
            assert clock.time == 100.625  # 0.125 s late
    assert clock.time == 101.0
    assert pacer.report == RealTime(2.0, deadlines=4, missed=1, worst_lateness=0.125)
    assert max(clock.slept) <= 0.1
    assert str(pacer.report) == "1 of 4 deadlines missed, at worst by 125 ms (factor 2)"


def test_a_wait_ends_with_an_interrupt():
    clock, flag = Steps(), InterruptFlag()
    pacer = Pacer(1.0, clock)
    pacer.start(0.0)
    flag.array[0] = True
    pacer.wait(60.0, flag)
    assert clock.slept == []


@pytest.mark.parametrize("factor", [0.0, -1.0, float("nan"), float("inf")])
def test_a_bad_factor_is_refused(path, factor):
    with load(path) as loaded, pytest.raises(TwipError, match=r"real-time factor .* must be a positive number"):
        simulate(loaded, step_size=0.1, runtime=Runtime(real_time=factor))


def test_pacing_takes_its_time_and_changes_no_result(path, loop):
    tables = []
    for factor in (None, 4.0):
        with load(path) as loaded:
            table = Table(loaded.channels)
            begin = time.perf_counter()
            result = simulate(
                loaded, step_size=0.01, stop_time=1.0, sinks=[table], runtime=Runtime(loop=loop, real_time=factor)
            )
            elapsed = time.perf_counter() - begin
        tables.append(table.values.tobytes())
    assert tables[0] == tables[1]
    assert elapsed >= 0.25
    assert result.wall_time >= 0.25
    assert result.real_time.deadlines == 25  # of 4 steps, 10 ms each
    (said,) = [e.text for e in table.events if e.text.startswith("real time: ")]
    assert said == f"real time: {result.real_time}"


def test_missed_deadlines_are_counted(folder, loop):
    # each step sleeps 10 ms and is to take 1 ms: the end comes at least 90 ms late, the first at least 9 ms
    path = write(folder, system([component("f", "CosimFaulty.fmu")]))
    with load(path, start_values={"f.fault": "slow"}) as loaded:
        result = simulate(loaded, step_size=0.01, stop_time=0.1, runtime=Runtime(loop=loop, real_time=10.0))
    assert result.real_time.deadlines == result.real_time.missed == 1
    with load(path, start_values={"f.fault": "slow"}) as loaded:
        result = simulate(loaded, step_size=0.01, stop_time=0.1, runtime=Runtime(loop=loop, real_time=2.0))
    assert result.real_time.deadlines == result.real_time.missed == 5
    assert result.real_time.worst_lateness >= 0.05


def test_an_interrupt_ends_the_wait_for_a_long_step(path, loop):
    # one step is 50 s of wall time
    timer = threading.Timer(1.5, os.kill, (os.getpid(), signal.SIGINT))
    with load(path) as loaded:
        simulate(loaded, step_size=0.1, runtime=Runtime(loop=loop))  # compiled, unpacked
        timer.start()
        begin = time.perf_counter()
        result = simulate(loaded, step_size=0.5, stop_time=1.0, runtime=Runtime(loop=loop, real_time=0.01))
    assert result.interrupted
    assert time.perf_counter() - begin < 2.5
