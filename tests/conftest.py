"""What tests of several layers share."""

import os
import signal

import pytest

from twip.fmi.build import build_all


@pytest.fixture(scope="session", autouse=True)
def heard_signals():
    """Let tests and their processes hear signals even where the suite was started in the background or by nohup."""
    usual = {signal.SIGINT: signal.default_int_handler, signal.SIGTERM: signal.SIG_DFL, signal.SIGHUP: signal.SIG_DFL}
    before = {number: signal.getsignal(number) for number in usual}
    for number, handler in usual.items():
        if before[number] is signal.SIG_IGN:
            signal.signal(number, handler)
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.fixture(scope="session", autouse=True)
def cache(tmp_path_factory):
    """A folder of the test session for kept unpacked FMUs, in place of the user's.

    What Zig has compiled stays beside the folders of all sessions: it depends on the sources alone.
    """
    folder = tmp_path_factory.mktemp("cache")
    compiled = tmp_path_factory.getbasetemp().parent / "zig"
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("TWIP_CACHE", str(folder))
        patch.setenv("ZIG_GLOBAL_CACHE_DIR", os.environ.get("ZIG_GLOBAL_CACHE_DIR") or str(compiled))
        yield folder


@pytest.fixture(scope="session")
def built(tmp_path_factory):
    """A folder with `fmus/*.fmu`, `ssp/*.ssp` and the loose parameter sets and inputs, built once."""
    folder = tmp_path_factory.mktemp("built")
    build_all(folder)
    return folder
