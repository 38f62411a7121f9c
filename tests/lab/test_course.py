"""The verdict that is formed while the robot runs is that on the whole record, however the rows come."""

from math import radians

import numpy as np
import pytest
from test_metrics import Columns, record

from twip.cosim.model.signals import Channel, Signal
from twip.lab.course import SIGNALS, Course
from twip.lab.metrics import judge

CHANNELS = [Channel("plant", tuple(Signal(s.partition(".")[2], "Real", None, "output") for s in ("plant.x", *SIGNALS)))]


def with_fall(at):
    found = record()
    found["plant.fallen"] = np.where(Columns.times >= at, 1.0, 0.0)
    return found


def pushed():
    found = record()
    late = radians(4.0) * ((Columns.times >= 6.0) & (Columns.times < 7.5))
    found["plant.pitch"] = found["plant.pitch"] + late
    return found


def quick():
    """Upright one row after the release."""
    found = record()
    found["plant.pitch"] = np.where(Columns.times <= 1.0, radians(20.0), 0.0)
    return found


RUNS = {
    "balanced": record(),
    "offset": record(final=radians(0.7), swing=radians(8.0)),
    "leaning": record(final=radians(1.5)),
    "pushed": pushed(),
    "quick": quick(),
    "fell": with_fall(1.5),
    "fell at once": with_fall(0.0),
    "too short": record().part(0.0, 2.0),
    "held": record().part(0.0, 0.9),
    "one row": record().part(0.0, 0.0),
    "moving from its first row": record().part(5.0, 10.0),
    "continued": record().part(5.0, 10.0, continued=True),
    "continued before its release": record().part(0.5, 10.0, continued=True),
    "continued, then fell": with_fall(6.0).part(4.0, 10.0, continued=True),
    "continued after a fall": with_fall(6.0).part(7.0, 10.0, continued=True),
}


@pytest.mark.parametrize("size", [1, 7, 200, 100_000])
@pytest.mark.parametrize("name", RUNS)
def test_the_verdict_is_that_on_the_whole_record(name, size):
    run = RUNS[name]
    expected = judge(run)
    rows = np.column_stack([np.full(len(run.times), 9.0), *(run[signal] for signal in SIGNALS)])
    course = Course(CHANNELS, run.continued)
    assert course.verdict() is None
    course.write(run.times[:0], rows[:0])
    for k in range(0, len(rows), size):
        course.write(run.times[k : k + size], rows[k : k + size])
    found = course.verdict()
    assert found.sentence() == expected.sentence()
    assert (found.decided, found.balanced) == (expected.decided, expected.balanced)
    np.testing.assert_equal(dict(found.metrics), {metric: expected.metrics[metric] for metric in found.metrics})
