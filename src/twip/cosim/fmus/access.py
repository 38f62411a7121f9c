"""The functions of FMUs that get and set variables.

Those of String variables are made to look like those of Real: the values are the numbers that `strings` gives the
texts.

The functions made here can be called from Python and, by their addresses, from compiled code, like those of an FMU.
"""

import ctypes
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ..values.strings import number_of, text_of


@dataclass(frozen=True)
class Access:
    """The function that gets or sets the variables of one type."""

    name: str
    """As FMI calls it, such as `fmi3GetFloat64`."""
    call: Callable[..., int]
    """The C function; it returns the FMI status."""
    element: Any
    """The ctypes type of one value."""
    counts_values: bool
    """Whether the last argument is the number of values (FMI 3), since a variable may be an array."""


_BASIC = (
    ctypes.c_int,
    ctypes.c_void_p,
    ctypes.POINTER(ctypes.c_uint),
    ctypes.c_size_t,
    ctypes.POINTER(ctypes.c_double),
)
_PROTOTYPES = {False: ctypes.CFUNCTYPE(*_BASIC), True: ctypes.CFUNCTYPE(*_BASIC, ctypes.c_size_t)}
"""By whether the number of values is passed too."""


def text_getter(access: Access) -> Access:
    """Return the getter that stores the numbers of the texts that an FMU's getter of String variables returns."""

    def get(handle: int, references: Any, count: int, values: Any, *size: int) -> int:
        found = (ctypes.c_char_p * (size[0] if size else count))()
        status = access.call(handle, references, count, found, *size)
        if status <= 1:
            for i, text in enumerate(found):
                values[i] = number_of((text or b"").decode("utf-8", "surrogateescape"))
        return status

    return _wrapped(access, get)


def text_setter(access: Access) -> Access:
    """Return the setter that takes the numbers of texts and passes these to an FMU's setter of String variables."""

    def put(handle: int, references: Any, count: int, values: Any, *size: int) -> int:
        total = size[0] if size else count
        texts = (text_of(values[i]).encode("utf-8", "surrogateescape") for i in range(total))
        return access.call(handle, references, count, (ctypes.c_char_p * total)(*texts), *size)

    return _wrapped(access, put)


def _wrapped(access: Access, function: Any) -> Access:
    return Access(access.name, _PROTOTYPES[access.counts_values](function), ctypes.c_double, access.counts_values)
