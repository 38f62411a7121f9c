"""Ctrl-C while modules are imported."""

import signal

import pytest

from twip.interrupts import deferred_interrupt


def test_an_interrupt_waits_for_the_end_of_the_block():
    reached = []

    def interrupted():
        with deferred_interrupt():
            signal.raise_signal(signal.SIGINT)
            reached.append("end of the block")
        reached.append("behind the block")

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert reached == ["end of the block"]


def test_what_was_blocked_stays_blocked():
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGUSR1})
    try:
        with deferred_interrupt():
            pass
        assert signal.SIGUSR1 in signal.pthread_sigmask(signal.SIG_BLOCK, [])
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
