"""Marks the functions that run in every step, and compiles them where that pays.

Plain and compiled Python give the same results bit for bit, because a marked function keeps to what both compute
identically: float and integer arithmetic, comparisons, loops, tuples, attributes of the block's values, other marked
functions, and of `math` sin, cos, tan, exp, log, atan2, sqrt, floor, fabs, copysign, isfinite and constants. Powers
(`x**2`), `hypot`, `sum`, `fsum` and `round` do not.
"""

from collections.abc import Callable, Sequence
from math import isfinite
from pathlib import Path
from types import FunctionType
from typing import Any, TypeVar

MARKER = "twip-keeps-this-folder"
"""File beside the model description of an unpacked FMU, written by a master that keeps the folder: compiled code can be
cached in it.
"""

COMPILES = (Path(__file__).parents[3] / MARKER).is_file()
"""Whether `entry_points` can be called: this code lies in a folder that stays, and numba is installed."""

if COMPILES:
    try:
        import numba
        import numba.extending
        import numpy
    except ImportError:
        COMPILES = False

EntryPoints = tuple[Callable[[int, float], None], Callable[[int, int, int, float, float], bool]]
Function = TypeVar("Function", bound=Callable[..., object])
_kernels: set[object] = set()
_twins: dict[object, Any] = {}


def kernel(function: Function) -> Function:
    """Mark a scalar function as part of a block's step."""
    _kernels.add(function)
    return function


def compiled(function: Any) -> Any:
    """Return the compiled twin of a marked function; the marked functions it calls are compiled with it."""
    if function not in _twins:
        called = {n: function.__globals__[n] for n in function.__code__.co_names if n in function.__globals__}
        names = {n: compiled(f) for n, f in called.items() if isinstance(f, FunctionType) and f in _kernels}
        _twins[function] = _compile(function, {**function.__globals__, **names})
    return _twins[function]


def _compile(function: Any, names: dict[str, Any], signature: Any = None) -> Any:
    """Compile `function` with `names` as its globals; the result is cached in the folder of its file."""
    twin = FunctionType(function.__code__, names, function.__name__, function.__defaults__)
    if signature is not None:
        return numba.njit(signature, cache=True, no_cfunc_wrapper=True)(twin)
    return numba.njit(cache=True, no_cpython_wrapper=True, no_cfunc_wrapper=True)(twin)  # called by compiled code alone


def _pointer(_typing: Any, address: Any) -> Any:
    """Take an integer as an address (a numba intrinsic)."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        return builder.inttoptr(values[0], context.get_value_type(signature.return_type))

    return numba.types.voidptr(address), generate


# What numba compiles; the names in capitals are put in by `entry_points`.


def _initialize_at(address, time):  # type: ignore[no-untyped-def]
    INITIALIZE(carray(pointer(address), (1,), RECORD)[0], time)  # type: ignore[name-defined] # noqa: F821


def _step_at(address, first, count, time, step_size):  # type: ignore[no-untyped-def]
    STEP(carray(pointer(address), (1,), RECORD)[0], time, step_size)  # type: ignore[name-defined] # noqa: F821
    outputs = carray(pointer(address + 8 * first), (count,), FLOAT)  # type: ignore[name-defined] # noqa: F821
    for i in range(count):  # noqa: SIM110 (numba compiles no generators)
        if not isfinite(outputs[i]):
            return False
    return True


def entry_points(
    initialize: Callable[[Any, float], None], step: Callable[[Any, float, float], None], attributes: Sequence[str]
) -> EntryPoints:
    """Return `initialize(v, time)` and `step(v, time, step_size)` compiled, taking the address of v's values for v.

    v's values are float64 in the order of `attributes`. The compiled step takes in addition which values are outputs
    (index of the first, count) and returns whether they are all finite.
    """
    names = {
        "__name__": __name__,
        "INITIALIZE": compiled(initialize),
        "STEP": compiled(step),
        "RECORD": numpy.dtype([(name, numpy.float64) for name in attributes]),
        "FLOAT": numpy.float64,
        "carray": numba.carray,
        "pointer": numba.extending.intrinsic(_pointer),
        "isfinite": isfinite,
    }
    word, real = numba.int64, numba.float64
    return (
        _compile(_initialize_at, names, numba.void(word, real)),
        _compile(_step_at, names, numba.boolean(word, word, word, real, real)),
    )
