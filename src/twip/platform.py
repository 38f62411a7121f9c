"""What differs between operating systems: the folders of an FMU's libraries, and what Windows lacks.

No other module asks which system it runs on, but for those that FMUs carry, which stand alone.
"""

import contextlib
import ctypes
import os
import platform
import select
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from .errors import TwipError

if sys.platform != "win32":
    import fcntl
    import termios
    import tty


class Platform(NamedTuple):
    """A platform that an FMU can have a library for."""

    fmi2: str
    """Name of its folder in FMI 2.0 (section 2.3); for a platform that FMI 2.0 does not know, that of FMI 3.0."""
    fmi3: str
    """Name of its folder in FMI 3.0 (section 2.5.1.4), architecture and system."""
    ending: str
    """Of its libraries, without the dot."""


LINUX = Platform("linux64", "x86_64-linux", "so")
LINUX_ARM = Platform("aarch64-linux", "aarch64-linux", "so")
WINDOWS = Platform("win64", "x86_64-windows", "dll")
MACOS = Platform("darwin64", "x86_64-darwin", "dylib")
MACOS_ARM = Platform("darwin64", "aarch64-darwin", "dylib")
PLATFORMS = (LINUX, LINUX_ARM, WINDOWS, MACOS, MACOS_ARM)

_SYSTEMS = {"win32": "windows"}
_MACHINES = {"amd64": "x86_64", "arm64": "aarch64"}
TUPLE = "-".join((
    _MACHINES.get(platform.machine().lower(), platform.machine().lower()), _SYSTEMS.get(sys.platform, sys.platform),
))  # fmt: skip
"""This machine as FMI 3.0 names it; see `PLATFORMS`."""

END_SIGNALS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
"""Signals that ask a process to end."""
CREATE = os.O_WRONLY | os.O_CREAT | getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_BINARY", 0)
"""Flags of `os.open` for a file to write, which processes that are started do not inherit."""
CREATE_NEW = CREATE | os.O_EXCL | getattr(os, "O_NOFOLLOW", 0)
"""The same for a file that must not be there yet, not even as a link."""


def lock(descriptor: int) -> None:
    """Lock an open file until it is closed.

    Raises `BlockingIOError` where another process holds it, another `OSError` where the file system has no locks. On
    Windows nothing is locked.
    """
    if sys.platform != "win32":
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)


def set_mode(descriptor: int, mode: int) -> None:
    """Set the permissions of an open file; Windows keeps those of the folder."""
    if sys.platform != "win32":
        os.fchmod(descriptor, mode)


@contextmanager
def blocked(number: int) -> Iterator[None]:
    """Let a signal that comes while the block runs take effect at its end; on Windows it does so at once."""
    if sys.platform == "win32":
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {number})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def unblock(number: int) -> None:
    """Let a signal take effect in a process that was started while it was blocked."""
    if sys.platform != "win32":
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {number})


def processors() -> int:
    """Return the number of processors that this process may use."""
    if sys.platform == "linux":
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def end_now() -> None:
    """End this process at once, whatever its other threads are doing."""
    os.kill(os.getpid(), getattr(signal, "SIGKILL", signal.SIGTERM))  # on Windows SIGTERM cannot be caught


def end_session(process: int) -> None:
    """End a process that was started in a session of its own, and what it has started; nothing if it has ended."""
    if sys.platform != "win32":
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process, signal.SIGKILL)


def end_with(parent: int) -> None:
    """Let the kernel kill this process when the process `parent`, which has started it, is gone, and before others when
    memory runs out. Linux only.
    """
    set_parent_death_signal = 1  # PR_SET_PDEATHSIG of <linux/prctl.h>
    ctypes.CDLL(None).prctl(set_parent_death_signal, int(signal.SIGKILL), 0, 0, 0)
    if os.getppid() != parent:
        sys.exit(1)
    with contextlib.suppress(OSError):
        Path("/proc/self/oom_score_adj").write_text("1000", encoding="ascii")


def shared_memory(size: int) -> int:
    """Return the descriptor of new memory of `size` bytes that other processes can map; raises TwipError off Linux."""
    if sys.platform != "linux" or not hasattr(os, "memfd_create"):
        raise TwipError("isolated FMUs need Linux: other systems lack what ties their processes to the run")
    descriptor = os.memfd_create("twip")
    os.ftruncate(descriptor, size)
    return descriptor


@contextmanager
def single_keys(terminal: int) -> Iterator[Callable[[float], bytes] | None]:
    """Let a terminal (its descriptor) hand over each key at once while the block runs; afterwards it is as before.

    Gives a function that returns what was typed within so many seconds, and None on Windows.
    """
    if sys.platform == "win32":
        yield None
        return
    before = termios.tcgetattr(terminal)

    def typed(wait: float) -> bytes:
        return os.read(terminal, 64) if select.select([terminal], [], [], wait)[0] else b""

    tty.setcbreak(terminal)
    try:
        yield typed
    finally:
        termios.tcsetattr(terminal, termios.TCSADRAIN, before)
