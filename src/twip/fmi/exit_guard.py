"""Keeps a pythonfmu library from aborting the host process at its exit."""

import ctypes
import os
from pathlib import Path

_guarded: set[str] = set()


def guard_exit(resources: str, binaries: str, model_identifier: str) -> None:
    """Let the process's exit release the interpreter state of the FMU's own library, once per library path.

    Without it the library's destructor may touch that state after it was destroyed, and the process aborts after its
    work is done. C runs what was registered last first: this comes before the destructors of all libraries that are
    loaded by now, also where the host is not Python and Python itself ends with one of them. `resources` is the
    unpacked resources folder, `binaries` the name of the folder that holds the library. A library that is not loaded
    from beside it is left alone; so is any that is not Linux's, where alone this was seen.
    """
    path = str(Path(resources).parent / "binaries" / binaries / f"{model_identifier}.so")
    if path in _guarded:
        return
    try:
        library = ctypes.CDLL(path, mode=os.RTLD_NOLOAD | os.RTLD_NOW)  # never unloaded again
        register = getattr(ctypes.CDLL(None), "__cxa_atexit")
        finalize = ctypes.cast(library.finalizePythonInterpreter, ctypes.c_void_p)
    except (OSError, AttributeError):
        return
    _guarded.add(path)
    register(finalize, None, None)
