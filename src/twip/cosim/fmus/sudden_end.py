"""What an FMU may do to the process that runs it: an FMU that calls `exit` in the middle of a run, or crashes, is told
in one line, and the process does not end with status 0 as if its work were done.

`exit`, `_exit` and the like are redirected where a library from the FMU's folder calls them, `os._exit` for its Python
code. What the C library's `exit` calls first catches it in all other libraries. The signals of a crash are told of
where nobody else handles them. Not caught: `_exit` in a library of the system, in one that also calls `vfork`, or as a
bare system call; `execve`, `SIGKILL`, and a crash by which the stack overflows. `--isolate` tells these too. In the
compiled loop an `exit` in a thread for which its FMU waits hangs; `--isolate` has a time limit for it.
"""

import contextlib
import ctypes
import inspect
import os
import signal
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from .library_calls import libraries, redirect, supported

_ADVICE = "; with --isolate such an FMU ends the run cleanly"
_CRASHES = (signal.SIGSEGV, signal.SIGBUS, signal.SIGFPE, signal.SIGILL, signal.SIGABRT)
_EXITS = ("exit", "_exit", "_Exit", "quick_exit")
_TAKES_STATUS = ctypes.CFUNCTYPE(None, ctypes.c_int)
_TAKES_ADDRESS = ctypes.CFUNCTYPE(None, ctypes.c_void_p)
_python_exit = os._exit
_PATIENCE = 5
"""Seconds after which a process that crashed is killed, should telling of it hang."""


@dataclass(frozen=True)
class _Run:
    """A run in this process."""

    components: Mapping[Path, str]
    """What is in the folder of each FMU."""
    clock: NDArray[np.float64]
    """Simulated time in s, (1,)."""
    process: int


_runs: list[_Run] = []
_called: dict[str, Any] = {}
"""Functions that C may call as long as the process lives, by what they are for."""


@contextlib.contextmanager
def sudden_end_told(components: Mapping[Path, str], clock: NDArray[np.float64]) -> Iterator[None]:
    """While entered, a sudden end of this process is told, and is never one with status 0.

    `components` names what is in the folder of each FMU, `clock` (1,) holds the simulated time in s.
    """
    if not supported():
        yield
        return
    c = ctypes.CDLL(None)
    if not _called:
        _called["at exit"], _called["crash"] = _TAKES_ADDRESS(_at_exit), _TAKES_STATUS(_crash)
    first = not _runs
    _runs.append(_Run(components, clock, os.getpid()))
    token = ctypes.create_string_buffer(1)
    if first:
        getattr(c, "__cxa_atexit")(_called["at exit"], None, token)
        _handle(c, 0, _called["crash"])
        os._exit = _leave_python
    try:
        yield
    finally:
        _runs.pop()
        if first:
            os._exit = _python_exit
            getattr(c, "__cxa_finalize")(token)  # it is called once more, with nothing to tell
            _handle(c, ctypes.cast(_called["crash"], ctypes.c_void_p).value or 0, None)


def watch(handle: int, folder: Path) -> None:
    """Redirect the exits of the libraries in an FMU's folder, of which `handle` is one that was just loaded."""
    if _runs and folder in _runs[-1].components:
        own = f"{folder}{os.sep}"
        for library in libraries(handle):
            if library.path.startswith(own):
                redirect(library, _exits(str(folder)))


def _exits(folder: str) -> dict[str, Any]:
    """Return what is called instead of each way to exit in the folder of an FMU."""
    for name in _EXITS:
        if f"{name} {folder}" not in _called:
            _called[f"{name} {folder}"] = _TAKES_STATUS(lambda status, name=name: _leave(name, status, folder))
    return {name: _called[f"{name} {folder}"] for name in _EXITS}


def _leave(name: str, status: int, folder: str) -> None:
    """Do what `exit` and the like do, but during a run tell of it, with another status than 0."""
    if _here():
        _tell(f"{_runs[-1].components.get(Path(folder)) or _anyone()} called {name}({status})")
        ctypes.CDLL(None)._exit(status or 1)
    getattr(ctypes.CDLL(None), name)(status)


def _leave_python(status: int) -> NoReturn:
    if _here():
        _tell(f"{_anyone()} called os._exit({status})")
        status = status or 1
    _python_exit(status)


def _here() -> bool:
    """Tell whether this is the process of a run; others may end as they like."""
    return bool(_runs) and os.getpid() == _runs[-1].process


def _at_exit(_: int | None) -> None:
    if _here():
        _tell(f"{_anyone()} called exit")
        ctypes.CDLL(None)._exit(1)


def _crash(number: int) -> None:
    """Tell of a crash; when this returns it happens again, without a handler."""
    signal.alarm(_PATIENCE)
    ctypes.CDLL(None).signal(number, None)
    if _here():
        _tell(f"{_anyone()} crashed with {signal.Signals(number).name}")


def _anyone() -> str:
    """Return the FMU whose Python code is being executed, or else which it may be."""
    frame = inspect.currentframe()
    while frame is not None:
        for folder, name in _runs[-1].components.items():
            if frame.f_code.co_filename.startswith(f"{folder}{os.sep}"):
                return name
        frame = frame.f_back
    names = list(_runs[-1].components.values())
    return names[0] if len(names) == 1 else f"one of the FMUs ({'; '.join(names)})"


def _tell(what: str) -> None:
    cursor = b"\r\x1b[?25h\n" if os.isatty(2) else b""  # which a progress bar may have hidden
    text = f"twip: {what} at t = {float(_runs[-1].clock[0]):.12g} s and ended the process{_ADVICE}\n"
    with contextlib.suppress(OSError):
        os.write(2, cursor + text.encode("utf-8", "backslashreplace"))


def _handle(c: ctypes.CDLL, before: int, handler: Any) -> None:
    """Let `handler` (None: the default) take the signals of a crash whose handler has been that `before`."""
    for number in _CRASHES:
        action = (ctypes.c_size_t * 64)()  # longer than any `struct sigaction`, which begins with the handler
        if c.sigaction(int(number), None, action) == 0 and action[0] == before:
            c.signal(int(number), handler)
