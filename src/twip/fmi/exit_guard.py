"""Keeps a pythonfmu library from aborting the host process at its exit."""

import atexit
import ctypes
import os
import sys
from pathlib import Path

_guarded: set[str] = set()


def guard_exit(resources: str, binaries: str, model_identifier: str) -> None:
    """Let Python's exit release the interpreter state of the FMU's own library, once per library path.

    Without it the library's destructor may touch that state after it was destroyed, and the process aborts after its
    work is done. `resources` is the unpacked resources folder, `binaries` the name of the
    folder that holds the library. A library that is not loaded from beside it is left
    alone; so is any system but Linux, where alone this was seen.
    """
    if sys.platform != "linux":
        return
    path = str(Path(resources).parent / "binaries" / binaries / f"{model_identifier}.so")
    if path in _guarded:
        return
    try:
        library = ctypes.CDLL(path, mode=os.RTLD_NOLOAD | os.RTLD_NOW)
        finalize = library.finalizePythonInterpreter
    except (OSError, AttributeError):
        return
    _guarded.add(path)
    atexit.register(finalize)
