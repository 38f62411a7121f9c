"""The metrics of a run, on a record whose answers are known in closed form."""

from math import inf, isnan, radians

import numpy as np
import pytest

from twip.errors import TwipError
from twip.lab.metrics import BLOCKS, METRICS, REQUIRED, is_robot, judge, measure

HELD, DECAY, START = 1.0, 0.2, radians(20.0)


class Columns(dict):
    """A record: signals by name, and times."""

    times = np.linspace(0.0, 10.0, 10001)
    continued = False

    def part(self, first, last, continued=False):
        """Return the rows from `first` to `last` s."""
        keep = (self.times >= first) & (self.times <= last)
        found = Columns({name: values[keep] for name, values in self.items()})
        found.times, found.continued = self.times[keep], continued
        return found


def record(final=0.0, swing=0.0):
    """Held for 1 s, then from 20 degrees exponentially to `final`, with a bump of -`swing` at 2 s; all in rad."""
    times = Columns.times
    since = np.maximum(0.0, times - HELD)
    pitch = final + (START - final) * np.exp(-since / DECAY) - swing * np.exp(-(((times - 2.0) / 0.05) ** 2))
    pitch[times <= HELD] = START
    zero, volts = np.zeros_like(times), np.where(times < 5.0, 3.0, -4.0)
    found = Columns.fromkeys((*REQUIRED, *BLOCKS), zero)
    found.update({"plant.pitch": pitch, "plant.pitch_rate": np.where(times > HELD, -1.0, 0.0)})
    found.update({"left.voltage": volts, "right.voltage": zero})
    found.update({"left.current": zero + 0.5, "estimator.pitch": pitch + np.where(times >= HELD, 0.01, 0.5)})
    return found


def test_a_decaying_pitch_has_the_metrics_of_an_exponential():
    found = measure(record())
    assert found["balanced"] == 1.0
    assert found["fallen_at"] == inf
    assert found["release_time"] == HELD
    # into 1 degree after DECAY * ln(20), on the grid of 1 ms
    assert found["settling_time"] == pytest.approx(DECAY * np.log(20.0), abs=1e-3)
    assert found["pitch_overshoot"] == 0.0
    assert found["peak_pitch_settled"] == pytest.approx(START * np.exp(-3.0 / DECAY), rel=1e-6)
    assert found["steady_state_error"] < found["peak_pitch_settled"]
    assert found["peak_voltage"] == 4.0
    assert found["energy"] == pytest.approx(0.5 * (3.0 * 4.999 - 4.0 * 5.001))  # a row holds the step that ends there
    assert found["estimator_error"] == pytest.approx(0.01)  # before the release it does not count


def test_offset_and_swing_are_measured():
    found = judge(record(final=radians(0.7), swing=radians(8.0)))
    assert found.balanced
    assert found.text("steady_state_error") == "0.70°"
    assert found.metrics["pitch_overshoot"] == pytest.approx(radians(8.0 - 0.7), rel=0.02)  # the decay's rest at 2 s
    assert found.sentence() == "balanced: |pitch| < 1° from 3 s after release on, at most 0.70°"


def test_a_leaning_robot_is_not_balanced():
    found = judge(record(final=radians(1.5)))
    assert not found.balanced
    assert found.sentence().startswith("stands, not settled: |pitch| > 1°")
    assert found.text("settling_time") == "not reached"


def test_a_robot_that_is_pushed_and_settles_again_is_told_from_one_that_does_not():
    pushed = record()
    pushed["plant.pitch"] = pushed["plant.pitch"] + radians(4.0) * ((Columns.times >= 6.0) & (Columns.times < 7.5))
    found = judge(pushed)
    assert not found.balanced
    assert found.sentence() == (
        "stands, settled late: |pitch| > 1° later than 3 s after release, at most 4.00°; within it from 7.50 s on"
    )


def test_absurd_values_of_a_failing_run_stay_short():
    failing = record()
    failing["estimator.pitch"] = np.where(Columns.times > 9.999, 1e99, failing["plant.pitch"])
    assert judge(failing).text("estimator_error") == "5.73e+100°"


def test_what_only_a_release_tells_is_not_told_of_a_continuation():
    found = judge(record().part(5.0, 10.0, continued=True))
    assert found.sentence() == "stands from 5 s to 10 s; not judged, for it was released before"
    assert not found.balanced
    assert not found.decided
    of_release = ("balanced", "release_time", "steady_state_error", "peak_pitch_settled")
    since_release = (*of_release, "pitch_overshoot", "settling_time")
    assert {name for name, value in found.metrics.items() if isnan(value)} == set(since_release)
    assert found.metrics["estimator_error"] == pytest.approx(0.01)
    assert found.metrics["energy"] == pytest.approx(-0.5 * 4.0 * 5.0)
    fresh = judge(record().part(5.0, 10.0))  # the same rows of a run of their own: released as it begins
    assert fresh.release == 5.0


def test_a_continuation_that_holds_the_release_is_judged():
    assert judge(record().part(0.5, 10.0, continued=True)).sentence() == judge(record()).sentence()


@pytest.mark.parametrize(("since", "sentence"), [(4.0, "fell at 6.000 s"), (7.0, "fell before 7.000 s")])
def test_a_fall_is_told_of_a_continuation_too(since, sentence):
    fallen = record()
    fallen["plant.fallen"] = np.where(Columns.times >= 6.0, 1.0, 0.0)
    found = judge(fallen.part(since, 10.0, continued=True))
    assert found.sentence() == sentence
    assert found.decided
    assert found.metrics["balanced"] == 0.0


def test_a_fall_is_told_with_its_time():
    fallen = record()
    fallen["plant.fallen"] = np.where(Columns.times >= 1.5, 1.0, 0.0)
    assert judge(fallen).sentence() == "fell at 1.500 s"
    assert not judge(fallen).balanced


def test_what_assumes_standing_is_not_told_after_a_fall():
    fallen = record()
    fallen["plant.fallen"] = np.where(Columns.times >= 9.9, 1.0, 0.0)  # even where the rows before would have done
    found = judge(fallen)
    untold = [name for name, value in found.metrics.items() if isnan(value)]
    assert untold == [
        *("steady_state_error", "peak_pitch_settled", "pitch_overshoot", "settling_time", "estimator_error")
    ]
    assert {found.text(name) for name in untold} == {"–"}
    assert found.metrics["balanced"] == 0.0
    assert found.metrics["energy"] == measure(record())["energy"]


@pytest.mark.parametrize(
    ("until", "sentence"), [(2.0, "ended 1 s after release, too early to tell"), (0.9, "not released")]
)
def test_a_short_record_is_not_judged(until, sentence):
    found = judge(record().part(0.0, until))
    assert found.sentence() == sentence
    assert not found.balanced
    assert not found.decided
    assert all(isnan(found.metrics[name]) for name in ("peak_pitch_settled", "steady_state_error", "settling_time"))
    assert found.text("settling_time") == "–"


def test_no_rows_and_no_robot():
    empty = Columns({name: np.zeros(0) for name in REQUIRED})
    empty.times = np.zeros(0)
    with pytest.raises(TwipError, match="no rows"):
        measure(empty)
    assert is_robot(record())
    assert not is_robot(["plant.pitch"])
    assert set(measure(record())) == set(METRICS)


def test_another_controller_or_estimator_is_judged_too():
    """Only what needs the estimator's pitch cannot be told without it."""
    whole, bare = record(), record()
    for name in BLOCKS:
        del bare[name]
    assert is_robot(list(bare))
    assert judge(bare).sentence() == judge(whole).sentence()
    ours, theirs = measure(whole), measure(bare)
    assert [name for name, value in theirs.items() if isnan(value)] == ["estimator_error"]
    assert {name: ours[name] for name in theirs if name != "estimator_error"} == {
        name: value for name, value in theirs.items() if name != "estimator_error"
    }
    assert judge(bare).text("estimator_error") == "–"
