"""Decodes ROS 2 messages: definitions as recorded (`ros2msg`), data in plain CDR (OMG CDR, XCDR version 1).

The definitions of the types that a message contains follow its own behind lines of `=` and `MSG: package/Type`.
"""

import re
import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...cosim.log import DamagedError

PRIMITIVES: Mapping[str, str] = {
    **{"bool": "?", "byte": "B", "char": "B", "int8": "b", "uint8": "B", "int16": "h", "uint16": "H"},
    **{"int32": "i", "uint32": "I", "int64": "q", "uint64": "Q", "float32": "f", "float64": "d"},
}
"""Formats of the types that are numbers."""
SEPARATOR = re.compile(r"^=+[ \t]*$", re.MULTILINE)
LINE = re.compile(r"([A-Za-z][\w/]*)(?:<=\d+)?(?:\[(<=)?(\d{0,9})\])?\s+([A-Za-z]\w*)\s*(.*)")
"""Type, bound, size, name, and what follows: a value, or `=` and that of a constant."""
TIME = "int32 sec\nuint32 nanosec"
BUILT_IN = {"builtin_interfaces/Time": TIME, "builtin_interfaces/Duration": TIME}


@dataclass(frozen=True)
class Field:
    """A field: its type's short name; `size` is None for one value, 0 for a sequence, else that of an array."""

    name: str
    type: str
    size: int | None


def decoder(name: str, schema: bytes) -> Callable[[bytes], Any]:
    """Return what turns messages of the type `name` into mappings; raises DamagedError at a broken definition."""
    types = {short: _fields(short, text) for short, text in BUILT_IN.items()}
    first, *others = SEPARATOR.split(schema.decode("utf-8"))
    root = _short(name)
    types[root] = _fields(root, first)
    for section in others:
        head, _, text = section.strip().partition("\n")
        if not head.startswith("MSG:"):
            raise DamagedError(f"a definition in {name} begins with {head!r} instead of MSG:")
        short = _short(head.removeprefix("MSG:").strip())
        types[short] = _fields(short, text)
    for fields in types.values():
        for field in fields:
            if field.type not in (*PRIMITIVES, "string", "wstring", *types):
                raise DamagedError(f"{name} does not define the type {field.type} of its field {field.name}")
    return lambda data: _Cdr(data, types).structure(root)


def _short(name: str) -> str:
    parts = name.split("/")
    return f"{parts[0]}/{parts[-1]}"


def _fields(owner: str, text: str) -> tuple[Field, ...]:
    fields = []
    for line in text.splitlines():
        words = line.strip()
        if not words or words.startswith("#"):
            continue
        match = LINE.fullmatch(words)
        if not match:
            raise DamagedError(f"{owner} has a line that is no field: {words!r}")
        kind, bound, size, name, rest = match.groups()
        if rest.startswith("="):
            continue
        if kind not in (*PRIMITIVES, "string", "wstring"):
            kind = _short(kind) if "/" in kind else f"{owner.split('/')[0]}/{kind}"
        length = None if size is None else 0 if bound or not size else int(size)
        if length == 0 and size and not bound:
            raise DamagedError(f"{owner}.{name} is an array of size 0")
        fields.append(Field(name, kind, length))
    return tuple(fields)


class _Cdr:
    """Reads one message; every value is checked to lie within it."""

    def __init__(self, data: bytes, types: Mapping[str, tuple[Field, ...]]):
        if len(data) < 4 or data[0] != 0 or data[1] not in (0, 1):
            raise DamagedError("it is not in plain CDR")
        self._data, self._at, self._types = data, 4, types
        self._order = "<" if data[1] else ">"

    def structure(self, name: str) -> dict[str, Any]:
        fields = self._types[name]
        if not fields:  # IDL has no empty structures: one octet stands in
            self._take(1, 1)
        return {field.name: self._field(field) for field in fields}

    def _field(self, field: Field) -> Any:
        if field.size is None:
            return self._value(field.type)
        count = field.size or self._length()
        if field.type not in PRIMITIVES:
            if count > len(self._data) - self._at:  # each takes an octet at least
                raise DamagedError(f"it ends within {field.name}")
            return [self._value(field.type) for _ in range(count)]
        kind = np.dtype(self._order + PRIMITIVES[field.type])
        start = self._take(kind.itemsize, count * kind.itemsize) if count else self._at
        return np.frombuffer(self._data, kind, count, start)

    def _value(self, kind: str) -> Any:
        if kind in PRIMITIVES:
            shape = self._order + PRIMITIVES[kind]
            size = struct.calcsize(shape)
            return struct.unpack_from(shape, self._data, self._take(size, size))[0]
        if kind == "wstring":
            raise DamagedError("it has a wstring, whose size differs between middlewares")
        if kind == "string":
            self._take(1, self._length())
            return None
        return self.structure(kind)

    def _length(self) -> int:
        return int(struct.unpack_from(f"{self._order}I", self._data, self._take(4, 4))[0])

    def _take(self, alignment: int, size: int) -> int:
        """Return where the next `size` octets begin, and go past them; alignment counts from the fifth octet."""
        start = self._at + -(self._at - 4) % alignment
        if start + size > len(self._data):
            raise DamagedError(f"it ends at byte {len(self._data)}, within a value")
        self._at = start + size
        return start
