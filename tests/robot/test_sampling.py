"""When sampled blocks act (docs: the tick rule)."""

import pytest
from plain import started
from test_closed_loop import BLOCKS, Robot

from twip.robot.sampling import ticks_reached


def acting_steps(step_size, steps, sample_time, offset=0.0, start=0.0):
    """Return the steps (counted from 1) in which a block acts, with the number of ticks handled."""
    ticks, acting = ticks_reached(start, start, sample_time, offset), []
    for k in range(steps):
        reached = ticks_reached((start + k * step_size) + step_size, start, sample_time, offset)
        if reached > ticks:
            acting.append((k + 1, reached - ticks))
            ticks = reached
    return acting


def test_the_sample_at_the_start_is_taken_by_initialize():
    assert ticks_reached(0.0, 0.0, 0.005, 0.0) == 1.0
    assert ticks_reached(0.0, 0.0, 0.005, 0.001) == 0.0


@pytest.mark.parametrize("start", [0.0, 0.3, -2.0, 1000.1])
@pytest.mark.parametrize("step_size", [1e-3, 5e-4, 1e-4])
def test_acts_in_every_step_that_ends_on_a_tick(start, step_size):
    """Rounding of start + k h never delays or repeats a tick."""
    ratio = round(0.005 / step_size)
    steps = 20000
    expected = [(k, 1.0) for k in range(ratio, steps + 1, ratio)]
    assert acting_steps(step_size, steps, 0.005, start=start) == expected


def test_every_tick_acts_when_sample_time_and_step_are_equal():
    assert acting_steps(1e-3, 50000, 1e-3) == [(k, 1.0) for k in range(1, 50001)]


def test_offset_shifts_the_ticks():
    assert [k for k, _ in acting_steps(1e-3, 20, 0.005, offset=0.002)] == [2, 7, 12, 17]


def test_a_tick_between_communication_points_acts_at_the_later_one():
    """Ticks at 5, 10, 15, 20, 25, 30 ms with a step of 3 ms: the steps that end at 6, 12, 15, 21, 27 and 30 ms."""
    assert [3 * k for k, _ in acting_steps(3e-3, 10, 0.005)] == [6, 12, 15, 21, 27, 30]


def test_ticks_within_one_step_are_handled_together():
    assert acting_steps(0.01, 4, 0.005) == [(1, 2.0), (2, 2.0), (3, 2.0), (4, 2.0)]
    assert acting_steps(0.012, 3, 0.005) == [(1, 2.0), (2, 2.0), (3, 3.0)]


def test_ticks_do_not_drift_over_an_hour():
    """A count, not an accumulated time: after an hour the tick number is exact."""
    assert ticks_reached(3600.0, 0.0, 0.005, 0.0) == 720001.0
    assert ticks_reached(3599.999, 0.0, 0.005, 0.0) == 720000.0


def test_ticks_are_right_after_a_thousand_million_seconds():
    """Times around 1e9 s are 1.2e-7 s apart: rounding moves a tick by less than a step, and the count forgives it."""
    assert acting_steps(1e-3, 20000, 0.005, start=1e9) == [(k, 1.0) for k in range(5, 20001, 5)]
    assert acting_steps(1e-3, 5000, 1e-3, start=1e9) == [(k, 1.0) for k in range(1, 5001)]
    for k in (2 * 10**11, 2 * 10**11 + 1):
        assert ticks_reached(k * 0.005, 0.0, 0.005, 0.0) == k + 1.0
        assert ticks_reached(k * 0.005 - 0.001, 0.0, 0.005, 0.0) == k


def test_ticks_are_right_where_a_long_negative_time_ends():
    """Near time 0 it is the start that rounds."""
    assert acting_steps(1e-3, 5000, 0.005, start=-(2.0**20) - 0.3) == [(k, 1.0) for k in range(5, 5001, 5)]
    start = -1e6 - 0.1
    for k in range(200_000_000, 200_000_100):
        assert ticks_reached(start + k * 0.005, start, 0.005, 0.0) == k + 1.0


@pytest.mark.parametrize("start", [2.0**20, -(2.0**20)])
def test_a_tick_comes_no_sooner_at_a_late_start(start):
    """A hundred thousandth of a sample time before the tick is too early, whenever the run began."""
    early, tick = 2.0**-8 * (1 - 1e-5), 2.0**-8
    for begin in (0.0, start):
        assert ticks_reached(begin + early, begin, 2.0**-8, 0.0) == 1.0
        assert ticks_reached(begin + tick, begin, 2.0**-8, 0.0) == 2.0


def closed_loop(start, sample_time, steps):
    """Return the signals of the whole robot with sensor noise, held for 1/16 s, with steps of 2^-10 s."""
    sampled = {"sample_time": sample_time}
    robot = Robot(
        {
            "plant": {"hold_time": 2.0**-4, "pitch_start": 0.3},
            "imu": sampled,
            "estimator": sampled,
            "controller": {**sampled, "rest_time": 2.0**-4},
        }
    )
    for _ in range(4):
        for name, v in robot.order:
            robot.feed(v)
            BLOCKS[name].initialize(v, start)
    order = [(name, v, [x for x in BLOCKS[name].variables if x.causality == "output"]) for name, v in robot.order]
    rows = []
    for k in range(steps):
        for name, v, _ in order:
            robot.feed(v)
            BLOCKS[name].step(v, start + k * 2.0**-10, 2.0**-10)
        rows.append([getattr(v, x.attribute) for _, v, outputs in order for x in outputs])
    return rows


def test_the_closed_loop_does_not_know_when_it_started():
    """Steps, samples and the release fall on times that are exact in binary: every output has the same bits."""
    runs = {start: closed_loop(start, 2.0**-8, 512) for start in (0.0, 2.0**20, -(2.0**20))}
    assert runs[2.0**20] == runs[0.0]
    assert runs[-(2.0**20)] == runs[0.0]
    voltages = {tuple(row[-5:]) for row in runs[0.0]}
    assert 100 < len(voltages) <= 1 + 512 // 4  # the controller has acted at its samples alone


@pytest.mark.parametrize("start", [0.0, 2.0**20, 1e9])
def test_the_release_comes_after_the_hold_time(start):
    """Held in the steps that begin before the release, and in no other; the first in which it moves is the 101st."""
    plant = started(BLOCKS["plant"], start, pitch_start=0.3, hold_time=0.1)
    for k in range(101):
        assert plant.pitch == 0.3
        BLOCKS["plant"].step(plant, start + k * 1e-3, 1e-3)
    assert plant.pitch > 0.3


@pytest.mark.parametrize("start", [0.0, 2.0**20])
def test_the_release_is_not_early(start):
    """A step that begins 2^-16 s (15 us) before the release is one in which the robot is held."""
    plant = started(BLOCKS["plant"], start, pitch_start=0.3, hold_time=0.125)
    BLOCKS["plant"].step(plant, start + 0.125 - 2.0**-16, 1e-3)
    assert plant.pitch == 0.3
    BLOCKS["plant"].step(plant, start + 0.125, 1e-3)
    assert plant.pitch > 0.3


def test_a_master_that_adds_up_its_steps_gets_its_ticks_in_time():
    """0.001 added up is off by some 1e-11 s after a minute, more than the rounding of a single sum."""
    time, acted = 0.0, 1.0
    for k in range(1, 60_001):
        time += 0.001
        reached = ticks_reached(time, 0.0, 0.005, 0.0)
        assert (reached > acted) == (k % 5 == 0), k
        acted = reached
