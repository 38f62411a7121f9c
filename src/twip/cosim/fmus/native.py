"""Native access to an instance: its values in memory and its step as a C function, for the compiled loop.

An FMU written in Python answers every FMI call in the interpreter. One that compiles its code can offer the values and
the compiled step themselves (docs/native_functions.md): the model description names, in the vendor annotation
`org.twip.native`, the value reference of a String, and fmi2GetString returns two addresses under it, or an empty text
when nothing is compiled. The step behaves as fmi2DoStep does; one that cannot do its work returns `DECLINED` with
nothing changed, or with the reason left for fmi2DoStep, which is then called instead.
"""

from dataclasses import dataclass

from .component import Instance

DECLINED = -1


@dataclass(frozen=True)
class Native:
    """Addresses that an instance gives."""

    values: int
    """Values of the Real variables, float64, by value reference; also what the step takes as its first argument."""
    do_step: int


NOT_NATIVE = Native(0, 0)
"""What stands for an instance that offers nothing."""


def native_access(instance: Instance) -> Native:
    """Ask an initialized instance; `NOT_NATIVE` when it offers nothing."""
    reference = instance.component.fmu.native_reference
    if reference is None:
        return NOT_NATIVE
    words = instance.get_string(reference).split()
    if len(words) != 2 or not all(word.isascii() and word.isdigit() for word in words):
        return NOT_NATIVE
    return Native(*map(int, words))
