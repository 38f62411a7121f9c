"""Marks the functions that run in every step, and compiles them where that pays.

Plain and compiled Python give the same results bit for bit, because a marked function keeps to what both compute
identically: float and integer arithmetic, comparisons, loops, tuples (with names for their parts as a NamedTuple),
attributes of the block's values, other marked functions, module-level tuples of floats indexed by a whole number, and
of `math` what is exact: sqrt, floor, fabs, copysign, frexp, ldexp, isfinite and constants. sin, cos, tan, atan2, exp
and log come from `elementary`, because those of `math` depend on the machine. Powers (`x**2`), `hypot`, `sum`, `fsum`
and `round` do too.
"""

from collections.abc import Callable, Sequence
from math import inf, isfinite
from pathlib import Path
from types import FunctionType
from typing import Any, TypeVar

MARKER = "twip-keeps-this-folder"
"""File beside the model description of an unpacked FMU, written by a master that keeps the folder: compiled code can be
cached in it.
"""

COMPILES = (Path(__file__).parents[3] / MARKER).is_file()
"""Whether `entry_point` can be called: this code lies in a folder that stays, and numba is installed."""

if COMPILES:
    try:
        import numba
        import numba.extending
        import numpy
    except ImportError:
        COMPILES = False

WAITING, OPEN, ENTERED, NOT_FINITE = 0.0, 1.0, 2.0, 3.0
"""What the gate behind a block's values says to the compiled step: something has to be checked in Python first, go
ahead, the last step raised an exception, the last step left an output that is not finite.
"""
DECLINED = -1
"""Status of a compiled step that has changed nothing, or has left the reason in the gate."""


Function = TypeVar("Function", bound=Callable[..., object])
_kernels: set[object] = set()
_twins: dict[object, Any] = {}
_kept: list[Any] = []  # C functions live as long as these objects


def kernel(function: Function) -> Function:
    """Mark a scalar function as part of a block's step."""
    _kernels.add(function)
    return function


def is_kernel(function: object) -> bool:
    """Return whether a function is marked."""
    return function in _kernels


def compiled(function: Any) -> Any:
    """Return the compiled twin of a marked function; the marked functions it calls are compiled with it."""
    if function not in _twins:
        called = {n: function.__globals__[n] for n in function.__code__.co_names if n in function.__globals__}
        names = {n: compiled(f) for n, f in called.items() if isinstance(f, FunctionType) and f in _kernels}
        names = {**function.__globals__, **names}
        twin = FunctionType(function.__code__, names, function.__name__, function.__defaults__)
        _twins[function] = numba.njit(cache=True, no_cpython_wrapper=True, no_cfunc_wrapper=True)(twin)
    return _twins[function]


def _pointer(_typing: Any, address: Any) -> Any:
    """Take an integer as an address (a numba intrinsic)."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        return builder.inttoptr(values[0], context.get_value_type(signature.return_type))

    return numba.types.voidptr(address), generate


def _do_step(address, time, step_size, _prior):  # type: ignore[no-untyped-def]
    """Compiled by numba; the names in capitals are put in by `entry_point`."""
    gate = carray(pointer(address + 8 * SIZE), (1,), FLOAT)  # type: ignore[name-defined] # noqa: F821
    if gate[0] != OPEN or not 0.0 < step_size < inf:
        return DECLINED
    gate[0] = ENTERED
    try:
        STEP(carray(pointer(address), (1,), RECORD)[0], time, step_size)  # type: ignore[name-defined] # noqa: F821
    except Exception:  # cannot leave a C function
        return DECLINED
    outputs = carray(pointer(address + 8 * FIRST), (COUNT,), FLOAT)  # type: ignore[name-defined] # noqa: F821
    for i in range(COUNT):  # type: ignore[name-defined] # noqa: F821
        if not isfinite(outputs[i]):
            gate[0] = NOT_FINITE
            return DECLINED
    carray(pointer(address + 8 * SIZE + 8), (1,), FLOAT)[0] = time + step_size  # type: ignore[name-defined] # noqa: F821
    gate[0] = OPEN
    return 0


def entry_point(step: Callable[[Any, float, float], None], attributes: Sequence[str], outputs: tuple[int, int]) -> int:
    """Return the address of a C function that runs `step(v, time, step_size)` compiled.

    It takes what fmi2DoStep takes, with the address of v's values in place of the component, and returns 0 or
    `DECLINED`. The values are float64 in the order of `attributes`; behind them lie the gate and the time in s that was
    reached. `outputs` are the index of the first output and their number.
    """
    names = {
        "__name__": __name__,
        "STEP": compiled(step),
        "RECORD": numpy.dtype([(name, numpy.float64) for name in attributes]),
        "FLOAT": numpy.float64,
        **{"SIZE": len(attributes), "FIRST": outputs[0], "COUNT": outputs[1]},
        **{"carray": numba.carray, "pointer": numba.extending.intrinsic(_pointer)},
        **{"isfinite": isfinite, "inf": inf, "OPEN": OPEN, "ENTERED": ENTERED, "NOT_FINITE": NOT_FINITE},
        "DECLINED": DECLINED,
    }
    signature = numba.int32(numba.int64, numba.float64, numba.float64, numba.int32)
    made = numba.cfunc(signature, cache=True)(FunctionType(_do_step.__code__, names, _do_step.__name__))
    _kept.append(made)
    return int(made.address)
