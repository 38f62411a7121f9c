"""A state that is saved and restored, here or in another process, continues bit for bit; reset is a new beginning."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from fmi_host import DISCARD, OK

STEPS = 60


@pytest.fixture
def started(instance, name):
    """An instance that has run for some steps."""
    one = instance(name).begin()
    one.run(0, STEPS)
    return one


def test_restoring_repeats_bit_for_bit(started):
    state = started.save()
    first = started.run(STEPS, STEPS)
    started.restore(state)
    assert started.run(STEPS, STEPS) == first
    started.restore(state)  # once more: a restored state is not used up
    assert started.run(STEPS, STEPS) == first
    started.release(state)


def test_a_state_moves_to_another_instance(started, instance, name):
    state = started.save()
    first = started.run(STEPS, STEPS)
    other = instance(name)
    other.restore(state)
    assert other.run(STEPS, STEPS) == first
    started.release(state)


def test_a_state_moves_to_another_process(started, fmu_path, name, tmp_path):
    state = started.save()
    data = started.serialize(state)
    started.release(state)
    first = started.run(STEPS, STEPS)
    (tmp_path / "state").write_bytes(data)
    host = Path(__file__).with_name("fmi_host.py")
    arguments = [fmu_path(name), tmp_path / "unpacked", "restore", tmp_path / "state", STEPS, STEPS]
    run = subprocess.run(
        [sys.executable, "-I", "-S", host, *map(str, arguments)], capture_output=True, text=True, check=True
    )
    assert json.loads(run.stdout)["rows"] == first


def test_bytes_are_the_state(started):
    state = started.save()
    data = started.serialize(state)
    again = started.deserialize(data)
    assert started.serialize(again) == data
    started.release(state)
    started.release(again)


def test_a_state_saved_during_initialization_continues(instance, name):
    one, other = instance(name), instance(name)
    one.enter(0.5)
    state = one.save()
    one.check("ExitInitializationMode")
    other.restore(state)
    other.check("ExitInitializationMode")
    assert other.all() == one.all()
    assert other.run(0, 3) == one.run(0, 3)
    one.release(state)


def test_reset_equals_fresh(started, instance, name):
    started.check("Reset")
    fresh = instance(name)
    assert started.all() == fresh.all()
    started.begin()
    fresh.begin()
    assert started.run(0, STEPS) == fresh.run(0, STEPS)


def test_the_same_run_twice(instance, name):
    assert instance(name).begin().run(0, STEPS) == instance(name).begin().run(0, STEPS)


def test_a_state_of_another_block_is_refused(instance):
    walker, typed = instance("walker").begin(), instance("typed").begin()
    state = typed.save()
    walker.restore(state)
    assert walker.step(0.0, 0.01) == DISCARD
    assert "the state of block typed cannot be restored into block walker" in walker.log[0][2]
    typed.release(state)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"no state", "is not the state of a block (Expecting value"),
        (b"\xff\xfe", "is not the state of a block"),
        (b"[1, 2]", "is not the state of a block"),
        (b"{}", "is not the state of a block"),
        (b'{"block": "walker", "fingerprint": "0"}', "was saved by another build (fingerprint 0)"),
    ],
)
def test_foreign_bytes_are_refused(instance, data, message):
    walker = instance("walker").begin()
    before = walker.all()
    state = walker.deserialize(data)
    walker.restore(state)
    walker.release(state)
    assert walker.all() == before
    assert walker.step(0.0, 0.01) == DISCARD
    assert message in walker.log[0][2]


def test_an_incomplete_state_is_refused(instance):
    walker = instance("walker").begin()
    state = walker.save()
    content = json.loads(walker.serialize(state))
    walker.release(state)
    for broken in ({**content, "values": content["values"][1:]}, {k: x for k, x in content.items() if k != "mode"}):
        one = instance("walker").begin()
        bad = one.deserialize(json.dumps(broken).encode())
        one.restore(bad)
        one.release(bad)
        assert one.step(0.0, 0.01) == DISCARD


def test_restoring_a_state_from_before_a_mistake_heals(instance):
    walker = instance("walker").begin()
    state = walker.save()
    walker.set(pull=float("nan"))
    assert walker.step(0.0, 0.01) == DISCARD
    assert walker.step(0.0, 0.01) == DISCARD
    walker.restore(state)
    walker.release(state)
    assert walker.step(0.0, 0.01) == OK
