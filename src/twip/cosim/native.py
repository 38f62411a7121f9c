"""Native functions: C functions of an instance that the compiled loop may call in place of the FMI functions.

An FMU written in Python answers every FMI call in the interpreter. One that compiles its code can offer the compiled
functions themselves (docs/native.md): the model description names, in the vendor annotation `org.twip.native`, the
value reference of a String, and fmi2GetString returns addresses under it, or an empty text when nothing is compiled.
The functions behave as fmi2SetReal for inputs, fmi2DoStep and fmi2GetReal do between two communication points. One that
cannot do its work returns `DECLINED` with nothing changed, or with the reason left for the FMI function, which is then
called instead.
"""

from dataclasses import dataclass

from .component import Instance

DECLINED = -1


@dataclass(frozen=True)
class NativeFunctions:
    """Addresses of an instance's native functions."""

    component: int
    """What they take as their first argument."""
    set_real: int
    do_step: int
    get_real: int


NO_FUNCTIONS = NativeFunctions(0, 0, 0, 0)
"""What stands for an instance without native functions."""


def native_functions(instance: Instance) -> NativeFunctions | None:
    """Ask an initialized instance for its native functions; None when it has none."""
    reference = instance.component.fmu.native_reference
    if reference is None:
        return None
    words = instance.get_string(reference).split()
    if len(words) != 4 or not all(word.isascii() and word.isdigit() for word in words):
        return None
    return NativeFunctions(*map(int, words))
