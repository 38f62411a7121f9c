"""Marks the functions that run in every step, and compiles them where that pays.

Plain and compiled Python give the same results bit for bit, because a marked function keeps to what both compute
identically: float and integer arithmetic, comparisons, loops, tuples, attributes of the block's values, other marked
functions, and of `math` sin, cos, tan, exp, log, atan2, sqrt, floor, fabs, copysign, isfinite and constants. Powers
(`x**2`), `hypot`, `sum`, `fsum` and `round` do not.
"""

from collections.abc import Callable, Sequence
from math import inf, isfinite
from pathlib import Path
from types import FunctionType
from typing import Any, NamedTuple, TypeVar

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

WAITING, OPEN, ENTERED, NOT_FINITE = 0.0, 1.0, 2.0, 3.0
"""What the gate behind a block's values says to `do_step` of `NativeFunctions`: something has to be checked in Python
first, go ahead, the last step never came back, the last step left an output that is not finite.
"""
DECLINED = -1
"""Status of a native function that has changed nothing, or has left the reason in the gate: call the FMI function."""


class EntryPoints(NamedTuple):
    """The compiled functions of a block; `address` is that of its values."""

    initialize: Callable[[int, float], None]
    """`initialize(address, time)`."""
    step: Callable[[int, int, int, float, float], bool]
    """`step(address, first, count, time, step_size)`: returns whether the outputs, `count` from index `first` on, are
    all finite.
    """
    native: tuple[int, int, int]
    """Addresses of C functions that do what fmi2SetReal (for inputs), fmi2DoStep and fmi2GetReal do, without Python:
    their first argument is `address` in place of the component, value references are indices of the values, and the
    gate lies behind the values. They return fmi2OK or `DECLINED`.
    """


Function = TypeVar("Function", bound=Callable[..., object])
_kernels: set[object] = set()
_twins: dict[object, Any] = {}
_kept: list[Any] = []  # C functions live as long as these objects


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


def _set_real(address, references, count, given):  # type: ignore[no-untyped-def]
    values = carray(pointer(address), (SIZE,), FLOAT)  # type: ignore[name-defined] # noqa: F821
    wanted, new = carray(references, (count,)), carray(given, (count,))  # type: ignore[name-defined] # noqa: F821
    for i in range(count):
        if not isfinite(new[i]):
            return DECLINED
    for i in range(count):
        values[wanted[i]] = new[i]
    return 0


def _get_real(address, references, count, taken):  # type: ignore[no-untyped-def]
    values = carray(pointer(address), (SIZE,), FLOAT)  # type: ignore[name-defined] # noqa: F821
    wanted, out = carray(references, (count,)), carray(taken, (count,))  # type: ignore[name-defined] # noqa: F821
    for i in range(count):
        out[i] = values[wanted[i]]
    return 0


def _do_step(address, time, step_size, _prior):  # type: ignore[no-untyped-def]
    gate = carray(pointer(address + 8 * SIZE), (1,), FLOAT)  # type: ignore[name-defined] # noqa: F821
    if gate[0] != OPEN or not 0.0 < step_size < inf:
        return DECLINED
    gate[0] = ENTERED
    try:
        finite = STEP_AT(address, FIRST, COUNT, time, step_size)  # type: ignore[name-defined] # noqa: F821
    except Exception:  # cannot leave a C function
        return DECLINED
    gate[0] = OPEN if finite else NOT_FINITE
    return 0 if finite else DECLINED


def entry_points(
    initialize: Callable[[Any, float], None],
    step: Callable[[Any, float, float], None],
    attributes: Sequence[str],
    outputs: tuple[int, int],
) -> EntryPoints:
    """Return what a block with the functions `initialize(v, time)` and `step(v, time, step_size)` runs on, compiled.

    v's values are float64 in the order of `attributes`, and behind them lies the gate. `outputs` are the index of the
    first output and their number.
    """
    names = {
        "__name__": __name__,
        "INITIALIZE": compiled(initialize),
        "STEP": compiled(step),
        "RECORD": numpy.dtype([(name, numpy.float64) for name in attributes]),
        "FLOAT": numpy.float64,
        "SIZE": len(attributes),
        "FIRST": outputs[0],
        "COUNT": outputs[1],
        "carray": numba.carray,
        "pointer": numba.extending.intrinsic(_pointer),
        **{"isfinite": isfinite, "inf": inf, "OPEN": OPEN, "ENTERED": ENTERED, "NOT_FINITE": NOT_FINITE},
        "DECLINED": DECLINED,
    }
    word, real, status = numba.int64, numba.float64, numba.int32
    references, reals = numba.types.CPointer(numba.uint32), numba.types.CPointer(real)
    access = status(word, references, numba.uint64, reals)
    step_at = _compile(_step_at, names, numba.boolean(word, word, word, real, real))
    return EntryPoints(
        _compile(_initialize_at, names, numba.void(word, real)),
        step_at,
        (
            _compile_for_c(_set_real, names, access),
            _compile_for_c(_do_step, {**names, "STEP_AT": step_at}, status(word, real, real, status)),
            _compile_for_c(_get_real, names, access),
        ),
    )


def _compile_for_c(function: Any, names: dict[str, Any], signature: Any) -> int:
    """Compile `function` with `names` as its globals as a C function, cached like the others; return its address."""
    twin = FunctionType(function.__code__, names, function.__name__)
    made = numba.cfunc(signature, cache=True)(twin)
    _kept.append(made)
    return int(made.address)
