"""A block's kernels as C99: all functions its `initialize` and `step` reach, in the order C needs."""

from collections.abc import Callable, Iterable, Mapping
from typing import Any

from ...errors import Problem
from .expression import number
from .function import Function
from .layout import comment, wrapped
from .source import RefusedError, Signature, Source
from .value_types import C_NAMES, Type, struct_name

_RESERVED = """
auto break case char const continue default do double else enum extern float for goto if inline int long register
restrict return short signed sizeof static struct switch typedef union unsigned void volatile while bool true false
asm near far small interface
"""


class Unit:
    """What becomes one C file: functions, the structs of their tuples, the constants they use.

    `block` names the values' type, `attributes` are the values, `signatures` the types of arguments and result of
    functions that need no annotations.
    """

    def __init__(self, block: str, attributes: Iterable[str], signatures: Mapping[Callable[..., Any], Signature]):
        self.values_type = f"{block}_values"
        self.attributes = tuple(attributes)
        self._signatures = signatures
        self._functions: dict[Callable[..., Any], str] = {}
        self._sources: dict[Callable[..., Any], Source] = {}
        self._begun: set[Callable[..., Any]] = set()
        self._waiting: list[Callable[..., Any]] = []
        self._writes: dict[Callable[..., Any], bool] = {}
        self._names: dict[Callable[..., Any], str] = {}
        self._structs: dict[str, str] = {}
        self._constants: dict[tuple[str, str], tuple[str, str]] = {}
        self._global_names: set[str] = set()
        self._problems: list[Problem] = []

    def source_of(self, function: Callable[..., Any]) -> Source:
        """Return what is to be translated."""
        if function not in self._sources:
            self._sources[function] = Source(function, self._signatures.get(function))
        return self._sources[function]

    def add(self, function: Callable[..., Any], translator: type[Function] = Function) -> Source:
        """Translate a function, after all that it calls, and return its source; RefusedError if it breaks a rule."""
        source = self.source_of(function)
        if function in self._begun:
            if function not in self._functions:
                raise RefusedError  # told already
            return source
        self._begun.add(function)
        for call, called in source.calls:
            if called in (function, *self._waiting):
                raise source.refuse(call, f"{called.__name__} calls itself: kernels have no recursion")
            self._waiting.append(function)
            try:
                self.add(called)
            finally:
                self._waiting.pop()
        self._functions[function] = translator(self, source).translate()
        return source

    def require(self, function: Callable[..., Any], translator: type[Function] = Function) -> str:
        """Translate a function and all it reaches, and return its name; what breaks a rule is kept for `text`."""
        try:
            self.add(function, translator)
        except RefusedError as refusal:
            self._problems += refusal.problems
        return self.name_of(function)

    def writes(self, function: Callable[..., Any]) -> bool:
        """Return whether a function writes values of the block, by itself or through what it calls."""
        if function not in self._writes:
            self._writes[function] = False
            source = self.source_of(function)
            self._writes[function] = source.stores or any(self.writes(called) for _, called in source.calls)
        return self._writes[function]

    def name_of(self, function: Callable[..., Any]) -> str:
        """Return the name of a function in C: module and name."""
        if function not in self._names:
            module = str(function.__module__).rpartition(".")[2].removeprefix("twip_face_")
            self._names[function] = self._unique(f"{module}_{function.__name__}")
        return self._names[function]

    def c_name(self, name: str, taken: Iterable[str] = ()) -> str:
        """Return a name of Python as one of C that is neither reserved nor `taken`."""
        clash = name in _RESERVED.split() or name.startswith(("twip_", "t_", "INT64")) or name in taken
        numbered = name.rstrip("0123456789") in ("t", "at", "end") and name[-1].isdigit()
        return f"{name}_" if clash or numbered or not name.isascii() else name

    def c_type(self, kind: Type) -> str:
        """Return a type in C; the struct of a tuple is declared."""
        return C_NAMES[kind] if isinstance(kind, str) else self.struct(kind)

    def struct(self, kind: tuple[Type, ...]) -> str:
        """Return the name of a tuple's struct, which is declared."""
        name = struct_name(kind)
        fields = [f"{self.c_type(part)} _{i};" for i, part in enumerate(kind)]
        self._structs.setdefault(name, f"typedef struct {{ {' '.join(fields)} }} {name};")
        return name

    def constant(self, source: Source, name: str, value: float) -> str:
        """Return the name of a number that a module of Python defines."""
        integer = isinstance(value, int)
        text = f"static const {'int64_t' if integer else 'double'} {{}} = {value if integer else number(value)};"
        return self._defined(source, name, text)

    def table(self, source: Source, name: str, values: tuple[float, ...]) -> str:
        """Return the name of a tuple of numbers that a module of Python defines."""
        return self._defined(
            source, name, f"static const double {{}}[{len(values)}] = {{{{{', '.join(map(number, values))}}}}};"
        )

    def _defined(self, source: Source, name: str, text: str) -> str:
        key = source.module, name
        if key not in self._constants:
            c_name = self._unique(f"{source.module}_{name.replace('.', '_')}".upper())
            self._constants[key] = c_name, text.format(c_name)
        return self._constants[key][0]

    def _unique(self, name: str) -> str:
        number, unique = 2, name
        while unique in self._global_names:
            unique, number = f"{name}_{number}", number + 1
        self._global_names.add(unique)
        return unique

    def values_struct(self) -> str:
        """Return the struct of the block's values."""
        fields = [f"  double {self.c_name(a)};" for a in self.attributes]
        about = comment(
            "The values of one instance: the variables in the order of their value references, then states."
        )
        return "\n".join([about, "typedef struct {", *fields, f"}} {self.values_type};"])

    def text(self) -> str:
        """Return everything in C."""
        if self._problems:
            raise RefusedError(self._problems)
        parts = ["\n".join(self._structs.values()), self.values_struct()]
        parts.append("\n".join(wrapped(text for _, text in self._constants.values())))
        return "\n\n".join([p for p in parts if p] + list(self._functions.values())) + "\n"
