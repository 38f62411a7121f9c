"""macOS's universal libraries: those of several processors in one file (Mach-O's fat header, <mach-o/fat.h>)."""

import struct
from collections.abc import Sequence

_MAGIC, _ALIGNMENT = 0xCAFEBABE, 14


def universal(libraries: Sequence[bytes]) -> bytes:
    """Return 64-bit Mach-O libraries as one, each at a multiple of 16 KiB."""
    step = 1 << _ALIGNMENT
    header = struct.pack(">II", _MAGIC, len(libraries))
    offset, body = step, b""
    for library in libraries:
        processor, variant = struct.unpack_from("<II", library, 4)
        header += struct.pack(">IIIII", processor, variant, offset, len(library), _ALIGNMENT)
        padded = library + bytes(-len(library) % step)
        body += padded
        offset += len(padded)
    return header.ljust(step, b"\0") + body
