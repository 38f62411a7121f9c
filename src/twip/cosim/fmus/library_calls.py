"""Redirects what a loaded library calls by name: the addresses in its global offset table are replaced (ELF, 64 bit).

Only calls that the dynamic linker resolves are reached. Structures: System V ABI, ELF-64 object file format; `link.h`
of the C library.
"""

import ctypes
import mmap
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...platform import TUPLE

_TAGS = {2: "plt_size", 5: "names", 6: "symbols", 7: "rela", 8: "rela_size", 10: "names_size", 23: "plt"}
"""DT_PLTRELSZ, DT_STRTAB, DT_SYMTAB, DT_RELA, DT_RELASZ, DT_STRSZ, DT_JMPREL."""
_RELOCATION = np.dtype([("offset", "<u8"), ("type", "<u4"), ("symbol", "<u4"), ("addend", "<i8")])
_SYMBOL = np.dtype(
    [("name", "<u4"), ("info", "u1"), ("other", "u1"), ("section", "<u2"), ("value", "<u8"), ("size", "<u8")]
)
_READ_WRITE = mmap.PROT_READ | mmap.PROT_WRITE


class _LinkMap(ctypes.Structure):
    """`struct link_map`; what dlopen returns is the address of one."""


_LinkMap._fields_ = [
    ("base", ctypes.c_size_t),
    ("name", ctypes.c_char_p),
    ("dynamic", ctypes.c_void_p),
    ("next", ctypes.POINTER(_LinkMap)),
    ("previous", ctypes.POINTER(_LinkMap)),
]


@dataclass(frozen=True)
class Library:
    """A loaded library: its path (empty for the program itself), load address and dynamic section."""

    path: str
    base: int
    dynamic: int


def supported() -> bool:
    """Tell whether libraries here are ELF files of 64 bit, little endian."""
    return TUPLE.endswith("-linux") and ctypes.sizeof(ctypes.c_void_p) == 8 and sys.byteorder == "little"


def libraries(handle: int) -> Iterator[Library]:
    """Yield all loaded libraries; `handle` is what dlopen returned for one of them."""
    item = ctypes.cast(handle, ctypes.POINTER(_LinkMap))
    while item.contents.previous:
        item = item.contents.previous
    while item:
        found = item.contents
        yield Library((found.name or b"").decode(errors="replace"), found.base, found.dynamic or 0)
        item = found.next


def redirect(library: Library, functions: Mapping[str, Any]) -> None:
    """Let the library call `functions`, objects of ctypes that must outlive it, instead of those of the same names.

    One that calls `vfork` is left alone: its child would call them in the memory of the parent.
    """
    found = _sections(library)
    names = ctypes.string_at(found["names"], found["names_size"]) if found.get("names") else b""
    wanted = {offset: name for name in functions for offset in _offsets(names, name)}
    if not wanted or next(_offsets(names, "vfork"), None) is not None:
        return
    for table, size in (("plt", "plt_size"), ("rela", "rela_size")):
        if not found.get(table) or not found.get(size):
            continue
        relocations = _array(found[table], found[size] // _RELOCATION.itemsize, _RELOCATION)
        relocations = relocations[relocations["symbol"] != 0]
        if not len(relocations):
            continue
        symbols = _array(found["symbols"], int(relocations["symbol"].max()) + 1, _SYMBOL)[relocations["symbol"]]
        chosen = np.isin(symbols["name"], list(wanted)) & (symbols["section"] == 0)
        for offset, name in zip(relocations["offset"][chosen], symbols["name"][chosen], strict=True):
            address = ctypes.cast(functions[wanted[int(name)]], ctypes.c_void_p).value or 0
            _store(library.base + int(offset), address)


def _sections(library: Library) -> dict[str, int]:
    found: dict[str, int] = {}
    entry = library.dynamic
    while entry:
        tag, value = (ctypes.c_uint64 * 2).from_address(entry)
        if tag == 0:
            break
        if tag in _TAGS:
            is_address = not _TAGS[tag].endswith("size")
            found[_TAGS[tag]] = value + library.base if is_address and value < library.base else value
        entry += 16
    return found


def _offsets(names: bytes, name: str) -> Iterator[int]:
    """Yield where a name ends a string of the table; longer names may share its end."""
    searched = name.encode() + b"\0"
    position = names.find(searched)
    while position >= 0:
        yield position
        position = names.find(searched, position + 1)


def _array(address: int, count: int, kind: np.dtype[np.void]) -> NDArray[Any]:
    memory: Any = (ctypes.c_char * (count * kind.itemsize)).from_address(address)
    return np.frombuffer(memory, kind)


def _store(slot: int, address: int) -> None:
    """Write an address to a page that may be read-only since the library was loaded."""
    page = slot - slot % mmap.PAGESIZE
    if ctypes.CDLL(None).mprotect(ctypes.c_void_p(page), ctypes.c_size_t(mmap.PAGESIZE), _READ_WRITE) == 0:
        ctypes.c_uint64.from_address(slot).value = address
