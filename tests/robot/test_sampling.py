"""When sampled blocks act (docs: the tick rule)."""

import pytest

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
